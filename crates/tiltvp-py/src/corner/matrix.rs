//! Matrices of fixed size to arrays, to nested lists, and back.

use nalgebra::SMatrix;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert;

/// Fresh `(R, C)` array.
pub(super) fn to_array<'py, const R: usize, const C: usize>(
    py: Python<'py>,
    m: &SMatrix<f64, R, C>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_vec(py, row_major(m).collect()).reshape([R, C])
}

/// The entries, row by row.
pub(super) fn row_major<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> impl Iterator<Item = f64> + '_ {
    (0..R * C).map(|i| m[(i / C, i % C)])
}

/// Rows as lists.
pub(super) fn nested<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> Vec<Vec<f64>> {
    m.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// The matrix of such rows in a dict.
pub(super) fn item<const R: usize, const C: usize>(
    values: &Bound<'_, PyDict>,
    key: &str,
) -> PyResult<SMatrix<f64, R, C>> {
    let rows: [[f64; C]; R] = convert::item(values, key, &format!("{R} rows of {C} numbers"))?;
    Ok(SMatrix::from_fn(|i, j| rows[i][j]))
}
