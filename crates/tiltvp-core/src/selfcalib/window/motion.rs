//! The prediction step: odometry moves the pose, and makes or extends the last keyframe.

use nalgebra::{Matrix3, Vector3};

use super::state::SlidingWindow;
use crate::selfcalib::bundle::Keyframe;
use crate::selfcalib::model::{RelativeMotion, WheelMotion, compose, compose_jacobians};

/// What is told of a time offset counts in steps: their times are not known here.
const STEP: f64 = 1.0;

impl SlidingWindow {
    /// Moves by the odometry of a step; nothing happens at a standstill.
    pub(super) fn predict(&mut self, motion: &WheelMotion) {
        self.motion_noise = Matrix3::zeros();
        if motion.left_m == 0.0 && motion.right_m == 0.0 {
            return;
        }
        let odometry = RelativeMotion::from_wheels(motion, &self.problem.wheels, &self.problem.noise);
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
