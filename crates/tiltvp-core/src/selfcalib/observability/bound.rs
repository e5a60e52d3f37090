//! The Cramer-Rao bound of a simulated drive: the least covariance of any unbiased estimate of the mounting.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::error::{Error, Result};
use crate::selfcalib::bundle::{
    BundleProblem, CholeskyFactor, FreeParameters, Keyframe, Observation, UNKNOWN_LOG_SIGMA,
};
use crate::selfcalib::model::{
    BearingLoss, InverseDistanceLandmark, MotionLoss, Mounting, RelativeMotion, WheelMotion, camera_position,
};
use crate::selfcalib::options::SelfCalibratorOptions;

/// The smallest covariance of (x, y, yaw) that an unbiased estimator can have if the places of the landmarks are unknown. The
/// information at the start is included.
///
/// `readings` are the wheels' displacements of each step, `poses` the true poses of the robot after each step (from a true
/// pose at the start of (0, 0, 0)), `landmarks_m` the true places, and `observations` the landmarks (as places in `landmarks_m`)
/// seen after each step. The noise is that of the options; the linearisation is at the truth.
///
/// # Errors
/// [`Error::InvalidOption`] for options that make no sense, [`Error::InvalidArgument`] for lengths that differ, landmarks
/// that do not exist, or a drive that leaves the information singular.
pub fn cramer_rao_bound(
    options: &SelfCalibratorOptions,
    mounting: &Mounting,
    readings: &[WheelMotion],
    poses: &[Vector3<f64>],
    landmarks_m: &[Vector2<f64>],
    observations: &[Vec<usize>],
) -> Result<Matrix3<f64>> {
    options.validate()?;
    if poses.len() != readings.len() || observations.len() != readings.len() {
        let got = format!("{} poses and {} lists of observations", poses.len(), observations.len());
        return Err(Error::argument("poses", got, format!("one of each for {} steps", readings.len())));
    }
    let truth = mounting.vector();
    // The information of a bearing depends on its residual only by the weight of a robust loss.
    let without_loss = BearingLoss::Huber(f64::INFINITY);
    let mut problem = BundleProblem::new(options, &truth, FreeParameters::default(), without_loss);
    problem.slip = MotionLoss::Quadratic;
    let mut slots = vec![None; landmarks_m.len()];
    for ((reading, pose), seen) in readings.iter().zip(poses).zip(observations) {
        let odometry = RelativeMotion::from_wheels(reading, &problem.wheels, &problem.noise);
        if reading.left_m != 0.0 || reading.right_m != 0.0 {
            let alone = problem.keyframes.len() == 1;
            match problem.keyframes.last_mut() {
                Some(last) if last.observations.is_empty() && !alone => last.extend(&odometry, *pose, 0.0),
                _ => problem.keyframes.push(Keyframe::after(odometry, *pose, 0.0)),
            }
        }
        for &landmark in seen {
            let Some(place) = landmarks_m.get(landmark) else {
                return Err(Error::argument("observations", landmark, format!("a place among {}", landmarks_m.len())));
            };
            let slot = slots[landmark].unwrap_or_else(|| {
                let anchor = camera_position(pose, &truth);
                let ray = place - anchor;
                let (direction, log_inverse_distance) = (ray.y.atan2(ray.x), -ray.norm().ln());
                let landmark = InverseDistanceLandmark { anchor, direction, log_inverse_distance };
                problem.add_landmark(landmark, log_inverse_distance, UNKNOWN_LOG_SIGMA)
            });
            slots[landmark] = Some(slot);
            if let Some(keyframe) = problem.keyframes.last_mut()
                && !keyframe.observations.iter().any(|seen| seen.landmark == slot)
            {
                keyframe.observations.push(Observation::new(slot, 0.0));
            }
        }
    }
    let last = problem.keyframes.len() - 1;
    let singular = || Error::argument("observations", "a drive that determines nothing", "bearings of landmarks");
    let system = problem.eliminate_poses(last, false, 0.0).ok_or_else(singular)?;
    let covariance = CholeskyFactor::regularised(&system.equations.information).ok_or_else(singular)?.inverse();
    Ok(covariance.fixed_view::<3, 3>(0, 0).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_falls_with_what_is_seen_and_needs_a_pose_and_sights_for_each_step() {
        let options = SelfCalibratorOptions::default();
        let mounting = Mounting { x_m: 0.1, y_m: -0.05, yaw_rad: 0.3 };
        // Around a circle of half a metre.
        let (steps, step_rad) = (40, 0.2);
        let (way_m, half) = (0.5 * step_rad, 0.5 * step_rad * options.wheel_base_m);
        let readings = vec![WheelMotion { left_m: way_m - half, right_m: way_m + half }; steps];
        let pose = |i: usize| {
            let heading = step_rad * (i + 1) as f64;
            Vector3::new(0.5 * heading.sin(), 0.5 * (1.0 - heading.cos()), heading)
        };
        let poses: Vec<_> = (0..steps).map(pose).collect();
        let landmarks = [[3.0, 1.0], [-2.0, 2.5], [0.5, -3.0], [-2.5, -1.5]].map(|[x, y]| Vector2::new(x, y));
        let bound = |seen: &[usize], poses: &[Vector3<f64>]| {
            let observations = vec![seen.to_vec(); steps];
            cramer_rao_bound(&options, &mounting, &readings, poses, &landmarks, &observations)
        };
        let (two, four) = (bound(&[0, 1], &poses).unwrap(), bound(&[0, 1, 2, 3], &poses).unwrap());
        assert!(four.cholesky().is_some() && (two - four).symmetric_eigenvalues().min() > 0.0, "{two} {four}");
        let said = |bound: Result<Matrix3<f64>>| bound.unwrap_err().to_string();
        assert!(said(bound(&[0], &poses[1..])).contains("39 poses and 40 lists"));
        assert!(said(bound(&[4], &poses)).contains("a place among 4"));
    }
}
