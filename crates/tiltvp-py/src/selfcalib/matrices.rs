//! Matrices and vectors of answers, as arrays and in dicts.

use nalgebra::{Matrix3, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert::item;

/// Fresh `(3, 3)` array.
pub(super) fn matrix3<'py>(py: Python<'py>, m: &Matrix3<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, m.transpose().as_slice()).reshape([3, 3])
}

/// A matrix of a dict.
pub(super) fn matrix_item(values: &Bound<'_, PyDict>, key: &str) -> PyResult<Matrix3<f64>> {
    let rows: [[f64; 3]; 3] = item(values, key, "three rows of three numbers")?;
    Ok(Matrix3::from_fn(|r, c| rows[r][c]))
}

/// A vector of a dict.
pub(super) fn vector_item(values: &Bound<'_, PyDict>, key: &str) -> PyResult<Vector3<f64>> {
    let numbers: [f64; 3] = item(values, key, "three numbers")?;
    Ok(Vector3::from(numbers))
}

/// The rows as lists.
pub(super) fn nested(m: &Matrix3<f64>) -> Vec<Vec<f64>> {
    m.row_iter().map(|row| row.iter().copied().collect()).collect()
}
