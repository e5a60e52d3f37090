//! `CornerEstimate` and `CornerHypothesis`: what a frame tells, as frozen Python values.

use nalgebra::{Matrix3, Matrix6, Vector3};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use tiltvp_core::corner::{self as core, CornerVerdict, EdgeEnd, Hypothesis};

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
        /// Fresh (3,) float64: the vertex in the left camera's frame, metres; None from one image without `camera_height_m`.
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
        /// no image shows that. From two grey images and with right angles.
        edge_lengths_m: [Option<f64>; 3] = own.ends.map(|end| end.map(|end| end.length_m)),
        /// Fresh (3, 3) float64, rows x, y, z: where these edges end in the left camera's frame, metres, from both images
        /// alone; NaN where only one of them shows it, or none.
        edge_ends_m: [Option<Vector3<f64>>; 3] = own.ends.map(|end| end.and_then(|end| end.place_m)),
        /// Whether the pose of a frame before was a prior.
        followed: bool,
        /// The number of the corner that is the object, from 1: it grows where another corner has become the object; from
        /// one camera, whose attitude all parallel corners share, only after the poses before were forgotten.
        object: u32,
    }
    make {
        let verdict = CornerVerdict::ALL.into_iter().find(|verdict| verdict.reason() == reason);
        let end = |k: usize| edge_lengths_m[k].map(|length_m| EdgeEnd { length_m, place_m: edge_ends_m[k] });
        let inner = |features: Vec<CornerFeature>| features.into_iter().map(|feature| feature.inner).collect();
        core::CornerEstimate {
            hypotheses: hypotheses.into_iter().map(|hypothesis| hypothesis.inner).collect(),
            verdict: verdict
                .ok_or_else(|| invalid(format!("values[\"reason\"] = {reason:?}, expected one that `reason` gives")))?,
            features: [inner(features_left), inner(features_right)],
            chosen_left,
            chosen_right,
            ends: [end(0), end(1), end(2)],
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
                let [x, y, z]: [Bound<'_, PyAny>; 3] = convert::whole(value, name, $expected)?;
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
