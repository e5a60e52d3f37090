//! Fields whose type hints say more than those of pyo3: text that is one of some words, and tuples of any length.

use std::convert::Infallible;

use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};
#[cfg(feature = "stub")]
use pyo3::{
    inspect::{PyStaticConstant, PyStaticExpr},
    type_hint_identifier, type_hint_subscript,
};

use super::Field;
use crate::convert;

macro_rules! words {
    ($($(#[$doc:meta])* $class:ident: $($word:literal),+;)*) => {$(
        $(#[$doc])*
        #[derive(Clone)]
        pub(crate) struct $class(pub(crate) String);

        impl<'py> IntoPyObject<'py> for $class {
            type Target = PyString;
            type Output = Bound<'py, PyString>;
            type Error = Infallible;

            #[cfg(feature = "stub")]
            const OUTPUT_TYPE: PyStaticExpr = type_hint_subscript!(
                type_hint_identifier!("typing", "Literal"),
                $(PyStaticExpr::Constant { value: PyStaticConstant::Str($word) }),+
            );

            fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Infallible> {
                self.0.into_pyobject(py)
            }
        }

        impl Field for $class {
            type Attribute<'py> = $class;

            fn attribute(&self, _py: Python<'_>) -> PyResult<$class> {
                Ok(self.clone())
            }

            fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                self.0.plain(py)
            }

            fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
                String::read(value, name).map(Self)
            }

            fn bits(&self, bits: &mut Vec<u64>) {
                self.0.bits(bits);
            }

            fn show(&self) -> Option<String> {
                self.0.show()
            }
        }
    )*};
}

words! {
    /// Why a robust fit stopped.
    StopWord: "confident", "trial-limit", "converged", "settled", "iteration-limit", "too-few", "no-model", "out-of-reach", "chosen",
        "ambiguous", "undetermined";
    /// What a filter did with an estimate.
    VerdictWord: "accepted", "jumped", "no-tilt", "repeated", "low-confidence", "outside-gate", "lost";
}

/// Whole numbers on their way out, as a tuple.
pub(crate) struct WholeNumbers(Box<[usize]>);

impl<'py> IntoPyObject<'py> for WholeNumbers {
    type Target = PyTuple;
    type Output = Bound<'py, PyTuple>;
    type Error = PyErr;

    #[cfg(feature = "stub")]
    const OUTPUT_TYPE: PyStaticExpr = type_hint_subscript!(
        type_hint_identifier!("builtins", "tuple"),
        type_hint_identifier!("builtins", "int"),
        PyStaticExpr::Constant { value: PyStaticConstant::Ellipsis }
    );

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        PyTuple::new(py, self.0)
    }
}

impl Field for Box<[usize]> {
    type Attribute<'py> = WholeNumbers;

    fn attribute(&self, _py: Python<'_>) -> PyResult<WholeNumbers> {
        Ok(WholeNumbers(self.clone()))
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.to_vec().plain(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        convert::taken::<Vec<usize>>(value, name, "whole numbers").map(Into::into)
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        self.to_vec().bits(bits);
    }

    fn show(&self) -> Option<String> {
        Some(format!("{self:?}"))
    }
}
