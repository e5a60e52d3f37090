//! `ComplementaryFilter`: rates of turn and a reference attitude, fused.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::filter::{ComplementaryFilter as Filter, ComplementaryOptions, ComplementaryState};

use crate::array::Array;
use crate::call::exception;
use crate::convert::{self, Number};
use crate::options;
use crate::shared::Shared;
use crate::value::changing;

/// Rates of turn in the short run, a reference attitude in the long run: `ComplementaryFilter(reference_from_body)`.
///
/// The explicit complementary filter on rotations with corrections that arrive now and then: an attitude seen in an
/// image, say, among the readings of a gyroscope. It starts at an attitude (3, 3), with no bias. Raises
/// `tiltvp.errors.InvalidInputError`.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct ComplementaryFilter {
    inner: Shared<Filter>,
}

changing!(ComplementaryFilter(Filter), |own| own, {
    /// Time after which a difference from the reference has shrunk to 1/e, seconds.
    time_constant_s: f64 = own.options().time_constant_s,
    /// Time over which a lasting difference becomes a bias of the rates, seconds.
    bias_time_constant_s: f64 = own.options().bias_time_constant_s,
});

#[pymethods]
impl ComplementaryFilter {
    #[new]
    #[pyo3(signature = (reference_from_body: "ArrayLike", **options: "Option | None"))]
    fn new(reference_from_body: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let parsed = options::given(ComplementaryOptions::default(), options)?;
        let start = convert::matrix3(reference_from_body, "reference_from_body")?;
        let inner = Filter::new(parsed, &start).map_err(|error| exception(&error))?;
        Ok(inner.into())
    }

    /// (3, 3): the attitude now, which takes vectors of the body to the frame of the reference.
    #[getter]
    fn reference_from_body<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, &self.inner.look(py, Filter::attitude))
    }

    /// (3,): the bias of the rates, in the body's axes.
    #[getter]
    fn bias_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_rows(py, &[self.inner.look(py, |filter| filter.bias_rad_s().into())], true)
    }

    /// Turns on by a rate (3,), in the body's axes, that holds for so long.
    #[pyo3(signature = (rate_rad_s: "ArrayLike", duration_s))]
    fn predict(&self, rate_rad_s: &Bound<'_, PyAny>, duration_s: Number) -> PyResult<()> {
        let duration_s = duration_s.of("duration_s")?;
        let rate = convert::vector3(rate_rad_s, "rate_rad_s")?;
        self.inner.change(rate_rad_s.py(), |filter| filter.predict(&rate, duration_s))
    }

    /// Moves towards a reference (3, 3) by the share 1 - exp(-t / time_constant_s), t the time since the last one.
    ///
    /// Returns (3,): the difference that it found, as a rotation vector in the body's axes.
    #[pyo3(signature = (reference_from_body: "ArrayLike"))]
    fn correct<'py>(&self, reference_from_body: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let reference = convert::matrix3(reference_from_body, "reference_from_body")?;
        let py = reference_from_body.py();
        let found = self.inner.change(py, |filter| filter.correct(&reference))?;
        convert::to_rows(py, &[found.into()], true)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("ComplementaryFilter({})", options::shown(py, &self.inner.look(py, |filter| *filter.options()))?))
    }

    /// Sets what pickle has kept.
    fn __setstate__(&self, py: Python<'_>, state: ([f64; 4], [f64; 3], f64)) -> PyResult<()> {
        let (attitude, bias_rad_s, unseen_s) = state;
        let state = ComplementaryState { attitude, bias_rad_s, unseen_s };
        self.inner.change(py, |filter| {
            *filter = Filter::with_state(*filter.options(), &state)?;
            Ok(())
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let make = py.import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&this.options(py)?))?;
        let state = this.inner.look(py, Filter::state);
        (make, (this.reference_from_body(py)?,), (state.attitude, state.bias_rad_s, state.unseen_s)).into_pyobject(py)
    }
}
