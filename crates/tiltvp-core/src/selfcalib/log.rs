//! The log of a drive, and what is estimated from it.

use std::collections::BTreeMap;

use super::odometry::WheelMotion;
use super::options::SelfCalibratorOptions;
use crate::error::{Error, Result};

/// A bearing of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogBearing {
    /// The step after whose motion it was taken: a place in the list of readings.
    pub step: usize,
    /// The number that its landmark always has.
    pub landmark: u64,
    /// Radians in the camera's frame, counter-clockwise.
    pub bearing_rad: f64,
}

/// What else than the mounting is estimated from a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogOptions {
    /// Start, noise and wheel base; the method is that of the filter that gives the first guess.
    pub filter: SelfCalibratorOptions,
    /// Whether the wheel base, and which wheel runs farther, are estimated too. Bearings have no scale: the mean displacement
    /// of both wheels stays as reported. Default false.
    pub estimate_odometry: bool,
    /// Whether the time by which bearings are later than the odometry is estimated; needs times. Default false.
    pub estimate_time_offset: bool,
    /// Most linearisations of each of the two descents (robust, then without outliers). Default 60.
    pub max_iterations: u32,
}

impl Default for LogOptions {
    fn default() -> Self {
        Self {
            filter: SelfCalibratorOptions::default(),
            estimate_odometry: false,
            estimate_time_offset: false,
            max_iterations: 60,
        }
    }
}

/// Refuses a log that makes no sense.
pub(super) fn check(
    options: &LogOptions,
    readings: &[WheelMotion],
    times_s: Option<&[f64]>,
    bearings: &[LogBearing],
) -> Result<()> {
    for (i, r) in readings.iter().enumerate() {
        if !(r.left_m.is_finite() && r.right_m.is_finite()) {
            let got = format!("({}, {}) at step {i}", r.left_m, r.right_m);
            return Err(Error::argument("odometry", got, "finite numbers of metres"));
        }
    }
    for (i, b) in bearings.iter().enumerate() {
        if b.step >= readings.len() {
            let expected = format!("steps below {}, the length of the odometry", readings.len());
            return Err(Error::argument("bearings", format!("step {} in row {i}", b.step), expected));
        }
        if !b.bearing_rad.is_finite() {
            return Err(Error::argument(
                "bearings",
                format!("{} in row {i}", b.bearing_rad),
                "finite angles in radians",
            ));
        }
    }
    let mut first: BTreeMap<u64, usize> = BTreeMap::new();
    if !bearings.iter().any(|b| *first.entry(b.landmark).or_insert(b.step) != b.step) {
        return Err(Error::argument("bearings", "no landmark seen twice", "landmarks seen from several poses"));
    }
    match times_s {
        None if options.estimate_time_offset => {
            Err(Error::argument("times_s", "none", "the time of each step, to estimate a time offset"))
        }
        Some(times) if times.len() != readings.len() => {
            let expected = format!("one for each of {} steps", readings.len());
            Err(Error::argument("times_s", format!("{} times", times.len()), expected))
        }
        Some(times) => match times.windows(2).position(|t| !(t[1] >= t[0] && t[1].is_finite())) {
            Some(i) => Err(Error::argument("times_s", format!("{} after {}", times[i + 1], times[i]), "growing times")),
            None => Ok(()),
        },
        None => Ok(()),
    }
}
