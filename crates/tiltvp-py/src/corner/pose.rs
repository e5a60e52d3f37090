//! The pose of a corner before a pair of cameras, as a frozen Python value: `CornerPose`.

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::corner as core;

use super::{attitude, matrix};
use crate::call::invalid;
use crate::convert;

/// Keys of the dict of a `CornerPose`.
const KEYS: [&str; 9] = [
    "camera_from_object",
    "vertex_m",
    "covariance",
    "probability",
    "mirrored",
    "case",
    "right_handed",
    "chi_square",
    "fused",
];

/// One pose of a corner before a pair of cameras.
#[pyclass(frozen, module = "tiltvp._core", eq)]
#[derive(Clone, PartialEq)]
pub(crate) struct CornerPose {
    inner: core::CornerPose,
}

impl From<core::CornerPose> for CornerPose {
    fn from(inner: core::CornerPose) -> Self {
        Self { inner }
    }
}

#[pymethods]
impl CornerPose {
    /// Fresh (3, 3) float64: the rotation R in v_camera = R v_object, of the left camera.
    #[getter]
    fn camera_from_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.camera_from_object)
    }

    /// Fresh (3,) float64: the vertex in the left camera's frame, metres.
    #[getter]
    fn vertex_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.vertex_m.as_slice())
    }

    /// Fresh (6, 6) float64: covariance of the rotation vector (radians) and of the vertex (metres), left camera's frame.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.covariance)
    }

    /// The probability that it is this pose and none of the others, in [0, 1].
    #[getter]
    fn probability(&self) -> f64 {
        self.inner.probability
    }

    /// Whether this is the second of the two interpretations in the left image (fig. 3c).
    #[getter]
    fn mirrored(&self) -> bool {
        self.inner.mirrored
    }

    /// How the edges of the imaginary box stand to the left camera.
    #[getter]
    fn case(&self) -> &'static str {
        self.inner.case.name()
    }

    /// Whether the edges x, y, z are a right-handed triple.
    #[getter]
    fn right_handed(&self) -> bool {
        self.inner.right_handed
    }

    /// The squared misses of the rays, each by its covariance: chi-square of six degrees of freedom.
    #[getter]
    fn chi_square(&self) -> f64 {
        self.inner.chi_square
    }

    /// Whether all six rays were fused by least squares.
    #[getter]
    fn fused(&self) -> bool {
        self.inner.fused
    }

    /// Fresh (3,) float64: where the left camera is in the object's frame, metres.
    #[getter]
    fn camera_in_object_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.camera_in_object_m().as_slice())
    }

    /// Fresh (3, 3) float64: its covariance, square metres.
    #[getter]
    fn camera_in_object_covariance_m2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.camera_in_object_covariance_m2())
    }

    /// The attributes by name; arrays as nested lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("camera_from_object", matrix::nested(&self.inner.camera_from_object))?;
        dict.set_item("vertex_m", <[f64; 3]>::from(self.inner.vertex_m))?;
        dict.set_item("covariance", matrix::nested(&self.inner.covariance))?;
        dict.set_item("probability", self.inner.probability)?;
        dict.set_item("mirrored", self.inner.mirrored)?;
        dict.set_item("case", self.case())?;
        dict.set_item("right_handed", self.inner.right_handed)?;
        dict.set_item("chi_square", self.inner.chi_square)?;
        dict.set_item("fused", self.inner.fused)?;
        Ok(dict)
    }

    /// The value of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values.cast::<PyDict>().map_err(|_| invalid("values: expected a dict".to_owned()))?;
        convert::known_keys(values, &KEYS)?;
        let vertex: [f64; 3] = convert::item(values, "vertex_m", "three numbers")?;
        Ok(Self {
            inner: core::CornerPose {
                camera_from_object: matrix::item(values, "camera_from_object")?,
                vertex_m: Vector3::from(vertex),
                covariance: matrix::item(values, "covariance")?,
                probability: convert::item(values, "probability", "a number")?,
                mirrored: convert::item(values, "mirrored", "True or False")?,
                case: attitude::case(values)?,
                right_handed: convert::item(values, "right_handed", "True or False")?,
                chi_square: convert::item(values, "chi_square", "a number")?,
                fused: convert::item(values, "fused", "True or False")?,
            },
        })
    }

    fn __repr__(&self) -> String {
        let core::CornerPose { vertex_m: v, probability, chi_square, .. } = &self.inner;
        format!(
            "CornerPose(vertex_m=({:.4}, {:.4}, {:.4}), probability={probability:.6}, case=\"{}\", chi_square={chi_square:.2})",
            v.x,
            v.y,
            v.z,
            self.case()
        )
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        let [x, y, z]: [f64; 3] = self.inner.vertex_m.into();
        PyTuple::new(py, [x, y, z, self.inner.probability, self.inner.chi_square].map(f64::to_bits))?.hash()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        (slf.get_type().getattr("from_dict")?, (slf.get().to_dict(slf.py())?,)).into_pyobject(slf.py())
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}
