//! Which numbers an option may have.

use std::ops::{Range, RangeInclusive};

use super::Value;
use crate::error::{Error, Result};

/// A set of numbers, which may depend on the options `S` that the number is one of.
pub trait Domain<S> {
    /// Whether a number is in it. NaN never is.
    fn has(&self, options: &S, number: f64) -> bool;
}

impl<S> Domain<S> for RangeInclusive<f64> {
    fn has(&self, _: &S, number: f64) -> bool {
        self.contains(&number)
    }
}

impl<S> Domain<S> for Range<f64> {
    fn has(&self, _: &S, number: f64) -> bool {
        self.contains(&number)
    }
}

/// The numbers strictly between two.
#[derive(Debug, Clone, Copy)]
pub struct Between(pub f64, pub f64);

impl<S> Domain<S> for Between {
    fn has(&self, _: &S, number: f64) -> bool {
        number > self.0 && number < self.1
    }
}

/// The numbers above one and at most another.
#[derive(Debug, Clone, Copy)]
pub struct Above(pub f64, pub f64);

impl<S> Domain<S> for Above {
    fn has(&self, _: &S, number: f64) -> bool {
        number > self.0 && number <= self.1
    }
}

impl<S, F: Fn(&S, f64) -> bool> Domain<S> for F {
    fn has(&self, options: &S, number: f64) -> bool {
        self(options, number)
    }
}

/// The finite positive numbers.
pub const POSITIVE: Between = Between(0.0, f64::INFINITY);

/// The finite numbers from zero.
pub const NOT_NEGATIVE: Range<f64> = 0.0..f64::INFINITY;

/// Refuses a value of which a number is outside a domain; a value without numbers passes.
///
/// # Errors
/// [`Error::InvalidOption`] with the number.
pub fn check<S>(
    options: &S,
    name: &'static str,
    value: &Value,
    domain: &impl Domain<S>,
    expected: &'static str,
) -> Result<()> {
    match value.numbers().into_iter().find(|number| !domain.has(options, *number)) {
        Some(number) => Err(Error::option(name, number, expected)),
        None => Ok(()),
    }
}
