//! `CornerEstimate`, `BelievedCorner` and `CornerHypothesis`: what a frame tells, as frozen Python values.

use nalgebra::{Matrix3, Matrix6, Vector3};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use tiltvp_core::corner::{self as core, CornerVerdict, EdgeAngle, EdgeEnd, Hypothesis, PlaceVerdict};

use super::feature::CornerFeature;
use crate::array::Array;
use crate::call::invalid;
use crate::convert;
use crate::field::Field;
use crate::value::value;

value! {
    /// One explanation of what is seen: an attitude, from two cameras also a place, and how likely it is.
    ///
    /// Frozen, comparable, and to be pickled.
    CornerHypothesis(Hypothesis as own) {
        /// Fresh (3, 3) float64: the rotation from the object's frame (y along the vertical edge, away from the vertex, x
        /// along the edge x) to the left camera's.
        camera_from_object: Matrix3<f64>,
        /// Fresh (3, 3) float64, rows x, y, z: directions of the corner's edges away from its vertex, left camera's frame.
        /// The frame of `camera_from_object` keeps its axes from frame to frame, whatever the edges are called.
        edges: [Vector3<f64>; 3],
        /// Fresh (3,) float64: the vertex in the left camera's frame, metres; None from one image without
        /// `camera_height_m`, `edge_length_m` or `box_size_m`, and where these do not tell it.
        vertex_m: Option<Vector3<f64>>,
        /// Fresh (6, 6) float64: covariance of the attitude's rotation vector (left camera's frame, radians) and of the
        /// vertex (metres; zero where that is None).
        covariance: Matrix6<f64>,
        /// The probability that it is this one, in [0, 1].
        probability: f64,
        /// Whether the edges x, y, z are a right-handed triple, as of an outer corner.
        right_handed: bool,
        /// Root mean square misfit per degree of freedom in standard deviations of the rays; 0 for a single feature.
        misfit: f64,
    }
}

#[pymethods]
impl CornerHypothesis {
    /// Fresh (3,) float64: where the left camera is in the object's frame, metres; None where `vertex_m` is.
    #[getter]
    fn camera_in_object_m<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f64>>> {
        self.inner.camera_in_object_m().map(|place| convert::to_matrix(py, &place)).transpose()
    }
}

value! {
    /// A corner of a frame that is believed: seen in all images, in one way, with one interpretation that stands out.
    ///
    /// Frozen, comparable, and to be pickled.
    BelievedCorner(core::BelievedCorner as own) {
        /// The name of its place in the world, from 1: kept from frame to frame, and when the corner was out of sight and is
        /// seen again. None where it has no place or one that is hardly known, and where it is too near to a named place to
        /// be told from it.
        id: Option<u32>,
        /// All of its hypotheses, the likeliest first.
        hypotheses: Vec<CornerHypothesis> = own.hypotheses.iter().copied().map(CornerHypothesis::from).collect(),
        /// Which corner of `features_left` it is.
        left: usize,
        /// Which corner of `features_right` it is; None with one camera.
        right: Option<usize>,
        /// Fresh (3,) float64: how long its edges x, y, z are, metres, as `CornerEstimate.edge_lengths_m`; NaN where no image
        /// shows it.
        edge_lengths_m: [Option<f64>; 3] = own.ends.map(|end| end.map(|end| end.length_m)),
        /// Fresh (3,) float64: the standard deviations of these lengths, metres.
        edge_length_sigmas_m: [Option<f64>; 3] = own.ends.map(|end| end.map(|end| end.sigma_m)),
        /// Fresh (3, 3) float64, rows x, y, z: where its edges end in the left camera's frame, metres, as
        /// `CornerEstimate.edge_ends_m`.
        edge_ends_m: [Option<Vector3<f64>>; 3] = own.ends.map(|end| end.and_then(|end| end.place_m)),
        /// Fresh (3,) float64: the angles between the edges y and z, z and x, x and y, radians, from the planes of each edge in
        /// both images alone; NaN from one image, and where the two planes of an edge nearly coincide.
        edge_angles_rad: [Option<f64>; 3] = own.angles.map(|angle| angle.map(|angle| angle.angle_rad)),
        /// Fresh (3,) float64: the standard deviations of these angles, radians.
        edge_angle_sigmas_rad: [Option<f64>; 3] = own.angles.map(|angle| angle.map(|angle| angle.sigma_rad)),
    }
    make {
        if hypotheses.is_empty() {
            return Err(invalid("values[\"hypotheses\"]: none, expected one or more".to_owned()));
        }
        let angle = |(angle, sigma): (Option<f64>, Option<f64>)| {
            Some(EdgeAngle { angle_rad: angle?, sigma_rad: sigma.unwrap_or(f64::NAN) })
        };
        core::BelievedCorner {
            id,
            hypotheses: hypotheses.into_iter().map(|hypothesis| hypothesis.inner).collect(),
            left,
            right,
            ends: ends(&edge_lengths_m, &edge_length_sigmas_m, &edge_ends_m),
            angles: [0, 1, 2].map(|k| angle((edge_angles_rad[k], edge_angle_sigmas_rad[k]))),
        }
    };
    repr {
        let probability = own.hypotheses[0].probability;
        match own.id {
            Some(id) => format!("BelievedCorner(id {id}, probability {probability:.3})"),
            None => format!("BelievedCorner(no id, probability {probability:.3})"),
        }
    };
}

#[pymethods]
impl BelievedCorner {
    /// Its pose, the likeliest of its hypotheses.
    #[getter]
    fn pose(&self) -> CornerHypothesis {
        self.inner.hypotheses[0].into()
    }
}

fn ends(
    lengths_m: &[Option<f64>; 3],
    sigmas_m: &[Option<f64>; 3],
    places_m: &[Option<Vector3<f64>>; 3],
) -> [Option<EdgeEnd>; 3] {
    [0, 1, 2].map(|k| {
        let sigma_m = sigmas_m[k].unwrap_or(f64::NAN);
        lengths_m[k].map(|length_m| EdgeEnd { length_m, sigma_m, place_m: places_m[k] })
    })
}

value! {
    /// What one frame tells of a corner: the likeliest pose if one stands out, and all hypotheses. False without a
    /// pose.
    ///
    /// Frozen, comparable, and to be pickled.
    CornerEstimate(core::CornerEstimate as own) {
        /// All hypotheses, the likeliest first.
        hypotheses: Vec<CornerHypothesis> = own.hypotheses.iter().copied().map(CornerHypothesis::from).collect(),
        /// Why there is no pose; empty where there is one.
        reason: String = own.verdict.reason().to_owned(),
        /// The corners of the left or only image.
        features_left: Vec<CornerFeature> = features(own, 0),
        /// The corners of the right image.
        features_right: Vec<CornerFeature> = features(own, 1),
        /// Which corners of the left image the pose is from, the one that is its object first.
        chosen_left: Vec<usize>,
        /// Which corner of the right image it is from, or None.
        chosen_right: Option<usize>,
        /// Fresh (3,) float64: how long the edges x, y, z are, metres, to where lines along the others meet them; NaN where
        /// no image shows that. From two grey images with right angles, and from one image with a known length.
        edge_lengths_m: [Option<f64>; 3] = own.ends.map(|end| end.map(|end| end.length_m)),
        /// Fresh (3,) float64: the standard deviations of these lengths, metres.
        edge_length_sigmas_m: [Option<f64>; 3] = own.ends.map(|end| end.map(|end| end.sigma_m)),
        /// Fresh (3, 3) float64, rows x, y, z: where these edges end in the left camera's frame, metres, from both images
        /// alone; NaN where only one of them shows it, or none. With a known length from the pose of the one image.
        edge_ends_m: [Option<Vector3<f64>>; 3] = own.ends.map(|end| end.and_then(|end| end.place_m)),
        /// All corners that are believed, each with a name, that of the pose first. From one camera that of the pose alone.
        corners: Vec<BelievedCorner> = own.corners.iter().cloned().map(BelievedCorner::from).collect(),
        /// Why the likeliest hypothesis has no place; empty where it has one, and where there is none.
        place_reason: String = own.place.reason().to_owned(),
        /// Whether the pose of a frame before was a prior.
        followed: bool,
        /// The number of the corner that is the object, from 1: it grows where another corner has become the object; from
        /// one camera, whose attitude all parallel corners share, only after the poses before were forgotten.
        object: u32,
    }
    make {
        let verdict = CornerVerdict::ALL.into_iter().find(|verdict| verdict.reason() == reason);
        let place = PlaceVerdict::ALL.into_iter().find(|place| place.reason() == place_reason).ok_or_else(|| {
            invalid(format!("values[\"place_reason\"] = {place_reason:?}, expected one that `place_reason` gives"))
        })?;
        let inner = |features: Vec<CornerFeature>| features.into_iter().map(|feature| feature.inner).collect();
        core::CornerEstimate {
            hypotheses: hypotheses.into_iter().map(|hypothesis| hypothesis.inner).collect(),
            verdict: verdict
                .ok_or_else(|| invalid(format!("values[\"reason\"] = {reason:?}, expected one that `reason` gives")))?,
            features: [inner(features_left), inner(features_right)],
            chosen_left,
            chosen_right,
            ends: ends(&edge_lengths_m, &edge_length_sigmas_m, &edge_ends_m),
            corners: corners.into_iter().map(|corner| corner.inner).collect(),
            place,
            followed,
            object,
        }
    };
    repr {
        let count = own.hypotheses.len();
        match own.pose() {
            Some(pose) => format!("CornerEstimate(probability {:.3}, {count} hypotheses)", pose.probability),
            None => format!("CornerEstimate(no pose: {}, {count} hypotheses)", own.verdict.reason()),
        }
    };
}

fn features(estimate: &core::CornerEstimate, camera: usize) -> Vec<CornerFeature> {
    estimate.features[camera].iter().copied().map(CornerFeature::from).collect()
}

#[pymethods]
impl CornerEstimate {
    /// The pose, a `CornerHypothesis`; None where none stands out.
    #[getter]
    fn pose(&self) -> Option<CornerHypothesis> {
        self.inner.pose().copied().map(CornerHypothesis::from)
    }

    /// The probability of the likeliest hypothesis; 0 where there is none.
    #[getter]
    fn confidence(&self) -> f64 {
        self.inner.hypotheses.first().map_or(0.0, |best| best.probability)
    }

    fn __bool__(&self) -> bool {
        self.inner.pose().is_some()
    }
}

/// What not every edge has: NaN in an array, None in a dict.
macro_rules! of_edges {
    ($($type:ty, $nan:expr, $stacked:ty, $expected:expr;)*) => {$(
        impl Field for [Option<$type>; 3] {
            type Attribute<'py> = Array<'py, f64>;

            fn attribute<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
                <$stacked>::from(self.map(|own| own.unwrap_or($nan))).attribute(py)
            }

            fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                self.iter().map(|own| own.plain(py)).collect::<PyResult<Vec<_>>>()?.into_bound_py_any(py)
            }

            fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
                let [x, y, z]: [Bound<'_, PyAny>; 3] = convert::taken(value, name, $expected)?;
                Ok([Option::read(&x, name)?, Option::read(&y, name)?, Option::read(&z, name)?])
            }

            fn bits(&self, bits: &mut Vec<u64>) {
                for own in self {
                    own.bits(bits);
                }
            }

            fn show(&self) -> Option<String> {
                None
            }
        }
    )*};
}

of_edges! {
    f64, f64::NAN, Vector3<f64>, "three numbers or None";
    Vector3<f64>, Vector3::repeat(f64::NAN), [Vector3<f64>; 3], "three places or None";
}
