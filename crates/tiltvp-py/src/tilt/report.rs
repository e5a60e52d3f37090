//! `FitReport`: how a robust fit went and why it stopped, as a frozen Python value.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::robust::Stop;

use super::values;
use crate::convert;

/// How a robust fit went: the word and the sentence for why it stopped, its iterations and its residual.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct FitReport {
    /// Why the fit stopped, in a word.
    #[pyo3(get)]
    stop: String,
    /// Why the fit stopped, in a sentence with the measured number and the limit.
    #[pyo3(get)]
    pub(super) reason: String,
    /// Random samples drawn or refits done.
    #[pyo3(get)]
    iterations: u32,
    /// Root mean square residual of the inliers: radians, or pixels of the image-space methods; NaN without a model.
    #[pyo3(get)]
    residual_rms: f64,
}

impl FitReport {
    pub(super) fn new(stop: Stop, iterations: u32, residual_rms: f64) -> Self {
        let word = match stop {
            Stop::Confident { .. } => "confident",
            Stop::TrialLimit { .. } => "trial-limit",
            Stop::Converged { .. } => "converged",
            Stop::Settled { .. } => "settled",
            Stop::IterationLimit { .. } => "iteration-limit",
            Stop::TooFew { .. } => "too-few",
            Stop::NoModel { .. } => "no-model",
            Stop::OutOfReach { .. } => "out-of-reach",
        };
        Self { stop: word.to_owned(), reason: stop.to_string(), iterations, residual_rms }
    }

    /// Reads what [`to_dict`](Self::to_dict) wrote; other keys are left alone.
    pub(super) fn read(values: &Bound<'_, PyDict>) -> PyResult<Self> {
        Ok(Self {
            stop: convert::item(values, "stop", "text")?,
            reason: convert::item(values, "reason", "text")?,
            iterations: convert::item(values, "iterations", "a count")?,
            residual_rms: convert::item(values, "residual_rms", "a number")?,
        })
    }

    /// Everything as bits, so that equal means the same bytes and NaN equals itself.
    pub(super) fn bits(&self) -> (&str, &str, u32, u64) {
        (&self.stop, &self.reason, self.iterations, self.residual_rms.to_bits())
    }
}

#[pymethods]
impl FitReport {
    /// The attributes by name.
    pub(super) fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("stop", &self.stop)?;
        dict.set_item("reason", &self.reason)?;
        dict.set_item("iterations", self.iterations)?;
        dict.set_item("residual_rms", self.residual_rms)?;
        Ok(dict)
    }

    /// The report of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::read(values::dict(values, &["stop", "reason", "iterations", "residual_rms"])?)
    }

    fn __repr__(&self) -> String {
        format!(
            "FitReport(stop=\"{}\", reason=\"{}\", iterations={}, residual_rms={:.3e})",
            self.stop, self.reason, self.iterations, self.residual_rms
        )
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.bits() == other.get().bits())
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        self.bits().into_pyobject(py)?.hash()
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
