//! The types of single options: numbers, switches, arrays.

use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{Kind, Value};
use crate::error::{Error, Result};
use crate::geometry::RigidMotion;

/// A type that an option may have.
pub trait OptionValue: Sized {
    /// The kind of its values.
    const KIND: Kind;

    /// The value as plain data.
    fn to_value(&self) -> Value;

    /// The value from plain data, none if that is of another kind.
    fn from_value(value: &Value) -> Option<Self>;
}

/// The value of a field as plain data, by the type that writes it.
pub fn value_by<T: Clone, By: OptionValue + From<T>>(field: &T) -> Value {
    By::from(field.clone()).to_value()
}

/// Sets a field from plain data.
///
/// # Errors
/// [`Error::InvalidOption`] for data of another kind.
pub fn assign<T: OptionValue>(field: &mut T, name: &'static str, value: &Value) -> Result<()> {
    assign_by::<T, T>(field, name, value)
}

/// Sets a field from plain data, by the type that reads it.
///
/// # Errors
/// [`Error::InvalidOption`] for data of another kind.
pub fn assign_by<T: From<By>, By: OptionValue>(field: &mut T, name: &'static str, value: &Value) -> Result<()> {
    let read = By::from_value(value).ok_or_else(|| Error::option(name, value, By::KIND.to_string()))?;
    *field = read.into();
    Ok(())
}

impl OptionValue for f64 {
    const KIND: Kind = Kind::Float;

    fn to_value(&self) -> Value {
        Value::Float(*self)
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Float(value) => Some(*value),
            Value::Int(value) => Some(*value as f64),
            _ => None,
        }
    }
}

impl OptionValue for bool {
    const KIND: Kind = Kind::Bool;

    fn to_value(&self) -> Value {
        Value::Bool(*self)
    }

    fn from_value(value: &Value) -> Option<Self> {
        if let Value::Bool(value) = value { Some(*value) } else { None }
    }
}

impl OptionValue for String {
    const KIND: Kind = Kind::Text("a text");

    fn to_value(&self) -> Value {
        Value::Text(self.clone())
    }

    fn from_value(value: &Value) -> Option<Self> {
        if let Value::Text(value) = value { Some(value.clone()) } else { None }
    }
}

macro_rules! whole {
    ($($type:ty),*) => {$(
        impl OptionValue for $type {
            const KIND: Kind = Kind::Int(<$type>::MAX as u64);

            fn to_value(&self) -> Value {
                Value::Int((*self).try_into().unwrap_or(i128::MAX))
            }

            fn from_value(value: &Value) -> Option<Self> {
                if let Value::Int(value) = value { (*value).try_into().ok() } else { None }
            }
        }
    )*};
}

whole!(u8, u32, u64, usize);

impl<T: OptionValue> OptionValue for Option<T> {
    const KIND: Kind = Kind::Maybe(&T::KIND);

    fn to_value(&self) -> Value {
        self.as_ref().map_or(Value::None, T::to_value)
    }

    fn from_value(value: &Value) -> Option<Self> {
        if let Value::None = value { Some(None) } else { T::from_value(value).map(Some) }
    }
}

impl<const N: usize> OptionValue for [f64; N] {
    const KIND: Kind = Kind::Array(&[N]);

    fn to_value(&self) -> Value {
        Value::Array(vec![N], self.to_vec())
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Array(shape, values) if shape.len() == 1 => values.as_slice().try_into().ok(),
            _ => None,
        }
    }
}

impl OptionValue for Vector3<f64> {
    const KIND: Kind = Kind::Array(&[3]);

    fn to_value(&self) -> Value {
        Value::Array(vec![3], self.as_slice().to_vec())
    }

    fn from_value(value: &Value) -> Option<Self> {
        <[f64; 3]>::from_value(value).map(Self::from)
    }
}

impl OptionValue for Matrix3<f64> {
    const KIND: Kind = Kind::Array(&[3, 3]);

    fn to_value(&self) -> Value {
        Value::Array(vec![3, 3], self.transpose().as_slice().to_vec())
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Array(shape, values) if *shape == [3, 3] => Some(Self::from_row_slice(values)),
            _ => None,
        }
    }
}

/// A rigid motion as a matrix.
impl OptionValue for Isometry3<f64> {
    const KIND: Kind = Kind::Array(&[4, 4]);

    fn to_value(&self) -> Value {
        Value::Array(vec![4, 4], self.to_homogeneous().transpose().as_slice().to_vec())
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Array(shape, values) if *shape == [4, 4] => {
                let motion = RigidMotion::from_matrix("motion", &Matrix4::from_row_slice(values)).ok()?;
                let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(motion.rotation));
                Some(Self::from_parts(Translation3::from(motion.translation_m), turn))
            }
            _ => None,
        }
    }
}
