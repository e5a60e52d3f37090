//! The macro that makes a frozen class of its fields, and the one for classes that are made again from their arguments.

use std::hash::{DefaultHasher, Hash, Hasher};

use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::True;
use pyo3::types::PyDict;

use crate::field::Value;

/// A frozen value class from one declaration: getters, `to_dict`, `from_dict`, equality to the bit, hash, repr, copies, and
/// pickle. More getters and methods may stand in a second `#[pymethods]` block.
///
/// `Class(core::Struct as own) { field: Type, other: Type = own.part.other, }` holds what the core returns. A field is that
/// of the same name, or the expression after `=`. `make` says what `from_dict` makes of the fields, whose names it may use;
/// without it they are those of the core's struct.
///
/// `Class as own { field: Type, }` holds the fields themselves; `check` is run by `from_dict` before they are taken.
///
/// `repr` replaces `Class(field=value, ...)`.
macro_rules! value {
    (
        $(#[$meta:meta])*
        $class:ident($($inner:ident)::+ as $own:ident) {
            $($(#[$doc:meta])* $field:ident: $type:ty $(= $get:expr)?,)*
        }
        $(make $make:expr;)?
        $(repr $repr:expr;)?
    ) => {
        $(#[$meta])*
        #[pyo3::pyclass(frozen, module = "tiltvp._core")]
        #[derive(Clone)]
        pub(crate) struct $class {
            pub(crate) inner: $($inner)::+,
        }

        impl From<$($inner)::+> for $class {
            fn from(inner: $($inner)::+) -> Self {
                Self { inner }
            }
        }

        impl $class {
            fn own(&self) -> &$($inner)::+ {
                &self.inner
            }
        }

        $crate::value::value!(@class $class $own {
            $($(#[$doc])* $field: $type = ($crate::value::value!(@get ($own.$field) $($get)?));)*
        } {
            Self { inner: $crate::value::value!(@make ($($inner)::+ { $($field),* }) $($make)?) }
        } $($repr)?);
    };
    (
        $(#[$meta:meta])*
        $class:ident as $own:ident {
            $($(#[$doc:meta])* $field:ident: $type:ty,)*
        }
        $(check $check:expr;)?
        $(repr $repr:expr;)?
    ) => {
        $(#[$meta])*
        #[pyo3::pyclass(frozen, module = "tiltvp._core")]
        #[derive(Clone)]
        pub(crate) struct $class {
            $(pub(crate) $field: $type,)*
        }

        impl $class {
            fn own(&self) -> &Self {
                self
            }
        }

        $crate::value::value!(@class $class $own { $($(#[$doc])* $field: $type = ($own.$field);)* } {
            $($check;)?
            Self { $($field),* }
        } $($repr)?);
    };
    (@class $class:ident $own:ident {
        $($(#[$doc:meta])* $field:ident: $type:ty = ($get:expr);)*
    } $made:block $($repr:expr)?) => {
        impl $crate::field::Value for $class {
            fn all_keys() -> Vec<&'static str> {
                let mut keys = Vec::new();
                $(<$type as $crate::field::Field>::keys(stringify!($field), &mut keys);)*
                keys
            }

            fn write_all(&self, values: &pyo3::Bound<'_, pyo3::types::PyDict>) -> pyo3::PyResult<()> {
                let $own = self.own();
                $(<$type as $crate::field::Field>::write(&$get, values, stringify!($field))?;)*
                Ok(())
            }

            #[allow(unused_variables, reason = "some fields follow from the others")]
            fn read_all(values: &pyo3::Bound<'_, pyo3::types::PyDict>) -> pyo3::PyResult<Self> {
                $(let $field = <$type as $crate::field::Field>::take(values, stringify!($field))?;)*
                Ok($made)
            }

            fn all_bits(&self) -> Vec<u64> {
                let $own = self.own();
                let mut bits = Vec::new();
                $(<$type as $crate::field::Field>::bits(&$get, &mut bits);)*
                bits
            }

            fn text(&self) -> String {
                let $own = self.own();
                $crate::value::value!(@text ($crate::value::text(stringify!($class), &[
                    $((stringify!($field), <$type as $crate::field::Field>::show(&$get))),*
                ])) $($repr)?)
            }
        }

        #[pyo3::pymethods]
        impl $class {
            $(
                $(#[$doc])*
                #[getter]
                fn $field<'py>(
                    &self,
                    py: pyo3::Python<'py>,
                ) -> pyo3::PyResult<<$type as $crate::field::Field>::Attribute<'py>> {
                    let $own = self.own();
                    <$type as $crate::field::Field>::attribute(&$get, py)
                }
            )*

            /// The attributes by name, arrays as nested lists: plain, good for JSON.
            fn to_dict<'py>(&self, py: pyo3::Python<'py>) -> pyo3::PyResult<pyo3::Bound<'py, pyo3::types::PyDict>> {
                $crate::field::Value::dict(self, py)
            }

            /// The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN.
            #[classmethod]
            #[pyo3(signature = (values: "dict[str, Any]"))]
            fn from_dict(
                _cls: &pyo3::Bound<'_, pyo3::types::PyType>,
                values: &pyo3::Bound<'_, pyo3::PyAny>,
            ) -> pyo3::PyResult<Self> {
                $crate::field::Value::from_values(values, "values")
            }

            fn __repr__(&self) -> String {
                $crate::field::Value::text(self)
            }

            fn __reduce__<'py>(
                slf: &pyo3::Bound<'py, Self>,
            ) -> pyo3::PyResult<(pyo3::Bound<'py, pyo3::PyAny>, (pyo3::Bound<'py, pyo3::types::PyDict>,))> {
                $crate::value::reduce(slf)
            }
        }

        $crate::value::frozen!($class, |own| $crate::field::Value::all_bits(own));
    };
    (@get ($field:expr)) => { $field };
    (@get ($field:expr) $get:expr) => { $get };
    (@make ($made:expr)) => { $made };
    (@make ($made:expr) $make:expr) => { $make };
    (@text ($text:expr)) => { $text };
    (@text ($text:expr) $repr:expr) => { $repr };
}
pub(crate) use value;

/// Equality, hash and copies of a frozen class, by what tells two of them apart.
macro_rules! frozen {
    ($class:ident, |$own:ident| $same:expr) => {
        $crate::value::frozen!($class, |$own| $same, |$own| $same);
    };
    ($class:ident, |$own:ident| $same:expr, |$hashed:ident| $hash:expr) => {
        #[pyo3::pymethods]
        impl $class {
            fn __eq__(&self, other: &pyo3::Bound<'_, Self>) -> bool {
                fn same($own: &$class) -> impl PartialEq + use<'_> {
                    $same
                }
                same(self) == same(other.get())
            }

            fn __hash__(&self) -> u64 {
                let $hashed = self;
                $crate::value::hash(&$hash)
            }

            fn __copy__<'py>(slf: &pyo3::Bound<'py, Self>) -> pyo3::Bound<'py, Self> {
                slf.clone()
            }

            fn __deepcopy__<'py>(
                slf: &pyo3::Bound<'py, Self>,
                _memo: &pyo3::Bound<'py, pyo3::PyAny>,
            ) -> pyo3::Bound<'py, Self> {
                slf.clone()
            }
        }
    };
}
pub(crate) use frozen;

/// Attributes of plain numbers, words and tuples, `name: type = expression,` each.
macro_rules! getters {
    ($class:ident as $own:ident { $($(#[$doc:meta])* $name:ident: $type:ty = $get:expr,)* }) => {
        #[pyo3::pymethods]
        impl $class {
            $(
                $(#[$doc])*
                #[getter]
                fn $name(&self) -> $type {
                    let $own = self;
                    $get
                }
            )*
        }
    };
}
pub(crate) use getters;

/// What classes that change as they go have: one core object, which threads share, its options, copies, equality by what tells two
/// of them apart, and attributes `name: type = expression,` of it.
macro_rules! changing {
    (
        $class:ident($($inner:ident)::+), |$own:ident| $same:expr
        $(, { $($(#[$doc:meta])* $name:ident: $type:ty = $get:expr,)* })?
    ) => {
        impl From<$($inner)::+> for $class {
            fn from(inner: $($inner)::+) -> Self {
                Self { inner: $crate::shared::Shared::new(inner) }
            }
        }

        #[pyo3::pymethods]
        impl $class {
            /// The options in force, by name, defaults included; a fresh dict, good as keywords.
            #[getter]
            fn options<'py>(&self, py: pyo3::Python<'py>) -> pyo3::PyResult<pyo3::Bound<'py, pyo3::types::PyDict>> {
                $crate::options::in_force(py, &self.inner.look(py, |own| *own.options()))
            }

            $($(
                $(#[$doc])*
                #[getter]
                fn $name(&self, py: pyo3::Python<'_>) -> $type {
                    self.inner.look(py, |$own| $get)
                }
            )*)?

            fn __eq__(&self, py: pyo3::Python<'_>, other: &pyo3::Bound<'_, Self>) -> bool {
                fn same($own: &$($inner)::+) -> impl PartialEq + use<'_> {
                    $same
                }
                // One at a time: it may be compared with itself.
                let own = self.inner.copied(py);
                other.get().inner.look(py, |other| same(&own) == same(other))
            }

            fn __copy__(&self, py: pyo3::Python<'_>) -> Self {
                Self::from(self.inner.copied(py))
            }

            fn __deepcopy__(&self, py: pyo3::Python<'_>, _memo: &pyo3::Bound<'_, pyo3::PyAny>) -> Self {
                self.__copy__(py)
            }
        }
    };
}
pub(crate) use changing;

/// `Class(field=value, ...)` of the fields that can be read.
pub(crate) fn text(class: &str, fields: &[(&str, Option<String>)]) -> String {
    let shown = fields.iter().filter_map(|(name, value)| Some(format!("{name}={}", value.as_ref()?)));
    format!("{class}({})", shown.collect::<Vec<_>>().join(", "))
}

/// The same number for the same content, in every process.
pub(crate) fn hash(content: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    content.hash(&mut hasher);
    hasher.finish()
}

/// The value behind an object, if it is of that class.
pub(crate) fn of_class<'a, T: PyClass<Frozen = True> + Sync>(object: &'a Bound<'_, PyAny>) -> Option<&'a T> {
    object.cast::<T>().ok().map(Bound::get)
}

/// `from_dict` of the class and the dict of the value, for pickle.
pub(crate) fn reduce<'py, T: Value + PyClass<Frozen = True> + Sync>(
    slf: &Bound<'py, T>,
) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyDict>,))> {
    Ok((slf.as_any().get_type().getattr("from_dict")?, (slf.get().dict(slf.py())?,)))
}
