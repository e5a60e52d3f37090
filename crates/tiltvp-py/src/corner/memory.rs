//! What an estimator keeps from frame to frame, as pickle keeps it.

use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use tiltvp_core::corner::{self as core, KnownCorner, Track};

use super::estimate::CornerHypothesis;
use super::feature::CornerFeature;
use crate::convert;
use crate::field::{Field, Value};

/// Keys of the dict of what is kept.
const KEYS: [&str; 7] = ["pose", "corners_left", "corners_right", "age", "object", "others", "pace"];

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
    })
}
