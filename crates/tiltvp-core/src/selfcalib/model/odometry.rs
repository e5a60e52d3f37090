//! From the displacements of two wheels to the motion of the robot, with its covariance (eqs. 14, 15 and 31).

use std::ops::AddAssign;

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};

use super::planar_pose::{compose, compose_jacobians};

/// How far a wheel of a robot that stands seems to move at most, metres, and by how many standard deviations of a bearing the robot seems to
/// turn: a tick or two of an encoder. Each motion makes a keyframe, in which the bearings of all landmarks count anew, though at a
/// standstill their errors are the same: with 0.1 mm to and fro the filter was wrong and sure after a minute.
const TREMOR_M: f64 = 5e-4;
const TREMOR_SIGMAS: f64 = 0.5;

/// The longest distance between two wheels: twice the longest half track of a tilt filter. What is beyond is millimetres.
pub const WHEEL_BASE_MAX_M: f64 = 200.0;

/// The displacements of the wheels in one step, metres, forward positive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WheelMotion {
    /// Of the left wheel.
    pub left_m: f64,
    /// Of the right wheel.
    pub right_m: f64,
}

impl WheelMotion {
    /// The displacements of wheels `wheel_base_m` apart that drive so far and turn by so much to the left (eq. 15).
    pub fn from_motion(distance_m: f64, turn_rad: f64, wheel_base_m: f64) -> Self {
        let half = 0.5 * turn_rad * wheel_base_m;
        Self { left_m: distance_m - half, right_m: distance_m + half }
    }

    /// How far the middle of the axle moves (eq. 15).
    pub fn distance_m(&self) -> f64 {
        0.5 * (self.right_m + self.left_m)
    }

    /// How far the robot turns to the left (eq. 15).
    pub fn turn_rad(&self, wheel_base_m: f64) -> f64 {
        (self.right_m - self.left_m) / wheel_base_m
    }

    /// Whether it is no more than encoders, and poses that are fused of several sensors, tremble by where the robot stands.
    pub(crate) fn is_tremor(&self, wheel_base_m: f64, bearing_sigma_rad: f64) -> bool {
        let turn_rad = self.turn_rad(wheel_base_m);
        (self.left_m == 0.0 && self.right_m == 0.0)
            || self.largest_m() < TREMOR_M && turn_rad.abs() < TREMOR_SIGMAS * bearing_sigma_rad
    }

    /// How far the wheel that moves farther moves.
    pub(crate) fn largest_m(&self) -> f64 {
        self.left_m.abs().max(self.right_m.abs())
    }

    /// The covariance of (right, left) by Chong and Kleeman (eq. 31): variances `k |displacement|`, `k` in metres.
    pub fn covariance(&self, k_m: f64) -> Matrix2<f64> {
        Matrix2::from_diagonal(&Vector2::new(k_m * self.right_m.abs(), k_m * self.left_m.abs()))
    }
}

impl AddAssign for WheelMotion {
    fn add_assign(&mut self, next: Self) {
        self.left_m += next.left_m;
        self.right_m += next.right_m;
    }
}

/// The calibration of the wheels: the ratio of their radii and the distance between them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wheels {
    /// Half the logarithm of the ratio of the right wheel's true displacement to the left's, given equal readings.
    pub imbalance: f64,
    /// Distance between the wheels, metres.
    pub base_m: f64,
}

impl Wheels {
    /// Wheels whose readings are right.
    pub fn new(base_m: f64) -> Self {
        Self { imbalance: 0.0, base_m }
    }

    /// The true displacements of readings: right times `exp(imbalance)`, left times `exp(-imbalance)`.
    pub fn corrected(&self, motion: &WheelMotion) -> WheelMotion {
        let factor = self.imbalance.exp();
        WheelMotion { left_m: motion.left_m / factor, right_m: motion.right_m * factor }
    }
}

/// The noise of a step's motion, as the wheels measure it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotionNoise {
    /// Variance of a wheel's displacement for each metre of it (eq. 31), metres.
    pub k_m: f64,
    /// Standard deviation of a step in either direction, whatever its length, metres.
    pub step_sigma_m: f64,
    /// Standard deviation of the turn of a step, whatever its size, radians.
    pub step_sigma_rad: f64,
}

impl MotionNoise {
    /// The noise of eq. 31 alone.
    pub fn new(k_m: f64) -> Self {
        Self { k_m, step_sigma_m: 0.0, step_sigma_rad: 0.0 }
    }
}

/// Variance of the motion along the axle as a share of the variance of the distance. Wheels do not measure that motion; the
/// share keeps the covariance regular, at a tenth of the forward standard deviation.
const SIDEWAYS_SHARE: f64 = 0.01;

/// A relative motion: in the robot's frame at its start, with covariance and Jacobian by the wheels' calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RelativeMotion {
    /// The pose at the end: (x, y, heading), metres and radians.
    pub motion: Vector3<f64>,
    /// Its covariance.
    pub covariance: Matrix3<f64>,
    /// Its Jacobian by the imbalance and by the logarithm of the wheel base.
    pub by_wheels: Matrix3x2<f64>,
}

impl RelativeMotion {
    /// No motion.
    pub fn none() -> Self {
        Self { motion: Vector3::zeros(), covariance: Matrix3::zeros(), by_wheels: Matrix3x2::zeros() }
    }

    /// The motion along an arc that the wheels measured, with the noise of eq. 31 and of a step.
    ///
    /// With `d = (right + left) / 2` and `t = (right - left) / base` the chord is `d sin(t/2) / (t/2)` in the direction
    /// `t / 2`; eq. 14 takes `d` for it.
    pub fn from_wheels(readings: &WheelMotion, wheels: &Wheels, noise: &MotionNoise) -> Self {
        let true_motion = wheels.corrected(readings);
        let (d, t) = (true_motion.distance_m(), true_motion.turn_rad(wheels.base_m));
        let (sin, cos) = (0.5 * t).sin_cos();
        let (s, slope) = sinc(0.5 * t);
        let motion = Vector3::new(d * s * cos, d * s * sin, t);
        // By distance and by turn.
        let by_distance = Vector3::new(s * cos, s * sin, 0.0);
        let by_turn = Vector3::new(0.5 * d * (slope * cos - s * sin), 0.5 * d * (slope * sin + s * cos), 1.0);
        let (by_right, by_left) =
            (0.5 * by_distance + by_turn / wheels.base_m, 0.5 * by_distance - by_turn / wheels.base_m);
        let step = noise.step_sigma_m * noise.step_sigma_m;
        let step = Vector3::new(step, step, noise.step_sigma_rad * noise.step_sigma_rad);
        let noise = true_motion.covariance(noise.k_m);
        let sideways = Vector3::new(-sin, cos, 0.0);
        let covariance = by_right * by_right.transpose() * noise[(0, 0)]
            + by_left * by_left.transpose() * noise[(1, 1)]
            + sideways * sideways.transpose() * (SIDEWAYS_SHARE * 0.25 * noise.trace())
            + Matrix3::from_diagonal(&step);
        let by_imbalance = by_right * true_motion.right_m - by_left * true_motion.left_m;
        Self { motion, covariance, by_wheels: Matrix3x2::from_columns(&[by_imbalance, by_turn * -t]) }
    }

    /// This motion followed by another.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let (first, second) = compose_jacobians(&self.motion, &next.motion);
        Self {
            motion: compose(&self.motion, &next.motion),
            covariance: first * self.covariance * first.transpose() + second * next.covariance * second.transpose(),
            by_wheels: first * self.by_wheels + second * next.by_wheels,
        }
    }
}

/// `sin(x) / x` and its derivative.
fn sinc(x: f64) -> (f64, f64) {
    if x.abs() < 1e-4 { (1.0 - x * x / 6.0, -x / 3.0) } else { (x.sin() / x, (x.cos() - x.sin() / x) / x) }
}

/// The relative motion of several readings in a row (preintegration).
pub(crate) fn preintegrate(readings: &[WheelMotion], wheels: &Wheels, noise: &MotionNoise) -> RelativeMotion {
    let first = RelativeMotion::none();
    readings.iter().fold(first, |motion, reading| motion.then(&RelativeMotion::from_wheels(reading, wheels, noise)))
}

/// Variance added to a motion before it is inverted: a micrometre and a microradian, far below any wheel's noise. It only
/// keeps a motion without noise from being singular.
const LEAST_VARIANCE: f64 = 1e-12;

/// The inverse of a motion's covariance.
pub(crate) fn information(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let least = Vector3::new(LEAST_VARIANCE, LEAST_VARIANCE, LEAST_VARIANCE);
    (covariance + Matrix3::from_diagonal(&least)).try_inverse().unwrap_or_else(Matrix3::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn motion(left_m: f64, right_m: f64, wheels: &Wheels) -> RelativeMotion {
        RelativeMotion::from_wheels(&WheelMotion { left_m, right_m }, wheels, &MotionNoise::new(1e-5))
    }

    proptest! {
        #[test]
        fn an_arc_is_two_halves(left in -0.5..0.5f64, right in -0.5..0.5f64) {
            let wheels = Wheels::new(0.4);
            let (whole, half) = (motion(left, right, &wheels), motion(0.5 * left, 0.5 * right, &wheels));
            let twice = half.then(&half);
            prop_assert!((whole.motion - twice.motion).amax() < 1e-12);
            prop_assert!((whole.by_wheels - twice.by_wheels).amax() < 1e-9);
            prop_assert!((whole.covariance[(2, 2)] - twice.covariance[(2, 2)]).abs() < 1e-12);
        }

        #[test]
        fn jacobians_are_those_of_central_differences(left in -0.5..0.5f64, right in -0.5..0.5f64, i in -0.1..0.1f64) {
            let wheels = Wheels { imbalance: i, base_m: 0.4 };
            let h = 1e-6;
            let by = |more: Wheels, less: Wheels| (motion(left, right, &more).motion - motion(left, right, &less).motion) / (2.0 * h);
            let imbalance = by(Wheels { imbalance: i + h, ..wheels }, Wheels { imbalance: i - h, ..wheels });
            let base = by(Wheels { base_m: 0.4 * h.exp(), ..wheels }, Wheels { base_m: 0.4 * (-h).exp(), ..wheels });
            prop_assert!((motion(left, right, &wheels).by_wheels - Matrix3x2::from_columns(&[imbalance, base])).amax() < 1e-8);
        }
    }

    #[test]
    fn wheels_and_motion() {
        let motion = WheelMotion::from_motion(0.3, 0.2, 0.4);
        assert!((motion.distance_m() - 0.3).abs() < 1e-15 && (motion.turn_rad(0.4) - 0.2).abs() < 1e-15);
    }
}
