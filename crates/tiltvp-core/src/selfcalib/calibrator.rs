//! `SelfCalibrator`: the mounting of a camera, step by step while the robot drives.

use std::fmt;

use nalgebra::{Matrix3, Vector3};

use super::mounting::Mounting;
use super::observability::Observability;
use super::odometry::WheelMotion;
use super::options::{CalibrationMethod, SelfCalibratorOptions};
use super::outcome::Outcome;
use super::paper::PaperFilter;
use super::recursive::Recursive;
use crate::error::{Error, Result};

/// A mounting as it is believed to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountingEstimate {
    /// The mounting; not finite if the paper's filter has diverged beyond numbers.
    pub mounting: Mounting,
    /// Covariance of (x, y, yaw).
    pub covariance_xy_yaw: Matrix3<f64>,
    /// Covariance of (phi, rho, psi); infinite at rho = 0.
    pub covariance_phi_rho_psi: Matrix3<f64>,
    /// What the motion so far has determined.
    pub observability: Observability,
    /// Mean normalised innovation squared per bearing over the last steps, 1 if all is as assumed; `None` before the
    /// first.
    pub mean_nis: Option<f64>,
    /// Whether innovations over a window of steps were ever too large: the mount was bumped, or an assumption is wrong.
    pub alarm: bool,
}

impl MountingEstimate {
    /// From the mounting with the covariance of (x, y, yaw).
    pub(super) fn new(
        mounting: Mounting,
        covariance_xy_yaw: Matrix3<f64>,
        start: &Matrix3<f64>,
        mean_nis: Option<f64>,
        alarm: bool,
    ) -> Self {
        let j = mounting.polar_by_vector();
        let polar = j * covariance_xy_yaw * j.transpose();
        let finite = polar.iter().all(|x| x.is_finite());
        Self {
            mounting,
            covariance_xy_yaw,
            covariance_phi_rho_psi: if finite { polar } else { Matrix3::from_diagonal_element(f64::INFINITY) },
            observability: Observability::new(&mounting, &covariance_xy_yaw, start),
            mean_nis,
            alarm,
        }
    }

    /// Whether the answer can be relied upon: everything determined, no alarm, finite.
    pub fn reliable(&self) -> bool {
        self.observability.complete() && !self.alarm && self.mounting.vector().iter().all(|x| x.is_finite())
    }
}

/// Whether it can be relied upon, what is determined and whether there was an alarm, in a sentence.
impl fmt::Display for MountingEstimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.mounting.vector().iter().all(|x| x.is_finite()) {
            return write!(f, "the filter has diverged");
        }
        if !self.reliable() {
            write!(f, "not to be relied upon; ")?;
        }
        write!(f, "{}", self.observability)?;
        if self.alarm {
            write!(f, "; alarm: bearings disagree with the mounting, as after a bump (calibrate anew)")?;
        }
        Ok(())
    }
}

/// What a step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationStep {
    /// Normalised innovation squared of the bearings that were fused: chi-square of `used` degrees of freedom.
    pub nis: f64,
    /// Bearings of known landmarks that were fused.
    pub used: usize,
    /// Bearings of known landmarks that did not pass the gate.
    pub rejected: usize,
    /// Landmarks seen for the first time.
    pub started: usize,
}

#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Filter {
    Default(Box<Recursive>),
    Paper(Box<PaperFilter>),
}

/// Estimates where the camera sits on the robot from wheel displacements and bearings of identified landmarks.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SelfCalibrator {
    options: SelfCalibratorOptions,
    filter: Filter,
    last_nis: Option<f64>,
}

impl SelfCalibrator {
    /// A filter that has seen nothing.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] from [`SelfCalibratorOptions::validate`].
    pub fn new(options: SelfCalibratorOptions) -> Result<Self> {
        options.validate()?;
        let filter = match options.method {
            CalibrationMethod::Default => Filter::Default(Box::new(Recursive::new(&options)?)),
            CalibrationMethod::Paper => Filter::Paper(Box::new(PaperFilter::new(&options))),
        };
        Ok(Self { options, filter, last_nis: None })
    }

    /// The options in force.
    pub fn options(&self) -> &SelfCalibratorOptions {
        &self.options
    }

    /// Whether everything that it remembers fits together, as it does unless it was put together from bytes that were tampered
    /// with.
    pub fn is_consistent(&self) -> bool {
        self.options.validate().is_ok()
            && match &self.filter {
                Filter::Default(filter) => filter.is_consistent(),
                Filter::Paper(filter) => filter.is_consistent(),
            }
    }

    /// Forgets everything but the options.
    ///
    /// # Errors
    /// None that the constructor would not have had.
    pub fn reset(&mut self) -> Result<()> {
        *self = Self::new(self.options)?;
        Ok(())
    }

    /// Moves by the wheels' displacements, then looks: bearings in radians in the camera's frame, counter-clockwise, each
    /// with the number that its landmark always has.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for numbers that are not finite, counts that differ, and landmarks seen twice; the filter is
    /// then as before.
    pub fn step(&mut self, motion: &WheelMotion, landmarks: &[u64], bearings_rad: &[f64]) -> Result<CalibrationStep> {
        check(motion, landmarks, bearings_rad)?;
        let seen: Vec<(u64, f64)> = landmarks.iter().copied().zip(bearings_rad.iter().copied()).collect();
        let Outcome { nis, used, rejected, started, .. } = match &mut self.filter {
            Filter::Default(filter) => filter.step(motion, &seen),
            Filter::Paper(filter) => filter.step(motion, &seen),
        };
        if used > 0 {
            self.last_nis = Some(nis / used as f64);
        }
        Ok(CalibrationStep { nis, used, rejected, started })
    }

    /// Landmarks that are being followed.
    pub fn landmarks(&self) -> usize {
        match &self.filter {
            Filter::Default(filter) => filter.landmarks(),
            Filter::Paper(filter) => filter.landmarks(),
        }
    }

    /// The mounting as it is believed to be now.
    pub fn estimate(&self) -> MountingEstimate {
        let start = &self.options.start_covariance;
        match &self.filter {
            Filter::Default(filter) => {
                let (mounting, covariance) = filter.mounting();
                let nis = filter.alarm.mean_nis();
                MountingEstimate::new(Mounting::from_vector(&mounting), covariance, start, nis, filter.alarm.raised())
            }
            Filter::Paper(filter) => {
                let Some((polar, covariance)) = filter.mounting() else {
                    let nowhere = Mounting::from_vector(&Vector3::repeat(f64::NAN));
                    let infinite = Matrix3::from_diagonal_element(f64::INFINITY);
                    return MountingEstimate::new(nowhere, infinite, start, self.last_nis, true);
                };
                let mounting = Mounting::from_polar(polar.x, polar.y, polar.z);
                let j = Mounting { x_m: mounting.x_m, y_m: mounting.y_m, yaw_rad: 0.0 }.vector_by_polar();
                // A negative rho is the same place with phi turned by half.
                let xy = j * covariance * j.transpose();
                let mut estimate = MountingEstimate::new(mounting, xy, start, self.last_nis, false);
                if polar.y > 0.0 {
                    estimate.covariance_phi_rho_psi = covariance;
                }
                estimate
            }
        }
    }
}

/// Refuses a step that makes no sense.
pub(super) fn check(motion: &WheelMotion, landmarks: &[u64], bearings_rad: &[f64]) -> Result<()> {
    for (name, value) in [("delta_left_m", motion.left_m), ("delta_right_m", motion.right_m)] {
        if !value.is_finite() {
            return Err(Error::argument(name, value, "a finite number of metres"));
        }
    }
    if landmarks.len() != bearings_rad.len() {
        let got = format!("{} for {} landmarks", bearings_rad.len(), landmarks.len());
        return Err(Error::argument("bearings_rad", got, "one bearing for each landmark"));
    }
    for (i, bearing) in bearings_rad.iter().enumerate() {
        if !bearing.is_finite() {
            return Err(Error::argument("bearings_rad", format!("{bearing} at {i}"), "finite angles in radians"));
        }
        if landmarks[..i].contains(&landmarks[i]) {
            return Err(Error::argument("landmark_ids", format!("{} twice", landmarks[i]), "each landmark once"));
        }
    }
    Ok(())
}
