//! `Array`: a fresh numpy array whose type hint names its elements.

use std::convert::Infallible;
use std::marker::PhantomData;

use pyo3::prelude::*;
#[cfg(feature = "stub")]
use pyo3::{inspect::PyStaticExpr, type_hint_identifier, type_hint_subscript};

/// What numpy calls the elements of an array.
pub(crate) trait Dtype {
    /// The name in the module `numpy`.
    #[cfg_attr(not(feature = "stub"), expect(dead_code, reason = "read for the stub alone"))]
    const NAME: &'static str;
}

macro_rules! dtypes {
    ($($type:ty => $name:literal,)*) => {$(
        impl Dtype for $type {
            const NAME: &'static str = $name;
        }
    )*};
}

dtypes! {
    bool => "bool_",
    u8 => "uint8",
    u16 => "uint16",
    u32 => "uint32",
    i64 => "int64",
    f32 => "float32",
    f64 => "float64",
}

/// An array of `T` on its way out.
pub(crate) struct Array<'py, T>(Bound<'py, PyAny>, PhantomData<T>);

impl<'py, T> Array<'py, T> {
    /// Names the elements of an array.
    pub(crate) fn new<D>(array: Bound<'py, D>) -> Self {
        Self(array.into_any(), PhantomData)
    }
}

impl<'py, T: Dtype> IntoPyObject<'py> for Array<'py, T> {
    type Target = PyAny;
    type Output = Bound<'py, PyAny>;
    type Error = Infallible;

    #[cfg(feature = "stub")]
    const OUTPUT_TYPE: PyStaticExpr =
        type_hint_subscript!(type_hint_identifier!("numpy.typing", "NDArray"), type_hint_identifier!("numpy", T::NAME));

    fn into_pyobject(self, _py: Python<'py>) -> Result<Self::Output, Infallible> {
        Ok(self.0)
    }
}
