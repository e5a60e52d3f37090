//! The nearest whole numbers.

/// The nearest number of 16 bits. (`f64::round` is a call of a function on processors without SSE4.1, and so in all builds for any.)
#[inline]
pub(crate) fn whole(value: f64) -> i16 {
    (value + 0.5f64.copysign(value)) as i16
}
