//! The values of options as plain data, and their kinds.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// A value of an option.
#[derive(Debug, Clone)]
pub enum Value {
    /// No value.
    None,
    /// True or false.
    Bool(bool),
    /// A whole number.
    Int(i128),
    /// A number.
    Float(f64),
    /// A word.
    Text(String),
    /// Numbers in row order, and their shape.
    Array(Vec<usize>, Vec<f64>),
    /// Truth values in row order, and their shape.
    Mask(Vec<usize>, Arc<[bool]>),
    /// A value that has no plain form; its owner knows its type.
    Object(Arc<dyn Any + Send + Sync>),
    /// What no option can be: how it looks.
    Other(String),
}

impl Value {
    /// The numbers that a domain looks at: none of a value without numbers.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Int(value) => vec![*value as f64],
            Self::Float(value) => vec![*value],
            Self::Array(_, values) => values.clone(),
            _ => Vec::new(),
        }
    }
}

/// Bits are compared, so that a value is equal to itself; objects are equal if they are the same.
impl PartialEq for Value {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::None, Self::None) => true,
            (Self::Bool(a), Self::Bool(b)) => a == b,
            (Self::Int(a), Self::Int(b)) => a == b,
            (Self::Float(a), Self::Float(b)) => a.to_bits() == b.to_bits(),
            (Self::Text(a), Self::Text(b)) | (Self::Other(a), Self::Other(b)) => a == b,
            (Self::Array(a, x), Self::Array(b, y)) => {
                a == b && x.iter().map(|x| x.to_bits()).eq(y.iter().map(|y| y.to_bits()))
            }
            (Self::Mask(a, x), Self::Mask(b, y)) => a == b && x == y,
            (Self::Object(a), Self::Object(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// As a refusal shows it.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => write!(f, "None"),
            Self::Bool(true) => write!(f, "True"),
            Self::Bool(false) => write!(f, "False"),
            Self::Int(value) => write!(f, "{value}"),
            Self::Float(value) => write!(f, "{value}"),
            Self::Text(value) => write!(f, "'{}'", value.escape_debug()),
            Self::Array(shape, values) if shape.len() == 1 => write!(f, "{values:?}"),
            Self::Array(shape, _) => write!(f, "numbers of shape {shape:?}"),
            Self::Mask(shape, _) => write!(f, "a mask of shape {shape:?}"),
            Self::Object(_) => write!(f, "an object"),
            Self::Other(look) => write!(f, "{look}"),
        }
    }
}

/// What kind of value an option has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// True or false.
    Bool,
    /// A whole number from 0 to the one here.
    Int(u64),
    /// A number.
    Float,
    /// A text: what is accepted, in words.
    Text(&'static str),
    /// One of some words.
    Word(&'static [&'static str]),
    /// An array of numbers of that shape, 0 for any length.
    Array(&'static [usize]),
    /// A mask of an image.
    Mask,
    /// A value that may have no plain form: what is accepted, in words.
    Object(&'static str),
    /// That, or none.
    Maybe(&'static Kind),
}

/// What is accepted, in words.
impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool => write!(f, "True or False"),
            Self::Int(u64::MAX) => write!(f, "a whole number from 0 to 2^64 - 1"),
            Self::Int(most) => write!(f, "a whole number from 0 to {most}"),
            Self::Float => write!(f, "a number"),
            Self::Text(words) => write!(f, "{words}"),
            Self::Word(words) => {
                for (i, word) in words.iter().enumerate() {
                    let before = if i == 0 {
                        ""
                    } else if i + 1 == words.len() {
                        " or "
                    } else {
                        ", "
                    };
                    write!(f, "{before}{word:?}")?;
                }
                Ok(())
            }
            Self::Array([n]) if *n > 0 => write!(f, "{n} numbers"),
            Self::Array(shape) => write!(f, "an array of numbers of shape {shape:?}"),
            Self::Mask => write!(f, "a (H, W) array of bool"),
            Self::Object(name) => write!(f, "{name}"),
            Self::Maybe(kind) => write!(f, "{kind}, or None"),
        }
    }
}
