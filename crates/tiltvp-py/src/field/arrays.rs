//! Fields that are numpy arrays as attributes and lists in dicts: vectors, matrices and columns.

use nalgebra::SMatrix;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

use super::Field;
use super::plain::{in_brackets, number, number_bits};
use crate::array::Array;
use crate::convert;

/// Vectors are arrays `(R,)`, matrices `(R, C)`; lists in dicts.
impl<const R: usize, const C: usize> Field for SMatrix<f64, R, C> {
    type Attribute<'py> = Array<'py, f64>;

    fn attribute<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, self)
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        if C == 1 {
            return self.as_slice().to_vec().into_bound_py_any(py);
        }
        let rows: Vec<Vec<f64>> = self.row_iter().map(|row| row.iter().copied().collect()).collect();
        rows.into_bound_py_any(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        convert::nullable(value, |value| convert::matrix(value, name))
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        bits.extend(self.iter().map(|x| number_bits(*x)));
    }

    fn show(&self) -> Option<String> {
        (C == 1).then(|| in_brackets(self.iter().map(|x| number(*x))))
    }
}

/// Any number of these are one array with another axis in front.
impl<const R: usize, const C: usize> Field for Vec<SMatrix<f64, R, C>> {
    type Attribute<'py> = Array<'py, f64>;

    fn attribute<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let n = self.len();
        let flat = PyArray1::from_vec(py, self.iter().flat_map(convert::row_major).collect());
        Ok(if C == 1 { Array::new(flat.reshape([n, R])?) } else { Array::new(flat.reshape([n, R, C])?) })
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.iter().map(|own| own.plain(py)).collect::<PyResult<Vec<_>>>()?.into_bound_py_any(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        let parts: Vec<Bound<'_, PyAny>> = convert::taken(value, name, "lists of numbers")?;
        parts.iter().map(|part| Field::read(part, name)).collect()
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        bits.push(self.len() as u64);
        for own in self {
            own.bits(bits);
        }
    }

    fn show(&self) -> Option<String> {
        None
    }
}

/// Several of these are one array with another axis in front.
impl<const N: usize, const R: usize, const C: usize> Field for [SMatrix<f64, R, C>; N] {
    type Attribute<'py> = Array<'py, f64>;

    fn attribute<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let flat: Vec<f64> = self.iter().flat_map(convert::row_major).collect();
        let flat = PyArray1::from_vec(py, flat);
        Ok(if C == 1 { Array::new(flat.reshape([N, R])?) } else { Array::new(flat.reshape([N, R, C])?) })
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.iter().map(|own| own.plain(py)).collect::<PyResult<Vec<_>>>()?.into_bound_py_any(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        let parts: [Bound<'_, PyAny>; N] = convert::taken(value, name, &format!("{N} lists of numbers"))?;
        let mut read = [SMatrix::zeros(); N];
        for (own, part) in read.iter_mut().zip(&parts) {
            *own = Field::read(part, name)?;
        }
        Ok(read)
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        for own in self {
            own.bits(bits);
        }
    }

    fn show(&self) -> Option<String> {
        None
    }
}

/// Columns are arrays `(N,)` as attributes and lists in dicts.
macro_rules! columns {
    ($($type:ty => |$value:ident, $name:ident| $read:expr, |$x:ident| $bits:expr;)*) => {$(
        impl Field for Vec<$type> {
            type Attribute<'py> = Array<'py, $type>;

            fn attribute<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, $type>> {
                Ok(Array::new(PyArray1::from_slice(py, self)))
            }

            fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                self.into_bound_py_any(py)
            }

            fn read($value: &Bound<'_, PyAny>, $name: &str) -> PyResult<Self> {
                $read
            }

            fn bits(&self, bits: &mut Vec<u64>) {
                bits.push(self.len() as u64);
                bits.extend(self.iter().map(|$x| $bits));
            }

            fn show(&self) -> Option<String> {
                None
            }
        }
    )*};
}

columns! {
    f64 => |value, name| convert::nullable(value, |value| convert::vector(value, name)), |x| number_bits(*x);
    bool => |value, name| convert::taken(value, name, "a list of bool"), |x| u64::from(*x);
    i64 => |value, name| convert::taken(value, name, "a list of whole numbers"), |x| *x as u64;
    u16 => |value, name| convert::taken(value, name, "a list of whole numbers from 0"), |x| u64::from(*x);
    u32 => |value, name| convert::taken(value, name, "a list of whole numbers from 0"), |x| u64::from(*x);
}
