//! The pose of a corner before a pair of cameras, as a frozen Python value: `CornerPose`.

use nalgebra::{Matrix3, Matrix6, Vector3};
use pyo3::prelude::*;
use tiltvp_core::corner::{self as core, CornerCase};

use crate::array::Array;
use crate::convert;
use crate::value::value;

value! {
    /// One pose of a corner before a pair of cameras. Frozen, comparable, hashable, and to be pickled.
    CornerPose(core::CornerPose as own) {
        /// Fresh (3, 3) float64: the rotation R in v_camera = R v_object, of the left camera.
        camera_from_object: Matrix3<f64>,
        /// (3,): the vertex, which is the object's origin, in the left camera's frame, metres.
        vertex_m: Vector3<f64>,
        /// Fresh (6, 6) float64: covariance of the rotation vector (radians) and of the vertex (metres), left camera's frame.
        covariance: Matrix6<f64>,
        /// The probability that it is this pose and none of the others that the rays admit, in [0, 1].
        probability: f64,
        /// Whether this is the second of the two interpretations in the left image (fig. 3c).
        mirrored: bool,
        /// How the edges of the imaginary box stand to the left camera's line of sight.
        case: CornerCase,
        /// Whether the edges x, y, z are a right-handed triple.
        right_handed: bool,
        /// The squared misses of the rays, each by its covariance: chi-square of six degrees of freedom.
        chi_square: f64,
        /// Whether all six rays were fused; where not, covariances between attitude and vertex are left out.
        fused: bool,
    }
}

#[pymethods]
impl CornerPose {
    /// Fresh (3,) float64: where the left camera is in the object's frame, metres.
    #[getter]
    fn camera_in_object_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, &self.inner.camera_in_object_m())
    }

    /// Fresh (3, 3) float64: its covariance, square metres.
    #[getter]
    fn camera_in_object_covariance_m2<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, &self.inner.camera_in_object_covariance_m2())
    }
}
