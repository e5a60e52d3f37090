//! Options of the tilt filter.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::error::{Error, Result};

/// The part of the lean that belongs to the robot and not to the floor: a mounting error, a soft wheel, a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountingOptions {
    /// Standard deviation in radians, in each direction, of that part before anything is known. Default 1.5 degrees.
    pub prior_rad: f64,
    /// How fast it may change, in radians per square root of a metre driven. Default 0.0002.
    pub walk_rad_per_sqrt_m: f64,
}

impl Default for MountingOptions {
    fn default() -> Self {
        Self { prior_rad: 1.5f64.to_radians(), walk_rad_per_sqrt_m: 2e-4 }
    }
}

/// Everything that can be chosen about a [`TiltFilter`](super::TiltFilter).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltFilterOptions {
    /// How fast the floor's tilt changes, in radians per square root of a metre driven. Default 0.01.
    pub walk_rad_per_sqrt_m: f64,
    /// How fast it changes however far the robot drives, in radians per square root of a prediction. Default 0.001.
    pub walk_rad_per_sqrt_step: f64,
    /// Probability with which the gate lets an estimate pass whose covariance is right. Default 0.999.
    pub gate_probability: f64,
    /// Least confidence of an estimate that is looked at. Default 0.5.
    pub confidence_min: f64,
    /// How many rejected estimates in a row have to agree with each other to be followed. Default 3.
    pub jump_after: u32,
    /// After how many rejections in a row, agreeing or not, the floor's tilt is taken to be unknown. Default 10.
    pub lost_after: u32,
    /// Share of an estimate's variance that the next image of the same place has in common with it. Default 0.9.
    pub correlated_share: f64,
    /// Metres driven after which what images have in common has fallen to 1/e. Default 2.
    pub correlation_m: f64,
    /// Standard deviation in radians that is added to that of every estimate. Default 0.002.
    pub noise_floor_rad: f64,
    /// Standard deviation of the floor's tilt in radians, in each direction, before anything is known. Default 10 degrees.
    pub prior_rad: f64,
    /// Largest standard deviation in radians of an answer; the filter abstains beyond. Default 0.02.
    pub sigma_max_rad: f64,
    /// Whether a lean of the robot itself is estimated beside that of the floor, and how. Default `None`: all lean is the
    /// floor's.
    pub mounting: Option<MountingOptions>,
}

impl Default for TiltFilterOptions {
    fn default() -> Self {
        Self {
            walk_rad_per_sqrt_m: 0.01,
            walk_rad_per_sqrt_step: 0.001,
            gate_probability: 0.999,
            confidence_min: 0.5,
            jump_after: 3,
            lost_after: 10,
            correlated_share: 0.9,
            correlation_m: 2.0,
            noise_floor_rad: 0.002,
            prior_rad: 10f64.to_radians(),
            sigma_max_rad: 0.02,
            mounting: None,
        }
    }
}

impl TiltFilterOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field; `mounting_prior_rad` and `mounting_walk_rad_per_sqrt_m` are those
    /// of [`MountingOptions`].
    pub fn validate(&self) -> Result<()> {
        let check = |good: bool, name: &'static str, value: f64, expected: &'static str| {
            if good { Ok(()) } else { Err(Error::option(name, value, expected)) }
        };
        let walk = |name, value: f64| check((0.0..=PI).contains(&value), name, value, "an angle from 0 to pi");
        let prior = |name, value: f64| {
            check(value > 0.0 && value <= FRAC_PI_2, name, value, "an angle above 0 and at most pi/2")
        };
        walk("walk_rad_per_sqrt_m", self.walk_rad_per_sqrt_m)?;
        walk("walk_rad_per_sqrt_step", self.walk_rad_per_sqrt_step)?;
        let p = self.gate_probability;
        check(p > 0.0 && p < 1.0, "gate_probability", p, "a probability strictly between 0 and 1")?;
        let c = self.confidence_min;
        check((0.0..=1.0).contains(&c), "confidence_min", c, "a probability from 0 to 1")?;
        for (name, count) in [("jump_after", self.jump_after), ("lost_after", self.lost_after)] {
            check(count > 0, name, f64::from(count), "a whole number from 1")?;
        }
        let s = self.correlated_share;
        check((0.0..1.0).contains(&s), "correlated_share", s, "a share from 0, below 1")?;
        let m = self.correlation_m;
        check(m > 0.0 && m.is_finite(), "correlation_m", m, "a positive number of metres")?;
        let floor = self.noise_floor_rad;
        check((1e-6..=FRAC_PI_2).contains(&floor), "noise_floor_rad", floor, "an angle from 1e-6 to pi/2")?;
        prior("prior_rad", self.prior_rad)?;
        check(self.sigma_max_rad > 0.0, "sigma_max_rad", self.sigma_max_rad, "a positive angle, or infinity")?;
        if let Some(mounting) = &self.mounting {
            prior("mounting_prior_rad", mounting.prior_rad)?;
            walk("mounting_walk_rad_per_sqrt_m", mounting.walk_rad_per_sqrt_m)?;
        }
        Ok(())
    }
}
