//! The types that fields of frozen values have: each as an attribute, in a dict, in a repr, and as bits.

mod arrays;
mod plain;
mod words;

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyDict;

pub(crate) use self::words::{StopWord, VerdictWord};
use crate::convert;

/// How one field of a value crosses to Python and back.
pub(crate) trait Field: Sized {
    /// What the attribute returns; arrays are fresh.
    type Attribute<'py>: IntoPyObject<'py>;

    /// The attribute.
    fn attribute<'py>(&self, py: Python<'py>) -> PyResult<Self::Attribute<'py>>;

    /// Plain numbers, text and lists, good for JSON.
    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;

    /// Reads what [`plain`](Self::plain) wrote; `name` is for messages.
    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self>;

    /// Appends the content as bits: equal values have equal bits, and NaN equals itself.
    fn bits(&self, bits: &mut Vec<u64>);

    /// The content in a repr; None where it would be too long to read.
    fn show(&self) -> Option<String>;

    /// Appends the keys of the dict that the field makes.
    fn keys(key: &'static str, keys: &mut Vec<&'static str>) {
        keys.push(key);
    }

    /// Sets the field's items of a dict.
    fn write(&self, values: &Bound<'_, PyDict>, key: &str) -> PyResult<()> {
        values.set_item(key, self.plain(values.py())?)
    }

    /// Reads what [`write`](Self::write) wrote.
    fn take(values: &Bound<'_, PyDict>, key: &str) -> PyResult<Self> {
        Self::read(&convert::raw_item(values, key)?, &format!("values[\"{key}\"]"))
    }
}

/// A frozen class whose fields are [`Field`]s. The macro [`value`](crate::value::value) implements it.
pub(crate) trait Value: Clone + for<'py> IntoPyObject<'py> {
    /// The keys of the dict.
    fn all_keys() -> Vec<&'static str>;

    /// Sets the items of every field.
    fn write_all(&self, values: &Bound<'_, PyDict>) -> PyResult<()>;

    /// Reads the items of every field; other keys are left alone.
    fn read_all(values: &Bound<'_, PyDict>) -> PyResult<Self>;

    /// Every field as bits.
    fn all_bits(&self) -> Vec<u64>;

    /// The repr.
    fn text(&self) -> String;

    /// The fields as a dict.
    fn dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.write_all(&dict)?;
        Ok(dict)
    }

    /// Reads what [`dict`](Self::dict) wrote; refuses anything else. `name` is for messages.
    fn from_values(values: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        let values = convert::dict(values, name)?;
        convert::known_keys(values, &Self::all_keys())?;
        Self::read_all(values)
    }
}

impl<T: Value> Field for T {
    type Attribute<'py> = T;

    fn attribute(&self, _py: Python<'_>) -> PyResult<T> {
        Ok(self.clone())
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.dict(py)?.into_any())
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        Self::from_values(value, name)
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        bits.extend(self.all_bits());
    }

    fn show(&self) -> Option<String> {
        Some(self.text())
    }
}

/// A value whose items stand among those of the value that it is a field of.
#[derive(Clone)]
pub(crate) struct Flat<T>(pub(crate) T);

impl<T: Value> Field for Flat<T> {
    type Attribute<'py> = T;

    fn attribute(&self, py: Python<'_>) -> PyResult<T> {
        self.0.attribute(py)
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.0.plain(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        T::read(value, name).map(Self)
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        self.0.bits(bits);
    }

    fn show(&self) -> Option<String> {
        self.0.show()
    }

    fn keys(_key: &'static str, keys: &mut Vec<&'static str>) {
        keys.extend(T::all_keys());
    }

    fn write(&self, values: &Bound<'_, PyDict>, _key: &str) -> PyResult<()> {
        self.0.write_all(values)
    }

    fn take(values: &Bound<'_, PyDict>, _key: &str) -> PyResult<Self> {
        T::read_all(values).map(Self)
    }
}

impl<T: Field> Field for Option<T> {
    type Attribute<'py> = Option<T::Attribute<'py>>;

    fn attribute<'py>(&self, py: Python<'py>) -> PyResult<Self::Attribute<'py>> {
        self.as_ref().map(|own| own.attribute(py)).transpose()
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.as_ref().map_or_else(|| Ok(py.None().into_bound(py)), |own| own.plain(py))
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        if value.is_none() { Ok(None) } else { T::read(value, name).map(Some) }
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        bits.push(u64::from(self.is_some()));
        if let Some(own) = self {
            own.bits(bits);
        }
    }

    fn show(&self) -> Option<String> {
        self.as_ref().map_or_else(|| Some("None".to_owned()), Field::show)
    }
}

/// Lists of values are lists as attributes, and lists of dicts in dicts.
impl<T: Value> Field for Vec<T> {
    type Attribute<'py> = Vec<T>;

    fn attribute(&self, _py: Python<'_>) -> PyResult<Vec<T>> {
        Ok(self.clone())
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.iter().map(|own| own.dict(py)).collect::<PyResult<Vec<_>>>()?.into_bound_py_any(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        let values: Vec<Bound<'_, PyAny>> = convert::taken(value, name, "a list of dicts")?;
        values.iter().map(|values| T::from_values(values, name)).collect()
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        bits.push(self.len() as u64);
        for own in self {
            own.bits(bits);
        }
    }

    fn show(&self) -> Option<String> {
        Some(plain::in_brackets(self.iter().map(T::text)))
    }
}
