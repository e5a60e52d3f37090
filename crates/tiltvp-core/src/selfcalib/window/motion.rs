//! The prediction step: odometry moves the pose, and makes or extends the last keyframe.

use nalgebra::{Matrix3, Vector3};

use super::state::SlidingWindow;
use crate::selfcalib::bundle::Keyframe;
use crate::selfcalib::model::{RelativeMotion, WheelMotion, compose, compose_jacobians};

/// What is told of a time offset counts in steps: their times are not known here.
const STEP: f64 = 1.0;

impl SlidingWindow {
    /// Moves by the odometry of a step; nothing happens at a standstill, until what it tells adds up to a motion.
    pub(super) fn predict(&mut self, motion: &WheelMotion) {
        self.motion_noise = Matrix3::zeros();
        self.standing += *motion;
        if self.standing.is_tremor(self.problem.wheels.base_m, self.problem.bearing_sigma) {
            return;
        }
        let motion = std::mem::take(&mut self.standing);
        let odometry = RelativeMotion::from_wheels(&motion, &self.problem.wheels, &self.problem.noise);
        let keyframes = &mut self.problem.keyframes;
        let alone = keyframes.len() == 1;
        let Some(last) = keyframes.last_mut() else { return };
        let pose = compose(&last.pose, &odometry.motion);
        if alone || !last.observations.is_empty() {
            keyframes.push(Keyframe::after(odometry, pose, STEP));
        } else {
            last.extend(&odometry, pose, STEP);
        }
        let before = self.pose();
        self.mean.fixed_rows_mut::<3>(0).copy_from(&compose(&before, &odometry.motion));
        let (first, second) = compose_jacobians(&before, &odometry.motion);
        let noise = second * odometry.covariance * second.transpose();
        let n = self.covariance.nrows();
        for c in 0..n {
            let column: Vector3<f64> = self.covariance.fixed_view::<3, 1>(0, c).into();
            self.covariance.fixed_view_mut::<3, 1>(0, c).copy_from(&(first * column));
        }
        let own: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(0, 0).into();
        let own = own * first.transpose() + noise;
        self.motion_noise = noise;
        self.covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&(0.5 * (own + own.transpose())));
        for c in 3..n {
            for r in 0..3 {
                self.covariance[(c, r)] = self.covariance[(r, c)];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::SelfCalibratorOptions;

    #[test]
    fn wheels_that_tremble_make_no_keyframes_and_what_they_creep_is_not_lost() {
        let options = SelfCalibratorOptions { wheel_base_m: 0.4, ..SelfCalibratorOptions::default() };
        let mut filter = SlidingWindow::new(&options).unwrap();
        let step = |left_m: f64, right_m: f64| WheelMotion { left_m, right_m };
        filter.step(&step(0.05, 0.06), &[(1, 0.3), (2, 1.2)]);
        let (keyframes, pose, covariance) = (filter.problem.keyframes.len(), filter.pose(), filter.covariance.clone());
        for k in 0..1000 {
            let to_and_fro = if k % 2 == 0 { 1e-4 } else { -1e-4 };
            filter.step(&step(to_and_fro, -to_and_fro), &[(1, 0.3), (2, 1.2)]);
        }
        assert_eq!((filter.problem.keyframes.len(), filter.pose()), (keyframes, pose));
        assert_eq!(filter.covariance, covariance);
        // A millimetre in tenths is two motions.
        for _ in 0..10 {
            filter.step(&step(1e-4, 1e-4), &[(1, 0.3), (2, 1.2)]);
        }
        assert_eq!(filter.problem.keyframes.len(), keyframes + 2);
        let moved = (filter.pose() - pose).fixed_rows::<2>(0).norm();
        assert!((moved - 1e-3).abs() < 2e-4, "{moved}");
    }
}
