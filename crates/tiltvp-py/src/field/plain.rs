//! Fields that look the same as attributes and in dicts: numbers, text, short lists and pairs.

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

use super::Field;
use crate::convert;

/// A number as bits, every NaN the same.
pub(super) fn number_bits(x: f64) -> u64 {
    if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }
}

/// A number with six significant digits, as Python writes it.
pub(super) fn number(x: f64) -> String {
    let rounded = format!("{x:.5e}").parse().unwrap_or(x);
    format!("{rounded:?}").to_lowercase()
}

/// Parts in brackets, as Python writes lists.
pub(super) fn in_brackets(parts: impl Iterator<Item = String>) -> String {
    format!("[{}]", parts.collect::<Vec<_>>().join(", "))
}

/// Fields that are the same object as attribute and in a dict: what pyo3 converts.
macro_rules! same_object {
    ($($type:ty, $expected:expr, |$x:ident, $bits:ident| $push:expr, $show:expr;)*) => {$(
        impl Field for $type {
            type Attribute<'py> = $type;

            fn attribute(&self, _py: Python<'_>) -> PyResult<$type> {
                Ok(self.clone())
            }

            fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                self.clone().into_bound_py_any(py)
            }

            fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
                convert::nullable(value, |value| convert::taken(value, name, $expected))
            }

            fn bits(&self, $bits: &mut Vec<u64>) {
                let $x = self;
                $push;
            }

            fn show(&self) -> Option<String> {
                let $x = self;
                $show
            }
        }
    )*};
}

same_object! {
    f64, "a number", |x, bits| bits.push(number_bits(*x)), Some(number(*x));
    u32, "a whole number from 0", |x, bits| bits.push(u64::from(*x)), Some(x.to_string());
    u64, "a whole number from 0", |x, bits| bits.push(*x), Some(x.to_string());
    usize, "a whole number from 0", |x, bits| bits.push(*x as u64), Some(x.to_string());
    bool, "True or False", |x, bits| bits.push(u64::from(*x)), Some(if *x { "True" } else { "False" }.to_owned());
    String, "text", |x, bits| {
        bits.push(x.len() as u64);
        bits.extend(x.bytes().map(u64::from));
    }, Some(format!("{x:?}"));
    Vec<String>, "a list of names", |x, bits| {
        bits.push(x.len() as u64);
        for name in x {
            name.bits(bits);
        }
    }, Some(format!("{x:?}"));
    Vec<usize>, "whole numbers", |x, bits| {
        bits.push(x.len() as u64);
        bits.extend(x.iter().map(|n| *n as u64));
    }, Some(format!("{x:?}"));
    Vec<u64>, "whole numbers", |x, bits| {
        bits.push(x.len() as u64);
        bits.extend(x);
    }, Some(format!("{x:?}"));
    [usize; 3], "three whole numbers", |x, bits| bits.extend(x.map(|n| n as u64)), Some(format!("{x:?}"));
    [f64; 3], "three numbers", |x, bits| bits.extend(x.map(number_bits)), Some(in_brackets(x.iter().map(|x| number(*x))));
}

/// Pairs are tuples.
macro_rules! pairs {
    ($($type:ty, $expected:expr;)*) => {$(
        impl Field for ($type, $type) {
            type Attribute<'py> = Self;

            fn attribute(&self, _py: Python<'_>) -> PyResult<Self> {
                Ok(*self)
            }

            fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                self.into_bound_py_any(py)
            }

            fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
                convert::nullable(value, |value| convert::taken::<[$type; 2]>(value, name, $expected)).map(Into::into)
            }

            fn bits(&self, bits: &mut Vec<u64>) {
                self.0.bits(bits);
                self.1.bits(bits);
            }

            fn show(&self) -> Option<String> {
                Some(format!("({}, {})", self.0.show()?, self.1.show()?))
            }
        }
    )*};
}

pairs! {
    f64, "two numbers";
    usize, "two whole numbers from 0";
}
