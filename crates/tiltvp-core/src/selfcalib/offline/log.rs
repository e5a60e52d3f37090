//! The log of a drive and the options of its calibration.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::options;
use crate::selfcalib::model::{MOST_LANDMARKS, WheelMotion};
use crate::selfcalib::options::SelfCalibratorOptions;

/// A bearing of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogBearing {
    /// The step after whose motion it was taken: an index into the readings.
    pub step: usize,
    /// The identifier of its landmark.
    pub landmark: u64,
    /// Radians in the camera's frame, counter-clockwise.
    pub bearing_rad: f64,
}

options! {
    /// What else than the mounting is estimated from a log.
    #[derive(Copy)]
    pub struct LogOptions {
        /// Start, noise and wheel base; the method is that of the filter that gives the first guess.
        [flat except "method" "gate_probability" "keyframes_max"] filter: SelfCalibratorOptions = SelfCalibratorOptions::default();
        /// Whether the wheel base, and which wheel runs farther, are estimated too. Bearings have no scale: the mean displacement
        /// of both wheels stays as reported.
        estimate_odometry: bool = false;
        /// Whether the time by which bearings are later than the odometry is estimated; needs times.
        estimate_time_offset: bool = false;
        /// Whether an error of the bearings that goes once round the camera is estimated too: what another image centre makes, or a
        /// camera that leans.
        estimate_centre: bool = false;
        /// Whether it is estimated too by how much lines are seen later on one side of the camera than on the other, as through a
        /// rolling shutter.
        estimate_rolling_shutter: bool = false;
        /// Most linearisations of each of the two descents (robust, then without outliers).
        max_iterations: u32 = 100;
        /// Parts of the landmarks that are left out in turn: the covariance of the mounting is then no less than the scatter of
        /// what the others tell. For landmarks that may be two things', as lines of images; 0 leaves none out.
        jackknife_parts: u32 = 0 => none_or_several, "0, or a whole number from 2 to 1000";
    }
}

fn none_or_several(_: &LogOptions, parts: f64) -> bool {
    parts == 0.0 || (2.0..=1000.0).contains(&parts)
}

/// A log that has been checked, with the bearings in the order of steps.
#[derive(Clone)]
pub(super) struct SortedLog<'a> {
    pub(super) options: &'a LogOptions,
    readings: &'a [WheelMotion],
    times_s: Option<&'a [f64]>,
    bearings: Vec<LogBearing>,
}

/// A step of a log.
pub(super) struct LogStep<'a> {
    pub(super) reading: &'a WheelMotion,
    /// Time since the step before; without times steps count as seconds.
    pub(super) seconds: f64,
    pub(super) bearings: &'a [LogBearing],
}

impl<'a> SortedLog<'a> {
    /// # Errors
    /// Those of [`calibrate_log`](super::calibrate_log).
    pub(super) fn new(
        options: &'a LogOptions,
        readings: &'a [WheelMotion],
        times_s: Option<&'a [f64]>,
        bearings: &[LogBearing],
    ) -> Result<Self> {
        options.validate()?;
        check(options, readings, times_s, bearings)?;
        let mut bearings = bearings.to_vec();
        bearings.sort_by_key(|b| b.step);
        Ok(Self { options, readings, times_s, bearings })
    }

    /// This log with bearings of other landmarks.
    pub(super) fn renamed(&self, name: impl Fn(&LogBearing) -> u64) -> Self {
        let bearings = self.bearings.iter().map(|b| LogBearing { landmark: name(b), ..*b }).collect();
        Self { bearings, ..*self }
    }

    pub(super) fn steps(&self) -> impl Iterator<Item = LogStep<'_>> {
        let mut rest = self.bearings.as_slice();
        self.readings.iter().enumerate().map(move |(step, reading)| {
            // The first is taken to be as long as the next.
            let interval = |t: &[f64]| t.get(step.max(1)).map_or(0.0, |end| end - t[step.max(1) - 1]);
            let seconds = self.times_s.map_or(1.0, interval);
            let (bearings, later) = rest.split_at(rest.partition_point(|b| b.step <= step));
            rest = later;
            LogStep { reading, seconds, bearings }
        })
    }
}

/// Refuses a log that makes no sense.
fn check(
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
    let again = bearings.iter().filter(|b| *first.entry(b.landmark).or_insert(b.step) != b.step).count();
    if again == 0 {
        return Err(Error::argument("bearings", "no landmark seen twice", "landmarks seen from several poses"));
    }
    let mut seen: Vec<_> = bearings.iter().map(|b| (b.step, b.landmark)).collect();
    seen.sort_unstable();
    if let Some(twice) = seen.windows(2).find(|pair| pair[0] == pair[1]) {
        let got = format!("two of landmark {} at step {}", twice[0].1, twice[0].0);
        return Err(Error::argument("bearings", got, "one of each landmark"));
    }
    if first.len() > MOST_LANDMARKS {
        let expected = format!("at most {MOST_LANDMARKS}");
        return Err(Error::argument("bearings", format!("{} landmarks", first.len()), expected));
    }
    match times_s {
        None if options.estimate_time_offset => {
            Err(Error::argument("times_s", "none", "the time of each step, to estimate a time offset"))
        }
        Some(times) if times.len() != readings.len() => {
            let expected = format!("one for each of {} steps", readings.len());
            Err(Error::argument("times_s", format!("{} times", times.len()), expected))
        }
        Some(times) => match times.windows(2).position(|t| !(t[1] >= t[0] && t.iter().all(|t| t.is_finite()))) {
            Some(i) => Err(Error::argument("times_s", format!("{} after {}", times[i + 1], times[i]), "growing times")),
            None => Ok(()),
        },
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_landmarks_as_there_may_be_are_taken_and_not_one_more() {
        let readings = [WheelMotion { left_m: 0.1, right_m: 0.1 }; 2];
        let log = |landmarks: usize| {
            let bearing = |i: usize| LogBearing { step: i % 2, landmark: i as u64 / 2, bearing_rad: 0.1 };
            let bearings: Vec<_> = (0..2 * landmarks).map(bearing).collect();
            check(&LogOptions::default(), &readings, None, &bearings)
        };
        assert!(log(MOST_LANDMARKS).is_ok());
        assert!(log(MOST_LANDMARKS + 1).is_err());
    }

    #[test]
    fn times_are_finite_and_grow() {
        let (readings, bearing) =
            ([WheelMotion::default(); 3], |step| LogBearing { step, landmark: 7, bearing_rad: 0.1 });
        let log = |times_s: [f64; 3]| check(&LogOptions::default(), &readings, Some(&times_s), &[0, 1].map(bearing));
        assert!(log([0.0, 1.0, 1.0]).is_ok());
        for times_s in [[f64::NEG_INFINITY, 0.0, 1.0], [0.0, f64::NAN, 1.0], [0.0, 1.0, f64::INFINITY], [1.0, 0.0, 2.0]]
        {
            assert!(log(times_s).is_err(), "{times_s:?}");
        }
    }

    #[test]
    fn a_landmark_has_one_bearing_a_step() {
        let readings = [WheelMotion { left_m: 0.1, right_m: 0.1 }; 3];
        let log = |steps: &[usize]| {
            let bearing = |step: &usize| LogBearing { step: *step, landmark: 7, bearing_rad: 0.1 };
            check(&LogOptions::default(), &readings, None, &steps.iter().map(bearing).collect::<Vec<_>>())
        };
        assert!(log(&[2, 0, 1]).is_ok());
        let error = log(&[2, 0, 2]).unwrap_err().to_string();
        assert!(error.contains("two of landmark 7 at step 2"), "{error}");
    }
}
