//! Options of the self-calibration.

use nalgebra::{Matrix3, Vector3};

use super::mounting::Mounting;
use super::odometry::MotionNoise;
use crate::error::{Error, Result};
use crate::filter::positive_semidefinite;

/// Which filter calibrates.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum CalibrationMethod {
    /// Landmarks by direction and the logarithm of inverse distance, iterated and gated updates, and a memory that is linearised anew.
    Default,
    /// The filter of section 8.2 of the paper, exactly: eqs. 28 to 31 and the Jacobians of appendix A.4.
    Paper,
}

/// The names of the filters.
pub const CALIBRATION_METHODS: [&str; 2] = ["default", "paper"];

impl CalibrationMethod {
    /// The filter of that name.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for any other name.
    pub fn from_name(name: &str) -> Result<Self> {
        match name {
            "default" => Ok(Self::Default),
            "paper" => Ok(Self::Paper),
            _ => Err(Error::option("method", format!("{name:?}"), "\"default\" or \"paper\"")),
        }
    }

    /// The name of the filter.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => CALIBRATION_METHODS[0],
            Self::Paper => CALIBRATION_METHODS[1],
        }
    }
}

/// Everything that can be chosen about a [`SelfCalibrator`](super::SelfCalibrator).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SelfCalibratorOptions {
    /// Which filter. Default [`CalibrationMethod::Default`].
    pub method: CalibrationMethod,
    /// Distance between the wheels, metres. It has no default that suits; 1.
    pub wheel_base_m: f64,
    /// Standard deviation of a bearing in radians. Default 0.5 degrees.
    pub bearing_sigma_rad: f64,
    /// Variance of a wheel's displacement for each metre of it (eq. 31), metres. Default 1e-5.
    pub odometry_k_m: f64,
    /// Standard deviation of every step's motion in either direction, beside eq. 31, metres (method "default"). Default 0.
    pub step_sigma_m: f64,
    /// Standard deviation of every step's turn, beside eq. 31, radians (method "default"). Default 0.
    pub step_sigma_rad: f64,
    /// The mounting as it is thought to be. Default: the origin.
    pub start: Mounting,
    /// Covariance of (x, y, yaw) at the start. Default: 0.3 m, 0.3 m, 0.5 rad.
    pub start_covariance: Matrix3<f64>,
    /// Probability with which a bearing passes the gate if its covariance is right (method "default"). Default 0.9999.
    pub gate_probability: f64,
    /// Poses with bearings that are kept to be linearised anew; the older half is summed up when there are more (method
    /// "default"). Default 400.
    pub memory: u32,
    /// Distance at which landmarks are thought to be when they are first seen, metres. Default 3.
    pub start_distance_m: f64,
    /// Standard deviation of its logarithm (method "default"): a factor of so many e. Default 1.5.
    pub start_distance_log_sigma: f64,
    /// Standard deviation of it, metres (method "paper"). Default 2.
    pub start_distance_sigma_m: f64,
    /// Factor by which `odometry_k_m` is inflated (method "paper"). Default 5.
    pub odometry_inflation: f64,
}

impl Default for SelfCalibratorOptions {
    fn default() -> Self {
        Self {
            method: CalibrationMethod::Default,
            wheel_base_m: 1.0,
            bearing_sigma_rad: 0.5f64.to_radians(),
            odometry_k_m: 1e-5,
            step_sigma_m: 0.0,
            step_sigma_rad: 0.0,
            start: Mounting::default(),
            start_covariance: Matrix3::from_diagonal(&Vector3::new(0.09, 0.09, 0.25)),
            gate_probability: 0.9999,
            memory: 400,
            start_distance_m: 3.0,
            start_distance_log_sigma: 1.5,
            start_distance_sigma_m: 2.0,
            odometry_inflation: 5.0,
        }
    }
}

impl SelfCalibratorOptions {
    /// The noise of the wheels, and of steps.
    pub fn motion_noise(&self) -> MotionNoise {
        MotionNoise { k_m: self.odometry_k_m, step_sigma_m: self.step_sigma_m, step_sigma_rad: self.step_sigma_rad }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        let positive = |name: &'static str, value: f64, expected: &'static str| {
            if value > 0.0 && value.is_finite() { Ok(()) } else { Err(Error::option(name, value, expected)) }
        };
        positive("wheel_base_m", self.wheel_base_m, "a positive number of metres")?;
        positive("bearing_sigma_rad", self.bearing_sigma_rad, "a positive angle in radians")?;
        positive("odometry_k_m", self.odometry_k_m, "a positive number of metres")?;
        positive("start_distance_log_sigma", self.start_distance_log_sigma, "a positive number")?;
        positive("start_distance_m", self.start_distance_m, "a positive number of metres")?;
        positive("start_distance_sigma_m", self.start_distance_sigma_m, "a positive number of metres")?;
        positive("odometry_inflation", self.odometry_inflation, "a positive factor")?;
        for (name, value) in [("step_sigma_m", self.step_sigma_m), ("step_sigma_rad", self.step_sigma_rad)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::option(name, value, "a number from 0"));
            }
        }
        let p = self.gate_probability;
        if !(p > 0.0 && p < 1.0) {
            return Err(Error::option("gate_probability", p, "a probability strictly between 0 and 1"));
        }
        if !(8..=100_000).contains(&self.memory) {
            return Err(Error::option("memory", self.memory, "a whole number from 8 to 100000"));
        }
        let start = self.start.vector();
        if !start.iter().all(|x| x.is_finite()) {
            return Err(Error::option(
                "start",
                format!("{:?}", start.as_slice()),
                "finite numbers (x_m, y_m, yaw_rad)",
            ));
        }
        let c = self.start_covariance;
        if !positive_semidefinite(&c) || c.try_inverse().is_none() || c.diagonal().min() <= 0.0 {
            let expected = "three positive standard deviations of (x_m, y_m, yaw_rad), or their covariance (3, 3)";
            return Err(Error::option("start_sigma", format!("{:?}", c.as_slice()), expected));
        }
        if self.method == CalibrationMethod::Paper && self.start.rho_m() < 1e-6 {
            let expected = "a distance from the axle above zero for method \"paper\", whose phi is undefined at 0";
            return Err(Error::option("start", format!("{:?}", start.as_slice()), expected));
        }
        Ok(())
    }
}
