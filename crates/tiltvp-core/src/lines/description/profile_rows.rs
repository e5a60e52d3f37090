//! The rows of a line's profile: how many, and at which elevations.

/// From row to row of `ln |tan e|`: six per cent of the height, a pixel at the elevation of 20 degrees where a pixel is a third
/// of a degree.
pub(crate) const PITCH: f64 = 0.06;

/// Least `|tan e|`: at 3.4 degrees two pixels of such a camera are a row apart already; closer to the horizon all rows are one.
const TAN_MIN: f64 = 0.06;

/// Rows below the horizon, down to 30 degrees as the default band of lines: `ln(tan 30 / TAN_MIN) / PITCH`.
pub(crate) const BELOW: usize = 38;

/// Rows above the horizon, up to 60 degrees.
pub(crate) const ABOVE: usize = 57;

/// Rows of a side. The first [`BELOW`] are those below the horizon, downwards from it, then those above it, upwards.
pub(crate) const ROWS: usize = BELOW + ABOVE;

/// Values of a line: the rows of the side of smaller azimuth, then those of the greater.
pub(crate) const VALUES: usize = 2 * ROWS;

/// The elevation of a row, radians.
pub(crate) fn elevation_rad(row: usize) -> f64 {
    let tangent = |k: usize| TAN_MIN * (k as f64 * PITCH).exp();
    if row < BELOW { -tangent(row).atan() } else { tangent(row - BELOW).atan() }
}
