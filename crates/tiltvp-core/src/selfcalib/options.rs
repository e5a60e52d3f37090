//! Options of the self-calibration.

use nalgebra::{Matrix3, Vector3};

use super::mounting::Mounting;
use super::odometry::{MotionNoise, WHEEL_BASE_MAX_M};
use crate::error::{Error, Result};
use crate::filter::positive_semidefinite;
use crate::options::{Above, Between, Kind, NOT_NEGATIVE, OptionValue, POSITIVE, Value};
use crate::{options, words};

words! {
    /// Which filter calibrates.
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub enum CalibrationMethod {
        /// Landmarks by direction and the logarithm of inverse distance, iterated and gated updates, and a sliding window of
        /// keyframes that is relinearised.
        Default = "default",
        /// The filter of Scaramuzza, Siegwart and Martinelli 2009, section 8.2, exactly: eqs. 28 to 31 and the Jacobians of
        /// appendix A.4.
        Paper = "paper",
    }
}

options! {
    /// Everything that can be chosen about a [`SelfCalibrator`](super::SelfCalibrator).
    #[derive(Copy)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub struct SelfCalibratorOptions {
        /// Which filter.
        method: CalibrationMethod = CalibrationMethod::Default;
        /// Distance between the wheels, metres. It has no default that suits.
        wheel_base_m: f64 = 1.0 => Above(0.0, WHEEL_BASE_MAX_M), "a positive number of metres, at most 200";
        /// Standard deviation of a bearing in radians.
        bearing_sigma_rad: f64 = 0.5f64.to_radians() => POSITIVE, "a positive angle in radians";
        /// Variance of a wheel's displacement for each metre of it (eq. 31), metres.
        odometry_k_m: f64 = 1e-5 => POSITIVE, "a positive number of metres";
        /// The mounting (x_m, y_m, yaw_rad) as it is thought to be: the origin, if nothing is known.
        start: Mounting = Mounting::default();
        /// Standard deviations of (x_m, y_m, yaw_rad) at the start, or their covariance (3, 3).
        [as "start_sigma" by StartSigma] start_covariance: Matrix3<f64>
            = Matrix3::from_diagonal(&Vector3::new(0.09, 0.09, 0.25));
        /// Distance at which landmarks are thought to be when they are first seen, metres.
        start_distance_m: f64 = 3.0 => POSITIVE, "a positive number of metres";
        /// Standard deviation of the logarithm of that distance: a factor of so many e.
        [where is_default, "it is one of method \"default\""] start_distance_log_sigma: f64 = 1.5
            => POSITIVE, "a positive number";
        /// Probability with which a bearing passes the gate if its covariance is right.
        [where is_default, "it is one of method \"default\""] gate_probability: f64 = 0.9999
            => Between(0.0, 1.0), "a probability strictly between 0 and 1";
        /// Size of the sliding window: keyframes that are kept and relinearised. The older half is marginalised when there are more, or 300 landmarks with one bearing each.
        [where is_default, "it is one of method \"default\""] keyframes_max: u32 = 400 => 8.0..=1e5, "a whole number from 8 to 100000";
        /// Standard deviation of every step's motion in either direction, beside eq. 31, metres.
        [where is_default, "it is one of method \"default\""] step_sigma_m: f64 = 0.0 => NOT_NEGATIVE, "a number from 0";
        /// Standard deviation of every step's turn, beside eq. 31, radians.
        [where is_default, "it is one of method \"default\""] step_sigma_rad: f64 = 0.0 => NOT_NEGATIVE, "a number from 0";
        /// Standard deviation of the distance of landmarks that are first seen, metres.
        [where is_paper, "it is one of method \"paper\""] start_distance_sigma_m: f64 = 2.0
            => POSITIVE, "a positive number of metres";
        /// Factor by which `odometry_k_m` is inflated.
        [where is_paper, "it is one of method \"paper\""] odometry_inflation: f64 = 5.0 => POSITIVE, "a positive factor";
    }
    check start_is_possible
}

fn is_default(options: &SelfCalibratorOptions) -> bool {
    options.method == CalibrationMethod::Default
}

fn is_paper(options: &SelfCalibratorOptions) -> bool {
    options.method == CalibrationMethod::Paper
}

fn start_is_possible(options: &SelfCalibratorOptions) -> Result<()> {
    let start = options.start.to_value();
    if !options.start.vector().iter().all(|x| x.is_finite()) {
        return Err(Error::option("start", start, "finite numbers (x_m, y_m, yaw_rad)"));
    }
    let c = options.start_covariance;
    if !positive_semidefinite(&c) || c.try_inverse().is_none() || c.diagonal().min() <= 0.0 {
        let expected = "three positive standard deviations of (x_m, y_m, yaw_rad), or their covariance (3, 3)";
        return Err(Error::option("start_sigma", format!("{:?}", c.as_slice()), expected));
    }
    if is_paper(options) && options.start.rho_m() < 1e-6 {
        let expected = "a distance from the axle above zero for method \"paper\", whose phi is undefined at 0";
        return Err(Error::option("start", start, expected));
    }
    Ok(())
}

impl SelfCalibratorOptions {
    /// The noise of the wheels, and of steps.
    pub fn motion_noise(&self) -> MotionNoise {
        MotionNoise { k_m: self.odometry_k_m, step_sigma_m: self.step_sigma_m, step_sigma_rad: self.step_sigma_rad }
    }
}

/// As (x_m, y_m, yaw_rad), none of which is wrapped.
impl OptionValue for Mounting {
    const KIND: Kind = Kind::Array(&[3]);

    fn to_value(&self) -> Value {
        self.vector().to_value()
    }

    fn from_value(value: &Value) -> Option<Self> {
        <[f64; 3]>::from_value(value).map(|[x_m, y_m, yaw_rad]| Self { x_m, y_m, yaw_rad })
    }
}

/// A covariance that may be given by standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartSigma(Matrix3<f64>);

impl From<Matrix3<f64>> for StartSigma {
    fn from(covariance: Matrix3<f64>) -> Self {
        Self(covariance)
    }
}

impl From<StartSigma> for Matrix3<f64> {
    fn from(sigma: StartSigma) -> Self {
        sigma.0
    }
}

impl OptionValue for StartSigma {
    const KIND: Kind = Kind::Array(&[3, 3]);

    fn to_value(&self) -> Value {
        self.0.to_value()
    }

    fn from_value(value: &Value) -> Option<Self> {
        // A standard deviation that is not positive must not pass as its square.
        let squares =
            |sigma: Vector3<f64>| Matrix3::from_diagonal(&sigma.map(|s| if s > 0.0 { s * s } else { f64::NAN }));
        Vector3::from_value(value).map(squares).or_else(|| Matrix3::from_value(value)).map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Options;

    #[test]
    fn each_method_has_its_own_options() {
        let of = |method: CalibrationMethod| SelfCalibratorOptions { method, ..SelfCalibratorOptions::default() };
        for (name, owner) in [
            ("keyframes_max", CalibrationMethod::Default),
            ("step_sigma_m", CalibrationMethod::Default),
            ("start_distance_sigma_m", CalibrationMethod::Paper),
            ("odometry_inflation", CalibrationMethod::Paper),
        ] {
            for method in [CalibrationMethod::Default, CalibrationMethod::Paper] {
                assert_eq!(of(method).get(name).is_some(), method == owner, "{name} of {method:?}");
            }
        }
        assert!(of(CalibrationMethod::Paper).get("odometry_k_m").is_some());
    }
    #[test]
    fn a_start_above_the_axle_has_no_direction() {
        let at = |method: CalibrationMethod, x_m: f64| {
            let start = Mounting { x_m, ..Mounting::default() };
            SelfCalibratorOptions { method, start, ..SelfCalibratorOptions::default() }.validate()
        };
        assert!(at(CalibrationMethod::Default, 0.0).is_ok());
        for (x_m, is_possible) in [(0.0, false), (1e-7, false), (-1e-7, false), (1e-5, true), (-0.2, true)] {
            assert_eq!(at(CalibrationMethod::Paper, x_m).is_ok(), is_possible, "{x_m}");
        }
    }
}
