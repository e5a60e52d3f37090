//! The one error type of the crate: what was wrong, what was expected, and where.

use std::borrow::Cow;

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A question that was asked wrongly. Answers that do not exist are `Option`s, not errors.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A camera parameter that no such lens can have.
    #[error("camera model {model}: {parameter} = {value}, expected {expected}")]
    InvalidCamera {
        /// Name of the camera model.
        model: &'static str,
        /// Name of the offending parameter.
        parameter: String,
        /// The value that was given, as text.
        value: String,
        /// What would have been accepted.
        expected: Cow<'static, str>,
    },
    /// An option outside its domain.
    #[error("option {name} = {value}, expected {expected}")]
    InvalidOption {
        /// Name of the option as the user writes it.
        name: Cow<'static, str>,
        /// The value that was given, as text.
        value: String,
        /// What would have been accepted.
        expected: Cow<'static, str>,
    },
    /// A name that no option has.
    #[error("option {name}: {why}, expected one of {}", known.join(", "))]
    UnknownOption {
        /// The name that was given.
        name: String,
        /// That it is unknown, to what, and what was meant perhaps.
        why: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// An argument (array, image, rotation) of the wrong shape or content.
    #[error("{name}: got {got}, expected {expected}")]
    InvalidArgument {
        /// Name of the argument.
        name: &'static str,
        /// What was given.
        got: String,
        /// What would have been accepted.
        expected: String,
    },
}

impl Error {
    /// An [`Error::InvalidOption`] from any printable value.
    pub fn option(
        name: impl Into<Cow<'static, str>>,
        value: impl std::fmt::Display,
        expected: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self::InvalidOption { name: name.into(), value: shown(value), expected: expected.into() }
    }

    /// The same error where the option is part of others and its name begins with a prefix there.
    #[must_use]
    pub fn of_option(self, prefix: &str) -> Self {
        match self {
            Self::InvalidOption { name, value, expected } if !prefix.is_empty() => {
                Self::InvalidOption { name: format!("{prefix}{name}").into(), value, expected }
            }
            other => other,
        }
    }

    /// An [`Error::InvalidArgument`] from any printable values.
    pub fn argument(name: &'static str, got: impl std::fmt::Display, expected: impl std::fmt::Display) -> Self {
        Self::InvalidArgument { name, got: shown(got), expected: expected.to_string() }
    }

    /// An [`Error::InvalidCamera`] from any printable value.
    pub fn camera(
        model: &'static str,
        parameter: impl Into<String>,
        value: impl std::fmt::Display,
        expected: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self::InvalidCamera { model, parameter: parameter.into(), value: shown(value), expected: expected.into() }
    }
}

/// What was given as text: a number of more digits than a 64-bit one has, such as 1e300, with its exponent.
fn shown(given: impl std::fmt::Display) -> String {
    const MOST: usize = 24;
    let text = given.to_string();
    match text.parse::<f64>() {
        Ok(number) if text.len() > MOST => format!("{number:e}"),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_many_digits_are_shown_with_their_exponent() {
        for (given, text) in [(1e300, "1e300"), (-1e-300, "-1e-300"), (0.1, "0.1"), (f64::NAN, "NaN")] {
            let said = Error::option("margin_px", given, "a width").to_string();
            assert_eq!(said, format!("option margin_px = {text}, expected a width"));
            assert_eq!(Error::argument("a", given, "b").to_string(), format!("a: got {text}, expected b"));
        }
        assert_eq!(shown(u64::MAX), "18446744073709551615");
    }
}
