//! `ComplementaryFilter`: rates of turn and a reference attitude, fused.

use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use tiltvp_core::filter::{ComplementaryFilter as Filter, ComplementaryOptions};

use crate::call::exception;
use crate::convert;

/// A filter and its state.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct ComplementaryFilter {
    inner: Mutex<Filter>,
}

impl ComplementaryFilter {
    fn lock(&self) -> MutexGuard<'_, Filter> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl ComplementaryFilter {
    #[new]
    #[pyo3(signature = (reference_from_body, *, time_constant_s=None, bias_time_constant_s=None))]
    fn new(
        reference_from_body: &Bound<'_, PyAny>,
        time_constant_s: Option<f64>,
        bias_time_constant_s: Option<f64>,
    ) -> PyResult<Self> {
        let own = ComplementaryOptions::default();
        let options = ComplementaryOptions {
            time_constant_s: time_constant_s.unwrap_or(own.time_constant_s),
            bias_time_constant_s: bias_time_constant_s.unwrap_or(own.bias_time_constant_s),
        };
        let start = convert::matrix3(reference_from_body, "reference_from_body")?;
        let inner = Filter::new(options, &start).map_err(|error| exception(&error))?;
        Ok(Self { inner: Mutex::new(inner) })
    }

    /// Time after which a difference from the reference has shrunk to 1/e, seconds.
    #[getter]
    fn time_constant_s(&self) -> f64 {
        self.lock().options().time_constant_s
    }

    /// Time over which a lasting difference becomes a bias of the rates, seconds.
    #[getter]
    fn bias_time_constant_s(&self) -> f64 {
        self.lock().options().bias_time_constant_s
    }

    /// (3, 3): takes vectors of the body to the frame of the reference.
    #[getter]
    fn reference_from_body<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        convert::to_matrices(py, self.lock().attitude().transpose().as_slice(), [3, 3], true)
    }

    /// (3,): the bias of the rates, rad/s.
    #[getter]
    fn bias_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        convert::to_rows(py, &[self.lock().bias_rad_s().into()], true)
    }

    /// Turns on by a rate that holds for some time.
    fn predict(&self, rate_rad_s: &Bound<'_, PyAny>, duration_s: f64) -> PyResult<()> {
        let rate = convert::vector3(rate_rad_s, "rate_rad_s")?;
        self.lock().predict(&rate, duration_s).map_err(|error| exception(&error))
    }

    /// Moves towards a reference; returns the difference found, (3,).
    fn correct<'py>(&self, reference_from_body: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let reference = convert::matrix3(reference_from_body, "reference_from_body")?;
        let found = self.lock().correct(&reference).map_err(|error| exception(&error))?;
        convert::to_rows(reference_from_body.py(), &[found.into()], true)
    }

    fn __repr__(&self) -> String {
        let options = *self.lock().options();
        format!(
            "ComplementaryFilter(time_constant_s={:?}, bias_time_constant_s={:?})",
            options.time_constant_s, options.bias_time_constant_s
        )
    }
}
