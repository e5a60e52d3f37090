//! Options of the tilt filter.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::options;
use crate::options::{Above, Between, POSITIVE};

options! {
    /// The part of the lean that belongs to the robot and not to the floor: a mounting error, a soft wheel, a load.
    #[derive(Copy)]
    pub struct MountingOptions {
        /// Standard deviation in radians, in each direction, of that part before anything is known.
        prior_rad: f64 = 1.5f64.to_radians() => Above(0.0, FRAC_PI_2), "an angle above 0 and at most pi/2";
        /// How fast it may change, in radians per square root of a metre driven.
        walk_rad_per_sqrt_m: f64 = 2e-4 => 0.0..=PI, "an angle from 0 to pi";
    }
}

options! {
    /// Everything that can be chosen about a [`TiltFilter`](super::TiltFilter).
    #[derive(Copy)]
    pub struct TiltFilterOptions {
        /// How fast the floor's tilt changes, in radians per square root of a metre that the wheels roll.
        walk_rad_per_sqrt_m: f64 = 0.01 => 0.0..=PI, "an angle from 0 to pi";
        /// Half the distance between the wheels in metres: how far they roll while the robot turns in place by one radian. The
        /// default lies between those of vacuum cleaners (0.12) and of robots that people ride on (0.2).
        half_track_m: f64 = 0.15 => 0.0..=100.0, "a number of metres from 0 to 100";
        /// How fast it changes however far the robot drives, in radians per square root of a prediction.
        walk_rad_per_sqrt_step: f64 = 0.001 => 0.0..=PI, "an angle from 0 to pi";
        /// Probability with which the gate lets an estimate pass whose covariance is right.
        gate_probability: f64 = 0.999 => Between(0.0, 1.0), "a probability strictly between 0 and 1";
        /// Least confidence of an estimate that is looked at.
        confidence_min: f64 = 0.5 => 0.0..=1.0, "a probability from 0 to 1";
        /// How many rejected estimates in a row have to agree with each other to be followed.
        jump_after: u32 = 3 => 1.0..=f64::from(u32::MAX), "a whole number from 1";
        /// After how many rejections in a row, agreeing or not, the floor's tilt is taken to be unknown.
        lost_after: u32 = 10 => 1.0..=f64::from(u32::MAX), "a whole number from 1";
        /// Share of an estimate's variance that the next image of the same place has in common with it.
        correlated_share: f64 = 0.9 => 0.0..1.0, "a share from 0, below 1";
        /// Metres driven after which what images have in common has fallen to 1/e.
        correlation_m: f64 = 2.0 => POSITIVE, "a positive number of metres";
        /// Standard deviation in radians that is added to that of every estimate.
        noise_floor_rad: f64 = 0.002 => 1e-6..=FRAC_PI_2, "an angle from 1e-6 to pi/2";
        /// Standard deviation of the floor's tilt in radians, in each direction, before anything is known.
        prior_rad: f64 = 10f64.to_radians() => Above(0.0, FRAC_PI_2), "an angle above 0 and at most pi/2";
        /// Largest standard deviation in radians of an answer; the filter abstains beyond.
        sigma_max_rad: f64 = 0.02 => Above(0.0, f64::INFINITY), "a positive angle, or infinity";
        /// Whether a lean of the robot itself is estimated beside that of the floor. Without it all lean is the floor's.
        [switch "estimate_mounting" "mounting_"] mounting: Option<MountingOptions> = None;
    }
}
