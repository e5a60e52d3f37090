//! What the frozen values share: how numbers and matrices look in their dicts.

use nalgebra::Matrix2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::call::invalid;
use crate::convert;

/// A dict as `to_dict` makes it, with no other keys than these.
pub(super) fn dict<'a, 'py>(values: &'a Bound<'py, PyAny>, keys: &[&str]) -> PyResult<&'a Bound<'py, PyDict>> {
    let values = values.cast::<PyDict>().map_err(|_| invalid("values: expected a dict".to_owned()))?;
    convert::known_keys(values, keys)?;
    Ok(values)
}

/// Sets the item of a covariance as nested lists.
pub(super) fn set_covariance(dict: &Bound<'_, PyDict>, c: &Matrix2<f64>) -> PyResult<()> {
    dict.set_item("covariance_rad2", [[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]])
}

/// Reads what [`set_covariance`] wrote.
pub(super) fn covariance(values: &Bound<'_, PyDict>) -> PyResult<Matrix2<f64>> {
    let (rows, _) = convert::rows::<2>(&convert::raw_item(values, "covariance_rad2")?, "values[\"covariance_rad2\"]")?;
    let [[a, b], [c, d]] = rows[..] else {
        return Err(invalid("values[\"covariance_rad2\"]: expected shape (2, 2)".to_owned()));
    };
    Ok(Matrix2::new(a, b, c, d))
}

/// The entries of a covariance as bits, so that equal means the same bytes and infinity is nothing special.
pub(super) fn covariance_bits(c: &Matrix2<f64>) -> [u64; 4] {
    [c[(0, 0)], c[(0, 1)], c[(1, 0)], c[(1, 1)]].map(f64::to_bits)
}
