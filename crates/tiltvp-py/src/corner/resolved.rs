//! What several features agree on, as a frozen Python value: `ResolvedAttitude`.

use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::corner as core;

use super::matrix;
use crate::call::invalid;
use crate::convert;

/// Keys of the dict of a `ResolvedAttitude`.
const KEYS: [&str; 5] = ["common_from_object", "covariance_rad2", "probability", "choice", "chi_square"];

/// One attitude that all features agree on, with how likely it is among all such.
#[pyclass(frozen, module = "tiltvp._core", eq)]
#[derive(Clone, PartialEq)]
pub(crate) struct ResolvedAttitude {
    inner: core::ResolvedAttitude,
}

impl From<core::ResolvedAttitude> for ResolvedAttitude {
    fn from(inner: core::ResolvedAttitude) -> Self {
        Self { inner }
    }
}

#[pymethods]
impl ResolvedAttitude {
    /// Fresh (3, 3) float64: the rotation from the first feature's object to the frame that all features share.
    #[getter]
    fn common_from_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.common_from_object)
    }

    /// Fresh (3, 3) float64 in squared radians: covariance of the rotation vector, common frame, of the error.
    #[getter]
    fn covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.covariance)
    }

    /// The probability that it is this one and none of the others, in [0, 1].
    #[getter]
    fn probability(&self) -> f64 {
        self.inner.probability
    }

    /// Which attitude of each feature it is, in the order of `corner.attitudes`.
    #[getter]
    fn choice<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.inner.choice)
    }

    /// How far the features are apart: chi-square of three degrees of freedom per feature after the first.
    #[getter]
    fn chi_square(&self) -> f64 {
        self.inner.chi_square
    }

    /// The attributes by name; arrays as nested lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("common_from_object", matrix::nested(&self.inner.common_from_object))?;
        dict.set_item("covariance_rad2", matrix::nested(&self.inner.covariance))?;
        dict.set_item("probability", self.inner.probability)?;
        dict.set_item("choice", &self.inner.choice)?;
        dict.set_item("chi_square", self.inner.chi_square)?;
        Ok(dict)
    }

    /// The value of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values.cast::<PyDict>().map_err(|_| invalid("values: expected a dict".to_owned()))?;
        convert::known_keys(values, &KEYS)?;
        Ok(Self {
            inner: core::ResolvedAttitude {
                common_from_object: matrix::item(values, "common_from_object")?,
                covariance: matrix::item(values, "covariance_rad2")?,
                probability: convert::item(values, "probability", "a number")?,
                choice: convert::item(values, "choice", "whole numbers")?,
                chi_square: convert::item(values, "chi_square", "a number")?,
            },
        })
    }

    fn __repr__(&self) -> String {
        let core::ResolvedAttitude { probability, choice, chi_square, .. } = &self.inner;
        format!("ResolvedAttitude(probability={probability:.6}, choice={choice:?}, chi_square={chi_square:.3})")
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        PyTuple::new(py, [self.inner.probability.to_bits(), self.inner.chi_square.to_bits()])?.hash()
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
