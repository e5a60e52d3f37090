//! Logs that were recorded by another convention than ours, and what they would be by ours.

use std::fmt;

use crate::selfcalib::model::WheelMotion;
use crate::words;

use super::log::LogBearing;

/// Displacements and bearings.
type Log = (Vec<WheelMotion>, Vec<LogBearing>);

words! {
    /// How a log may have been meant, that fits where the log as it is does not.
    pub enum Misreading {
        /// A reflection: wheels swapped, both wheels negated, or bearings clockwise. Each of them fits alike, with another mounting.
        Reflected = "reflected",
        /// The left wheel counts backwards.
        LeftNegated = "left wheel negated",
        /// The right wheel counts backwards.
        RightNegated = "right wheel negated",
        /// Bearings are degrees.
        Degrees = "degrees",
        /// Displacements are millimetres.
        Millimetres = "millimetres",
        /// Displacements are sums since the start.
        Cumulative = "cumulative",
    }
}

impl Misreading {
    /// Whether bearings allow it: degrees only where some are beyond a turn in radians.
    pub(super) fn possible(self, bearings: &[LogBearing]) -> bool {
        self != Self::Degrees || bearings.iter().any(|b| b.bearing_rad.abs() > std::f64::consts::TAU)
    }

    /// The logs that may have been meant. Of the reflections swapped wheels fit where clockwise bearings do, while wheels that are both
    /// negated turn the camera by half a turn, which may be far from the start.
    pub(super) fn logs(self, readings: &[WheelMotion], bearings: &[LogBearing]) -> Vec<Log> {
        let mut logs = vec![self.read(readings, bearings)];
        if self == Self::Reflected {
            let negated = |motion: &WheelMotion| WheelMotion { left_m: -motion.left_m, right_m: -motion.right_m };
            logs.push((readings.iter().map(negated).collect(), bearings.to_vec()));
        }
        logs
    }

    /// The log as it may have been meant; of the reflections that with bearings clockwise.
    fn read(self, readings: &[WheelMotion], bearings: &[LogBearing]) -> Log {
        let (mut readings, mut bearings) = (readings.to_vec(), bearings.to_vec());
        let mut wheels = |left: f64, right: f64| {
            for motion in &mut readings {
                *motion = WheelMotion { left_m: left * motion.left_m, right_m: right * motion.right_m };
            }
        };
        match self {
            Self::Reflected => bearings.iter_mut().for_each(|b| b.bearing_rad = -b.bearing_rad),
            Self::LeftNegated => wheels(-1.0, 1.0),
            Self::RightNegated => wheels(1.0, -1.0),
            Self::Degrees => bearings.iter_mut().for_each(|b| b.bearing_rad = b.bearing_rad.to_radians()),
            Self::Millimetres => wheels(1e-3, 1e-3),
            Self::Cumulative => {
                let mut before = WheelMotion::default();
                for motion in &mut readings {
                    let now = *motion;
                    *motion = WheelMotion { left_m: now.left_m - before.left_m, right_m: now.right_m - before.right_m };
                    before = now;
                }
            }
        }
        (readings, bearings)
    }
}

/// A clause: what the log fits with.
impl fmt::Display for Misreading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Reflected => {
                "the log fits with the wheels swapped, both wheels negated, or bearings clockwise, which it cannot tell apart"
            }
            Self::LeftNegated => "the log fits with the left wheel negated",
            Self::RightNegated => "the log fits with the right wheel negated",
            Self::Degrees => "the log fits with bearings in degrees",
            Self::Millimetres => "the log fits with displacements in millimetres",
            Self::Cumulative => "the log fits with displacements that are cumulative",
        })
    }
}
