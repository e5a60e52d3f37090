//! How far motions between keyframes are from their odometry.

use nalgebra::{Matrix3, Vector3};

use super::problem::BundleProblem;
use crate::selfcalib::model::between;

/// What is between a motion and its odometry.
pub(crate) struct MotionResidual {
    /// The motion by the poses.
    pub(crate) motion: Vector3<f64>,
    /// The difference, in the frame of the keyframe before.
    pub(crate) off: Vector3<f64>,
    /// Where turns are compared as they are read: what makes that of a difference in radians, and how much this one grows with the logarithm
    /// of the wheel base.
    pub(crate) as_read: Option<(Matrix3<f64>, Vector3<f64>)>,
}

impl BundleProblem {
    /// What is between the motion to a keyframe and its odometry.
    ///
    /// Where turns are compared as they are read, it is in units of the told wheel base over the free one. Wheels read `base turn + noise`:
    /// in radians, `turn - reading / base`, the noise would count less the longer the base.
    pub(crate) fn motion_residual(&self, to: usize) -> MotionResidual {
        let (before, after) = (&self.keyframes[to - 1], &self.keyframes[to]);
        let motion = between(&before.pose, &after.pose);
        let off = motion - after.odometry.motion;
        if !self.free.wheels || !self.turns_as_read {
            return MotionResidual { motion, off, as_read: None };
        }
        // A chord turns by half of its arc.
        let by_turn = Vector3::new(-0.5 * motion.y, 0.5 * motion.x, 1.0);
        let base = self.wheels.base_m / self.prior_mean[4].exp();
        let mut reading = Matrix3::identity();
        reading.column_mut(2).axpy(base - 1.0, &by_turn, 1.0);
        MotionResidual { motion, off: reading * off, as_read: Some((reading, by_turn * (base * off.z))) }
    }

    /// What the motion to a keyframe adds to the cost.
    pub(crate) fn motion_cost(&self, to: usize) -> f64 {
        self.slip.cost(self.motion_misfit(to))
    }

    /// Whether there is a motion whose wheels must have slipped.
    pub(crate) fn any_slipped(&self) -> bool {
        (1..self.keyframes.len()).any(|to| self.slipped(to))
    }

    /// Whether the motion to a keyframe differs so much from its odometry that the wheels must have slipped.
    pub(crate) fn slipped(&self, to: usize) -> bool {
        self.slip.weight(self.motion_misfit(to)) < 1.0
    }

    /// The squared Mahalanobis distance of the motion to a keyframe from its odometry.
    fn motion_misfit(&self, to: usize) -> f64 {
        let r = self.motion_residual(to).off;
        r.dot(&(self.keyframes[to].information * r))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::bundle::linearisation::NormalEquations;
    use crate::selfcalib::bundle::{FreeParameters, Keyframe};
    use crate::selfcalib::model::{BearingLoss, MotionLoss, RelativeMotion, WheelMotion};
    use crate::selfcalib::options::SelfCalibratorOptions;

    #[test]
    fn the_cost_of_a_motion_falls_by_the_wheels_as_the_normal_equations_say() {
        let free = FreeParameters { wheels: true, ..FreeParameters::default() };
        let options = SelfCalibratorOptions::default();
        let mut problem = BundleProblem::new(&options, &Vector3::zeros(), free, BearingLoss::Huber(2.0));
        problem.slip = MotionLoss::Quadratic;
        let reading = WheelMotion { left_m: 0.3, right_m: 0.42 };
        let odometry = RelativeMotion::from_wheels(&reading, &problem.wheels, &problem.noise);
        let pose = odometry.motion + Vector3::new(0.001, 0.0005, 0.01);
        let keyframe = Keyframe::after(odometry, pose, 1.0);
        problem.keyframes.push(Keyframe { readings: vec![reading], ..keyframe });
        let mut here = problem.shared();
        (here[3], here[4]) = (0.01, here[4] + 0.05);
        for turns_as_read in [false, true] {
            problem.turns_as_read = turns_as_read;
            problem.set_shared(&here);
            let mut equations = NormalEquations::zeros(problem.width());
            problem.motion_blocks(0, &mut equations);
            for k in [3, 4] {
                let cost_at = |step: f64| {
                    let (mut other, mut there) = (problem.clone(), here.clone());
                    there[k] += step;
                    other.set_shared(&there);
                    other.motion_cost(1)
                };
                let slope = (cost_at(1e-6) - cost_at(-1e-6)) / 2e-6;
                assert!((slope + equations.rhs[k]).abs() < 1e-5 * slope.abs(), "{k}: {slope}, {}", equations.rhs[k]);
            }
        }
    }
}
