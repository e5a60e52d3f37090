//! `common_direction`: the robust core on normals that the user brings.

use nalgebra::{Matrix2, Vector3};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::tilt::{self as core, CommonDirectionOptions};

use super::report::FitReport;
use super::values;
use crate::call::call;
use crate::convert;

/// Keys of the dict of a `CommonDirection`.
const KEYS: [&str; 7] = ["direction", "covariance_rad2", "inliers", "stop", "reason", "iterations", "residual_rms"];

/// A direction orthogonal to most of the normals: itself, its covariance, who agrees, and how the fit went.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct CommonDirection {
    direction: Option<Vector3<f64>>,
    covariance: Matrix2<f64>,
    inliers: Vec<bool>,
    /// How the fit went; the residual is in radians.
    #[pyo3(get)]
    report: FitReport,
}

impl CommonDirection {
    fn vector(&self) -> [f64; 3] {
        self.direction.map_or([f64::NAN; 3], Into::into)
    }

    /// Everything as bits, so that equal means the same bytes and NaN equals itself.
    fn bits(&self) -> impl PartialEq + use<'_> {
        let covariance = values::covariance_bits(&self.covariance);
        (self.vector().map(f64::to_bits), covariance, &self.inliers, self.report.bits())
    }
}

#[pymethods]
impl CommonDirection {
    /// Fresh (3,) float64: the unit direction on the prior's side; NaN if the normals do not determine one.
    #[getter]
    fn direction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.vector())
    }

    /// Fresh (2, 2) float64 in squared radians: covariance in the tangent plane; infinite without a direction.
    #[getter]
    fn covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        convert::to_matrix2(py, &self.covariance)
    }

    /// Fresh (N,) bool: the normals whose great circles pass within three sigma_rad of the direction.
    #[getter]
    fn inliers<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_slice(py, &self.inliers)
    }

    /// Whether there is a direction.
    fn __bool__(&self) -> bool {
        self.direction.is_some()
    }

    /// The attributes by name, those of the report among them; arrays as nested lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("direction", self.vector().to_vec())?;
        values::set_covariance(&dict, &self.covariance)?;
        dict.set_item("inliers", self.inliers.clone())?;
        dict.update(self.report.to_dict(py)?.as_mapping())?;
        Ok(dict)
    }

    /// The value of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values::dict(values, &KEYS)?;
        let direction = convert::vector3(&convert::raw_item(values, "direction")?, "values[\"direction\"]")?;
        Ok(Self {
            direction: direction.iter().all(|x| x.is_finite()).then_some(direction),
            covariance: values::covariance(values)?,
            inliers: convert::item(values, "inliers", "a list of bool")?,
            report: FitReport::read(values)?,
        })
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.bits() == other.get().bits())
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        (self.vector().map(f64::to_bits).to_vec(), self.inliers.len(), self.report.bits())
            .into_pyobject(py)?
            .repr()?
            .hash()
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

    fn __repr__(&self) -> String {
        let inliers = self.inliers.iter().filter(|i| **i).count();
        match self.direction {
            Some(d) => format!(
                "CommonDirection(direction=[{:.6}, {:.6}, {:.6}], {inliers} of {} inliers, {})",
                d.x,
                d.y,
                d.z,
                self.inliers.len(),
                self.report.reason
            ),
            None => format!("CommonDirection(none: {})", self.report.reason),
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
    let found = call(py, || core::common_direction(&normals, weights.as_deref(), &options))?;
    Ok(CommonDirection {
        direction: found.direction,
        covariance: found.covariance_rad2,
        inliers: found.inliers,
        report: FitReport::new(found.stop, found.iterations, found.residual_rms_rad),
    })
}
