//! `SelfCalibrator`: the mounting of a camera, step by step while the robot drives.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Vector3};

use super::estimate::MountingEstimate;
use super::model::{MOST_LANDMARKS, Mounting, WheelMotion};
use super::options::{CalibrationMethod, SelfCalibratorOptions};
use super::paper::PaperFilter;
use super::step_outcome::StepOutcome;
use super::window::{InnovationMonitor, SlidingWindow};
use crate::error::{Error, Result};

/// What the calibrator did in a step.
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
    SlidingWindow(Box<SlidingWindow>),
    Paper(Box<PaperFilter>, InnovationMonitor),
}

/// Estimates where the camera sits on the robot from wheel displacements and bearings of identified landmarks.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SelfCalibrator {
    options: SelfCalibratorOptions,
    filter: Filter,
}

impl SelfCalibrator {
    /// A filter that has seen nothing.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] from [`SelfCalibratorOptions::validate`].
    pub fn new(options: SelfCalibratorOptions) -> Result<Self> {
        options.validate()?;
        let filter = match options.method {
            CalibrationMethod::Default => Filter::SlidingWindow(Box::new(SlidingWindow::new(&options)?)),
            CalibrationMethod::Paper => {
                Filter::Paper(Box::new(PaperFilter::new(&options)), InnovationMonitor::default())
            }
        };
        Ok(Self { options, filter })
    }

    /// The options in force.
    pub fn options(&self) -> &SelfCalibratorOptions {
        &self.options
    }

    /// Whether all parts of the state fit together, as they do unless the state came from bytes that were tampered with.
    pub fn is_well_formed(&self) -> bool {
        self.options.validate().is_ok()
            && match &self.filter {
                Filter::SlidingWindow(filter) => filter.is_well_formed(),
                Filter::Paper(filter, _) => filter.is_well_formed(),
            }
    }

    /// Forgets everything but the options.
    ///
    /// # Errors
    /// Those of [`new`](Self::new), which accepted the same options.
    pub fn reset(&mut self) -> Result<()> {
        *self = Self::new(self.options)?;
        Ok(())
    }

    /// Moves by the displacements of the wheels, then takes bearings: radians in the camera's frame, counter-clockwise, each with
    /// the identifier of its landmark.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for numbers that are not finite, counts that differ, landmarks seen twice, and more than
    /// [`MOST_LANDMARKS`]; the filter is then as before.
    pub fn step(&mut self, motion: &WheelMotion, landmarks: &[u64], bearings_rad: &[f64]) -> Result<CalibrationStep> {
        self.check_room(landmarks)?;
        check(motion, landmarks, bearings_rad)?;
        let seen: Vec<(u64, f64)> = landmarks.iter().copied().zip(bearings_rad.iter().copied()).collect();
        let StepOutcome { nis, used, rejected, started, .. } = match &mut self.filter {
            Filter::SlidingWindow(filter) => filter.step(motion, &seen),
            Filter::Paper(filter, monitor) => {
                let outcome = filter.step(motion, &seen);
                // Without a gate no bearing is rejected, which is what its limit would be for.
                monitor.record(&outcome, 0.0);
                outcome
            }
        };
        Ok(CalibrationStep { nis, used, rejected, started })
    }

    /// Looks for what the drive so far contradicts, which assumption is likely wrong, and how far motions that err together may have moved
    /// the answer; estimates then say so. It costs some twenty solutions of the window.
    pub fn examine(&mut self) {
        if let Filter::SlidingWindow(filter) = &mut self.filter {
            filter.examine();
        }
    }

    /// The number of landmarks that are followed.
    pub fn landmarks(&self) -> usize {
        match &self.filter {
            Filter::SlidingWindow(filter) => filter.landmarks(),
            Filter::Paper(filter, _) => filter.landmarks(),
        }
    }

    /// Refuses more landmarks than there is room for beside those that are followed.
    fn check_room(&self, landmarks: &[u64]) -> Result<()> {
        if self.landmarks() + landmarks.len() <= MOST_LANDMARKS {
            return Ok(());
        }
        let followed: BTreeSet<u64> = match &self.filter {
            Filter::SlidingWindow(filter) => filter.followed().collect(),
            Filter::Paper(filter, _) => filter.followed().collect(),
        };
        let new = landmarks.iter().filter(|id| !followed.contains(id)).count();
        if followed.len() + new > MOST_LANDMARKS {
            let got = format!("{new} landmarks beside {} that are followed", followed.len());
            return Err(Error::argument("landmark_ids", got, format!("at most {MOST_LANDMARKS} in all")));
        }
        Ok(())
    }

    /// The mounting as it is known now.
    pub fn estimate(&self) -> MountingEstimate {
        let start = &self.options.start_covariance;
        match &self.filter {
            Filter::SlidingWindow(filter) => {
                let ((mounting, covariance), examination) = (filter.mounting(), filter.examination());
                let nis = filter.monitor().mean_nis();
                MountingEstimate::new(
                    Mounting::from_vector(&mounting),
                    covariance,
                    start,
                    nis,
                    filter.monitor().alarmed(),
                )
                .judged(examination.contradictions, examination.suspect)
                .doubting(examination.doubted_of_camera.first(), || filter.covariance_as_told(), start)
            }
            Filter::Paper(filter, monitor) => {
                let nis = monitor.mean_nis();
                let Some((polar, covariance)) = filter.mounting() else {
                    let nowhere = Mounting::from_vector(&Vector3::repeat(f64::NAN));
                    let infinite = Matrix3::from_diagonal_element(f64::INFINITY);
                    return MountingEstimate::new(nowhere, infinite, start, nis, true);
                };
                let mounting = Mounting::from_polar(polar.x, polar.y, polar.z);
                let xy = vector_covariance(&polar, &covariance);
                MountingEstimate::new(mounting, xy, start, nis, monitor.alarmed())
            }
        }
    }
}

/// The covariance of (x, y, yaw) from that of (phi, rho, psi). A filter may go through rho = 0: a negative rho is the same place as
/// a positive one with phi turned by pi.
fn vector_covariance(polar: &Vector3<f64>, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let mut jacobian = Mounting::from_polar(polar.x, polar.y, polar.z).vector_by_polar();
    if polar.y < 0.0 {
        jacobian.column_mut(1).neg_mut();
    }
    jacobian * covariance * jacobian.transpose()
}

/// Refuses a step that makes no sense.
fn check(motion: &WheelMotion, landmarks: &[u64], bearings_rad: &[f64]) -> Result<()> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_landmarks_are_followed_than_there_is_room_for() {
        let most = MOST_LANDMARKS as u64;
        let mut calibrator = SelfCalibrator::new(SelfCalibratorOptions::default()).unwrap();
        let mut look = |ids: std::ops::Range<u64>| {
            let ids: Vec<u64> = ids.collect();
            calibrator.step(&WheelMotion::default(), &ids, &vec![0.0; ids.len()]).map(|_| calibrator.landmarks())
        };
        assert!(look(0..most + 1).is_err());
        assert_eq!(look(0..most), Ok(MOST_LANDMARKS));
        // Those that are followed already take no room, those beside them do.
        assert!(look(0..3).is_ok());
        assert!(look(most - 1..most + 1).is_err() && look(most..most + 1).is_err());
    }

    #[test]
    fn covariances_go_through_the_axle() {
        let covariance = Matrix3::new(4e-4, 1e-4, -2e-4, 1e-4, 9e-4, 1e-4, -2e-4, 1e-4, 5e-4);
        for rho_m in [0.3, -0.3] {
            let polar = Vector3::new(0.7, rho_m, 0.2);
            let at = |polar: &Vector3<f64>| Mounting::from_polar(polar.x, polar.y, polar.z).vector();
            let by = |axis: usize| {
                (at(&(polar + Vector3::ith(axis, 1e-6))) - at(&(polar - Vector3::ith(axis, 1e-6)))) / 2e-6
            };
            let jacobian = Matrix3::from_columns(&[by(0), by(1), by(2)]);
            let expected = jacobian * covariance * jacobian.transpose();
            assert!((vector_covariance(&polar, &covariance) - expected).amax() < 1e-9, "{rho_m}");
        }
    }

    fn of_the_paper() -> SelfCalibrator {
        let options = SelfCalibratorOptions { method: CalibrationMethod::Paper, ..SelfCalibratorOptions::default() };
        let start = Mounting { x_m: 0.2, y_m: 0.0, yaw_rad: 0.0 };
        SelfCalibrator::new(SelfCalibratorOptions { start, ..options }).unwrap()
    }

    /// Of a robot that drives on, past landmarks that fall behind as they should, or that go ahead.
    #[test]
    fn the_papers_filter_is_alarmed_by_bearings_that_contradict_it() {
        for (sense, alarmed) in [(1.0, false), (-1.0, true)] {
            let mut calibrator = of_the_paper();
            for step in 0..40 {
                let bearing = |side: f64, far_m: f64| side * far_m.atan2(2.0 - sense * 0.1 * f64::from(step));
                let bearings_rad = [bearing(1.0, 2.0), bearing(-1.0, 3.0), bearing(1.0, 4.0)];
                calibrator.step(&WheelMotion { left_m: 0.1, right_m: 0.1 }, &[0, 1, 2], &bearings_rad).unwrap();
            }
            let estimate = calibrator.estimate();
            assert_eq!(estimate.alarm, alarmed, "{sense}: {:?}", estimate.mean_nis);
        }
    }

    #[test]
    fn the_papers_filter_tells_the_last_innovations_that_there_were() {
        let mut calibrator = of_the_paper();
        let ahead = WheelMotion { left_m: 0.1, right_m: 0.1 };
        let mut step = |bearings_rad: &[f64]| {
            let landmarks: Vec<u64> = (0..bearings_rad.len() as u64).collect();
            let step = calibrator.step(&ahead, &landmarks, bearings_rad).unwrap();
            (step, calibrator.estimate().mean_nis)
        };
        assert_eq!(step(&[0.5, -0.8]).1, None);
        let (second, nis) = step(&[0.52, -0.82]);
        assert!(second.used == 2 && second.nis > 0.0);
        assert_eq!(nis, Some(second.nis / 2.0));
        // A step that sees nothing has none of its own.
        let (third, nis) = step(&[]);
        assert_eq!((third.used, nis), (0, Some(second.nis / 2.0)));
    }
}
