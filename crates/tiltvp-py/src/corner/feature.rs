//! `CornerFeature`: one vertex and three rays as a frozen Python value.

use nalgebra::{Matrix2, Vector3};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::corner::{self as core, FittedRay};

use crate::call::invalid;
use crate::convert;

/// Keys of the dict of a `CornerFeature`.
const KEYS: [&str; 5] = ["normals", "ray_covariances_rad2", "toward", "support_px", "ray_rms_rad"];

/// One vertex and the three rays x, y (the vertical one) and z of a corner, as one camera sees it.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct CornerFeature {
    inner: core::CornerFeature,
}

impl CornerFeature {
    pub(crate) fn new(inner: &core::CornerFeature) -> Self {
        Self { inner: *inner }
    }

    pub(crate) fn inner(&self) -> &core::CornerFeature {
        &self.inner
    }

    fn matrix<'py>(&self, py: Python<'py>, pick: fn(&FittedRay) -> Vector3<f64>) -> PyResult<Bound<'py, PyAny>> {
        convert::to_rows(py, &self.inner.rays().map(|ray| pick(&ray).into()), false)
    }
}

#[pymethods]
impl CornerFeature {
    /// Fresh (3,) float64: unit bearing of the vertex, camera frame.
    #[getter]
    fn vertex<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.vertex().as_slice())
    }

    /// Fresh (2, 2) float64: covariance of the vertex in its tangent plane, square radians.
    #[getter]
    fn vertex_covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        convert::to_matrix2(py, &self.inner.vertex_covariance())
    }

    /// Root mean square of the vertex' distances from the three rays' great circles, radians.
    #[getter]
    fn residual_rad(&self) -> f64 {
        self.inner.residual_rad()
    }

    /// The probability that three edges that do meet miss their vertex by more.
    #[getter]
    fn meets_probability(&self) -> f64 {
        self.inner.meets_probability()
    }

    /// Fresh (3, 3) float64, rows x, y, z: unit normals of the rays' great circles, `vertex x toward` up to length.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, |ray| ray.normal)
    }

    /// Fresh (3, 3) float64, rows x, y, z: a unit bearing near the far end of each ray.
    #[getter]
    fn toward<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, |ray| ray.toward)
    }

    /// Fresh (3, 2, 2) float64: covariance of each normal in its tangent plane, square radians.
    #[getter]
    fn ray_covariances_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let flat: Vec<f64> =
            self.inner.rays().iter().flat_map(|ray| ray.covariance.transpose().as_slice().to_vec()).collect();
        convert::to_matrices(py, &flat, [2, 2], false)
    }

    /// How many places of each ray it was fitted to.
    #[getter]
    fn support_px(&self) -> [usize; 3] {
        self.inner.rays().map(|ray| ray.support)
    }

    /// Root mean square distance of these from each ray, radians.
    #[getter]
    fn ray_rms_rad(&self) -> [f64; 3] {
        self.inner.rays().map(|ray| ray.residual_rms_rad)
    }

    fn __repr__(&self) -> String {
        let vertex = self.inner.vertex();
        let [x, y, z] = self.support_px();
        format!("CornerFeature(vertex ({:.4}, {:.4}, {:.4}), support {x} {y} {z} px)", vertex.x, vertex.y, vertex.z)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner.rays() == other.get().inner.rays())
    }

    /// Plain numbers and lists, good for JSON.
    pub(super) fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let rays = self.inner.rays();
        let rows = |pick: fn(&FittedRay) -> Vector3<f64>| rays.map(|ray| <[f64; 3]>::from(pick(&ray)));
        dict.set_item("normals", rows(|ray| ray.normal))?;
        let covariance =
            |ray: &FittedRay| [[ray.covariance.m11, ray.covariance.m12], [ray.covariance.m21, ray.covariance.m22]];
        dict.set_item("ray_covariances_rad2", rays.each_ref().map(covariance))?;
        dict.set_item("toward", rows(|ray| ray.toward))?;
        dict.set_item("support_px", self.support_px())?;
        dict.set_item("ray_rms_rad", self.ray_rms_rad())?;
        Ok(dict)
    }

    /// The corner that `to_dict` wrote.
    #[classmethod]
    pub(super) fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        convert::known_keys(values, &KEYS)?;
        let rows = |key: &str| convert::item::<[[f64; 3]; 3]>(values, key, "three rows of three numbers");
        let (normals, toward) = (rows("normals")?, rows("toward")?);
        let covariances: [[[f64; 2]; 2]; 3] = convert::item(values, "ray_covariances_rad2", "three 2 x 2 matrices")?;
        let support: [usize; 3] = convert::item(values, "support_px", "three whole numbers")?;
        let rms: [f64; 3] = convert::item(values, "ray_rms_rad", "three numbers")?;
        let rays = std::array::from_fn(|i| {
            let [[a, b], [c, d]] = covariances[i];
            FittedRay {
                normal: normals[i].into(),
                covariance: Matrix2::new(a, b, c, d),
                toward: toward[i].into(),
                support: support[i],
                residual_rms_rad: rms[i],
            }
        });
        let inner = core::CornerFeature::from_rays(rays);
        let inner = inner.ok_or_else(|| invalid("values: rays that are not valid or do not meet".to_owned()))?;
        Ok(Self { inner })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        (slf.get_type().getattr("from_dict")?, (slf.get().to_dict(py)?,)).into_pyobject(py)
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}
