//! `common_direction`: the robust core on normals that the user brings.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::tilt::{self as core, CommonDirectionOptions};

use crate::call::call;
use crate::convert;

/// A direction orthogonal to most of the normals.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct CommonDirection {
    inner: core::CommonDirection,
}

#[pymethods]
impl CommonDirection {
    #[getter]
    fn direction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let direction = self.inner.direction.map_or([f64::NAN; 3], Into::into);
        PyArray1::from_slice(py, &direction)
    }

    #[getter]
    fn covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        convert::to_matrix2(py, &self.inner.covariance_rad2)
    }

    #[getter]
    fn inliers<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_slice(py, &self.inner.inliers)
    }

    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("reason", self.inner.stop.to_string())?;
        dict.set_item("iterations", self.inner.iterations)?;
        dict.set_item("residual_rms", self.inner.residual_rms_rad)?;
        Ok(dict)
    }

    fn __bool__(&self) -> bool {
        self.inner.direction.is_some()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner == other.get().inner)
    }

    fn __repr__(&self) -> String {
        let inliers = self.inner.inliers.iter().filter(|i| **i).count();
        match self.inner.direction {
            Some(d) => format!(
                "CommonDirection(direction=[{:.6}, {:.6}, {:.6}], {inliers} of {} inliers, {})",
                d.x,
                d.y,
                d.z,
                self.inner.inliers.len(),
                self.inner.stop
            ),
            None => format!("CommonDirection(none: {})", self.inner.stop),
        }
    }
}

/// The direction most nearly orthogonal to great-circle normals `(N, 3)`.
#[pyfunction]
#[pyo3(signature = (normals, *, weights=None, sigma_rad=None, prior=None, max_angle_rad=None))]
pub(crate) fn common_direction(
    py: Python<'_>,
    normals: &Bound<'_, PyAny>,
    weights: Option<&Bound<'_, PyAny>>,
    sigma_rad: Option<f64>,
    prior: Option<&Bound<'_, PyAny>>,
    max_angle_rad: Option<f64>,
) -> PyResult<CommonDirection> {
    let normals: Vec<_> = convert::rows::<3>(normals, "normals")?.0.into_iter().map(Into::into).collect();
    let weights = weights.map(|w| convert::vector(w, "weights")).transpose()?;
    let defaults = CommonDirectionOptions::default();
    let options = CommonDirectionOptions {
        sigma_rad: sigma_rad.unwrap_or(defaults.sigma_rad),
        prior: prior.map_or(Ok(defaults.prior), |p| convert::vector3(p, "prior"))?,
        max_angle_rad: max_angle_rad.unwrap_or(defaults.max_angle_rad),
    };
    let inner = call(py, || core::common_direction(&normals, weights.as_deref(), &options))?;
    Ok(CommonDirection { inner })
}
