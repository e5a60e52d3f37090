//! What a step of a `SelfCalibrator` did, as a frozen Python value.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::selfcalib as core;

use crate::convert::{item, known_keys};

/// What a step of a `SelfCalibrator` did.
#[pyclass(frozen, module = "tiltvp._core", eq)]
#[derive(Clone, PartialEq)]
pub(crate) struct CalibrationStep {
    /// Normalised innovation squared of the bearings that were fused: chi-square of `used` degrees of freedom.
    #[pyo3(get)]
    nis: f64,
    /// Bearings of known landmarks that were fused.
    #[pyo3(get)]
    used: usize,
    /// Bearings of known landmarks that did not pass the gate.
    #[pyo3(get)]
    rejected: usize,
    /// Landmarks seen for the first time.
    #[pyo3(get)]
    started: usize,
}

impl From<core::CalibrationStep> for CalibrationStep {
    fn from(step: core::CalibrationStep) -> Self {
        Self { nis: step.nis, used: step.used, rejected: step.rejected, started: step.started }
    }
}

#[pymethods]
impl CalibrationStep {
    fn __repr__(&self) -> String {
        let Self { nis, used, rejected, started } = self;
        format!("CalibrationStep(nis={nis:.3}, used={used}, rejected={rejected}, started={started})")
    }

    /// The attributes by name.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("nis", self.nis)?;
        dict.set_item("used", self.used)?;
        dict.set_item("rejected", self.rejected)?;
        dict.set_item("started", self.started)?;
        Ok(dict)
    }

    /// The step of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        known_keys(values, &["nis", "used", "rejected", "started"])?;
        let count = |key| item(values, key, "a whole number from 0");
        Ok(Self {
            nis: item(values, "nis", "a number")?,
            used: count("used")?,
            rejected: count("rejected")?,
            started: count("started")?,
        })
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
