//! The assumption that is most likely wrong where a solution does not fit its log.

use std::fmt;

use nalgebra::Matrix3;

use super::contradictions::Contradictions;
use super::deviations::{Assumed, Deviation};
use super::noise::NoiseFactors;
use crate::selfcalib::bundle::{BundleProblem, largest_ratio};
use crate::selfcalib::model::OUTLIER_SIGMAS;
use crate::selfcalib::options::SelfCalibratorOptions;
use crate::words;

/// Share of outliers from which on names, or a bump, are to blame and not strays.
const MOST_OUTLIERS: f64 = 0.15;

/// Share of contradicted motions from which on they are not single slips.
const MOST_CONTRADICTED: f64 = 0.1;

/// Standard deviations of a deviation of the wheels or the clock beyond which it is not chance, and of the mounting by which it
/// would move, below which it does not matter where the noise is as told.
pub(crate) const DEVIATION_SIGMAS: f64 = 5.0;
const DEVIATION_SHIFT: f64 = 1.0;

/// The same of the image centre and of a rolling shutter: 99 % of two normal numbers are within. The mounting follows them more than anything
/// else, by two standard deviations for each of their own.
const ONCE_ROUND_SIGMAS: f64 = 3.035;

/// The same of a creep: 99.7 % of normal numbers are within.
const CREEP_SIGMAS: f64 = 3.0;

/// Ratio of a standard deviation as motions of parts of the drive scatter to what their noise makes, beyond which the drive is not the
/// same throughout. Of 300 simulated drives whose motions err alone none is above 3.8.
const MOST_DRIFT: f64 = 5.0;

words! {
    /// What is most likely wrong with a log or with what is told of the robot.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum Cause {
        /// Most turns are others than the odometry's: a sign or a unit.
        Turns = "turns",
        /// Many bearings are outliers: a bump of the camera, or wrong names of landmarks.
        Outliers = "outliers",
        /// Odometry and bearings jump, and the camera may have been bumped as well as the wheels may have slipped.
        Bump = "bump",
        /// Many motions are contradicted: wheels slip.
        Slips = "slips",
        /// The bearings' noise is larger than told.
        BearingSigma = "bearing_sigma_rad",
        /// The motions' noise is larger than told.
        OdometryK = "odometry_k_m",
        /// The wheel base is another one.
        WheelBase = "wheel_base_m",
        /// One wheel runs farther than the other.
        Wheels = "right_over_left",
        /// The bearings are later than the odometry, or earlier.
        TimeOffset = "time_offset_s",
        /// The bearings err once round the camera: another image centre, or a camera that leans.
        Centre = "centre",
        /// Lines are seen later on one side of the camera than on the other: rows that are read one after another.
        Shutter = "rolling_shutter",
        /// The camera turns all along the drive: a mount that works loose.
        Creep = "creep",
        /// The motions of a part of the drive err together: a carpet, a tyre that loses air.
        Drift = "drift",
    }
}

impl Cause {
    /// Whether it is of the camera, all along the drive.
    pub(crate) fn is_of_camera(self) -> bool {
        matches!(self, Self::Centre | Self::Shutter | Self::Creep)
    }
}

/// A cause, and the number that would suit the log: that of the option or quantity of the cause's name, or a share.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Suspect {
    /// What is most likely wrong.
    pub cause: Cause,
    /// The number that would suit, times in steps, or in seconds in a log with times; of `turns`, `outliers` and `slips` the share that is
    /// contradicted, of `bump` the angle in radians, of `centre` the largest error of a bearing in radians, of `rolling_shutter` by how much
    /// later lines are seen on one side, of `creep` the angle in radians from the first keyframe to the last, of `drift` the factor of a
    /// standard deviation.
    pub value: f64,
}

impl fmt::Display for Suspect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cause, value } = *self;
        let percent = 100.0 * value;
        match cause {
            Cause::Turns => write!(f, "{percent:.0} % of the turns contradicted: a wrong sign or unit"),
            Cause::Outliers => {
                write!(
                    f,
                    "{percent:.0} % of the bearings are outliers: a bump of the camera, or wrong names of landmarks"
                )
            }
            Cause::Bump => write!(
                f,
                "a jump by {:.1} degrees, which may be a bump of the camera as well as a slip of the wheels",
                value.to_degrees()
            ),
            Cause::Slips => {
                write!(f, "{percent:.0} % of the motions contradicted: wheels slip, or odometry_k_m is too small")
            }
            Cause::BearingSigma => write!(f, "bearings scatter more than told: try bearing_sigma_rad = {value:.2e}"),
            Cause::OdometryK => write!(f, "wheels are noisier than told: try odometry_k_m = {value:.1e}"),
            Cause::WheelBase => {
                write!(f, "turns tell another wheel base: try wheel_base_m = {value:.4}, or estimate_odometry")
            }
            Cause::Wheels => {
                write!(f, "the right wheel runs {value:.4} times as far as the left: try estimate_odometry")
            }
            Cause::Centre => write!(
                f,
                "bearings err by {:.2} degrees once round the camera, as about another image centre or from a camera that leans: try estimate_centre",
                value.to_degrees()
            ),
            Cause::Shutter => write!(
                f,
                "lines seem to be seen {value:.3} steps (seconds, with times) later on one side of the camera than on the other, as through a rolling shutter: try estimate_rolling_shutter, or drive more slowly"
            ),
            Cause::Creep => write!(
                f,
                "the camera seems to have turned by {:.2} degrees along the drive, as on a mount that works loose: fasten it, and calibrate anew",
                value.to_degrees()
            ),
            Cause::Drift => write!(
                f,
                "motions of a part of the drive err together, as on a carpet: deviations are {value:.1} times those of motions that err alone"
            ),
            Cause::TimeOffset => write!(
                f,
                "bearings seem to be {value:.2} steps (seconds, with times) later than the odometry (earlier if negative): try estimate_time_offset, with times"
            ),
        }
    }
}

impl Deviation {
    /// The suspect of what is of the camera, none of others.
    pub(crate) fn of_camera(&self) -> Option<Suspect> {
        match self.of {
            Assumed::Centre => Some(Suspect { cause: Cause::Centre, value: self.value }),
            // From side to side it is twice that from the middle.
            Assumed::Shutter => Some(Suspect { cause: Cause::Shutter, value: 2.0 * self.value }),
            Assumed::Creep => Some(Suspect { cause: Cause::Creep, value: self.value }),
            _ => None,
        }
    }
}

impl BundleProblem {
    /// What is most likely wrong at this solution with these deviations, whose mounting has that covariance, and another one as motions
    /// of parts of the drive scatter.
    pub(crate) fn suspect(
        &self,
        options: &SelfCalibratorOptions,
        counts: &Contradictions,
        (factors, deviations): (NoiseFactors, &[Deviation]),
        covariance: &Matrix3<f64>,
        motion_scatter: Option<&Matrix3<f64>>,
    ) -> Option<Suspect> {
        let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
        let found = |cause, value| Some(Suspect { cause, value });
        let bump = || found(Cause::Bump, self.possible_bump(options, covariance)?);
        if counts.most_turns() {
            return found(Cause::Turns, share(counts.contradicted_turns, counts.turns));
        }
        let excess = factors.excess();
        let most = |d: &Deviation| match d.of {
            Assumed::Centre | Assumed::Shutter => ONCE_ROUND_SIGMAS,
            Assumed::Creep => CREEP_SIGMAS,
            _ => DEVIATION_SIGMAS,
        };
        let worst = deviations
            .iter()
            .filter(|d| d.sigmas > most(d) * excess.sqrt() && (excess > 1.0 || d.shift > DEVIATION_SHIFT))
            .max_by(|a, b| a.sigmas.total_cmp(&b.sigmas));
        let drift = motion_scatter.map_or(1.0, |scatter| largest_ratio(covariance, scatter));
        // The odometry alone tells a creep: motions that are noisier, or err together, turn the robot against the bearings as well.
        let is_outdone = |d: &&Deviation| d.of == Assumed::Creep && d.sigmas <= drift * excess.sqrt();
        let creep = worst.filter(is_outdone);
        let worst = worst.filter(|d| !is_outdone(d));
        if let Some(d) = worst {
            return match d.of {
                Assumed::Imbalance => found(Cause::Wheels, (2.0 * (self.wheels.imbalance + d.value)).exp()),
                // Readings are linear in the base; below zero where they turn to the other side.
                Assumed::WheelBase => found(Cause::WheelBase, self.wheels.base_m * (1.0 + d.value).abs()),
                Assumed::TimeOffset => found(Cause::TimeOffset, d.value),
                // A bump moves the camera's place, which the bearings of a part of the drive tell as another centre.
                Assumed::Centre | Assumed::Shutter | Assumed::Creep => bump().or_else(|| d.of_camera()),
            };
        }
        if factors.bearings > 1.0 {
            return found(Cause::BearingSigma, self.bearing_sigma * factors.bearings.sqrt());
        }
        if factors.motions > 1.0 {
            return found(Cause::OdometryK, self.noise.k_m * factors.motions);
        }
        let residuals = self.residuals();
        let outliers = share(residuals.iter().filter(|r| r.abs() > OUTLIER_SIGMAS).count(), residuals.len());
        let contradicted = share(counts.contradicted_motions, counts.motions);
        if outliers > MOST_OUTLIERS {
            return found(Cause::Outliers, outliers);
        }
        if contradicted > MOST_CONTRADICTED {
            return found(Cause::Slips, contradicted);
        }
        let of_part = (drift > MOST_DRIFT).then_some(Suspect { cause: Cause::Drift, value: drift });
        bump().or(of_part).or_else(|| creep?.of_camera())
    }
}
