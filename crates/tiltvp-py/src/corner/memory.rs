//! What an estimator keeps from frame to frame, as pickle keeps it.

use nalgebra::{Matrix3, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use tiltvp_core::corner::{self as core, CornerNames, KnownCorner, KnownWorld, NamedPlace, Track};
use tiltvp_core::geometry::RigidMotion;

use super::estimate::CornerHypothesis;
use super::feature::CornerFeature;
use crate::convert;
use crate::field::{Field, Value};

/// Keys of the dict of what is kept.
const KEYS: [&str; 10] =
    ["pose", "corners_left", "corners_right", "age", "object", "others", "pace", "turned", "y_is_down", "id"];

/// Plain numbers and lists.
pub(super) fn to_dict<'py>(py: Python<'py>, track: &Track) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("pose", CornerHypothesis::from(track.pose).dict(py)?)?;
    for (key, corners) in ["corners_left", "corners_right"].into_iter().zip(&track.corners) {
        let corners = corners.iter().map(|corner| CornerFeature::from(*corner).dict(py));
        dict.set_item(key, PyList::new(py, corners.collect::<PyResult<Vec<_>>>()?)?)?;
    }
    let others: Vec<([f64; 3], u32)> = track.others.iter().map(|other| (other.place_m.into(), other.seen)).collect();
    dict.set_item("others", others)?;
    dict.set_item("age", track.age)?;
    dict.set_item("object", track.object)?;
    dict.set_item("pace", track.pace)?;
    track.turned.write(&dict, "turned")?;
    dict.set_item("y_is_down", track.y_is_down)?;
    dict.set_item("id", track.id)?;
    Ok(dict)
}

/// What `to_dict` wrote.
pub(super) fn from_dict(values: &Bound<'_, PyDict>) -> PyResult<Track> {
    convert::known_keys(values, &KEYS)?;
    let corners = |key: &str| -> PyResult<Vec<core::CornerFeature>> {
        Ok(Vec::<CornerFeature>::take(values, key)?.into_iter().map(|corner| corner.inner).collect())
    };
    let others: Vec<([f64; 3], u32)> = convert::item(values, "others", "places and numbers of frames")?;
    let known = |(place, seen)| KnownCorner { place_m: Vector3::from(place), seen };
    Ok(Track {
        pose: CornerHypothesis::take(values, "pose")?.inner,
        corners: [corners("corners_left")?, corners("corners_right")?],
        age: convert::item(values, "age", "a whole number of frames")?,
        object: convert::item(values, "object", "a whole number")?,
        others: others.into_iter().map(known).collect(),
        pace: convert::item(values, "pace", "a share of the distance")?,
        turned: <Option<Matrix3<f64>> as Field>::take(values, "turned")?,
        y_is_down: convert::item(values, "y_is_down", "whether the upright axis points down, or None")?,
        id: convert::item(values, "id", "a whole number, or None")?,
    })
}

/// Keys of the dict of the corners that have a name, of a world in it, and of a place in that.
const NAMES: [&str; 2] = ["worlds", "last"];
const WORLD: [&str; 5] = ["rotation", "translation_m", "age", "pace", "places"];
const PLACE: [&str; 8] =
    ["id", "place_m", "covariance_m2", "edges", "edge_lengths_m", "edge_length_sigmas_m", "seen", "age"];

/// Plain numbers and lists.
pub(super) fn names_to_dict<'py>(py: Python<'py>, names: &CornerNames) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let worlds = names.worlds.iter().map(|world| world_to_dict(py, world)).collect::<PyResult<Vec<_>>>()?;
    dict.set_item("worlds", worlds)?;
    dict.set_item("last", names.last)?;
    Ok(dict)
}

fn world_to_dict<'py>(py: Python<'py>, world: &KnownWorld) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    world.camera_from_world.rotation.write(&dict, "rotation")?;
    world.camera_from_world.translation_m.write(&dict, "translation_m")?;
    world.age.write(&dict, "age")?;
    world.pace.write(&dict, "pace")?;
    let places = world.places.iter().map(|place| {
        let dict = PyDict::new(py);
        place.id.write(&dict, "id")?;
        place.place_m.write(&dict, "place_m")?;
        place.covariance_m2.write(&dict, "covariance_m2")?;
        place.edges.write(&dict, "edges")?;
        place.lengths_m.map(|length| length.map(|(length_m, _)| length_m)).write(&dict, "edge_lengths_m")?;
        place.lengths_m.map(|length| length.map(|(_, sigma_m)| sigma_m)).write(&dict, "edge_length_sigmas_m")?;
        place.seen.write(&dict, "seen")?;
        place.age.write(&dict, "age")?;
        Ok(dict)
    });
    dict.set_item("places", places.collect::<PyResult<Vec<_>>>()?)?;
    Ok(dict)
}

/// What `names_to_dict` wrote.
pub(super) fn names_from_dict(values: &Bound<'_, PyDict>) -> PyResult<CornerNames> {
    convert::known_keys(values, &NAMES)?;
    let worlds: Vec<Bound<'_, PyDict>> = convert::item(values, "worlds", "a list of dicts")?;
    Ok(CornerNames {
        worlds: worlds.iter().map(world_from_dict).collect::<PyResult<_>>()?,
        last: u32::take(values, "last")?,
    })
}

fn world_from_dict(values: &Bound<'_, PyDict>) -> PyResult<KnownWorld> {
    convert::known_keys(values, &WORLD)?;
    let (rotation, translation_m) = (Matrix3::take(values, "rotation")?, Vector3::take(values, "translation_m")?);
    let camera_from_world = RigidMotion { rotation, translation_m };
    let places: Vec<Bound<'_, PyDict>> = convert::item(values, "places", "a list of dicts")?;
    let place = |values: &Bound<'_, PyDict>| {
        convert::known_keys(values, &PLACE)?;
        let lengths = <[Option<f64>; 3]>::take(values, "edge_lengths_m")?;
        let sigmas = <[Option<f64>; 3]>::take(values, "edge_length_sigmas_m")?;
        Ok(NamedPlace {
            id: u32::take(values, "id")?,
            place_m: Vector3::take(values, "place_m")?,
            covariance_m2: Matrix3::take(values, "covariance_m2")?,
            edges: <[Vector3<f64>; 3]>::take(values, "edges")?,
            lengths_m: [0, 1, 2].map(|axis| lengths[axis].zip(sigmas[axis])),
            seen: u32::take(values, "seen")?,
            age: u32::take(values, "age")?,
        })
    };
    Ok(KnownWorld {
        camera_from_world,
        age: u32::take(values, "age")?,
        pace: f64::take(values, "pace")?,
        places: places.iter().map(place).collect::<PyResult<_>>()?,
    })
}
