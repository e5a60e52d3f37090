//! From the displacements of two wheels to the motion of the robot, with its covariance (eqs. 14, 15 and 31).

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};

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

    /// The covariance of (right, left) by Chong and Kleeman (eq. 31): variances `k |displacement|`, `k` in metres.
    pub fn covariance(&self, k_m: f64) -> Matrix2<f64> {
        Matrix2::from_diagonal(&Vector2::new(k_m * self.right_m.abs(), k_m * self.left_m.abs()))
    }
}

/// Two numbers that wheels may have wrong: which of them runs farther, and how far apart they are.
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

/// How far the motion of a step may be from what the wheels tell.
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
    /// That of eq. 31 alone.
    pub fn new(k_m: f64) -> Self {
        Self { k_m, step_sigma_m: 0.0, step_sigma_rad: 0.0 }
    }
}

/// Share of the distance's variance that is given to motion along the axle, which wheels do not report.
const SIDEWAYS_SHARE: f64 = 0.01;

/// A motion of the robot in its frame at the start of it, its covariance, and its Jacobian by the wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Leg {
    /// Where the robot ends: (x, y, heading), metres and radians.
    pub motion: Vector3<f64>,
    /// Covariance of it.
    pub covariance: Matrix3<f64>,
    /// Its derivative by the imbalance and by the logarithm of the wheel base.
    pub by_wheels: Matrix3x2<f64>,
}

impl Leg {
    /// No motion.
    pub fn none() -> Self {
        Self { motion: Vector3::zeros(), covariance: Matrix3::zeros(), by_wheels: Matrix3x2::zeros() }
    }

    /// The motion along an arc that wheel readings tell, with the noise of eq. 31 and that of a step.
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

    /// This motion, then another.
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

/// The pose `a` and from there the pose `b`; headings are not wrapped.
pub(super) fn compose(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let (sin, cos) = a.z.sin_cos();
    Vector3::new(a.x + cos * b.x - sin * b.y, a.y + sin * b.x + cos * b.y, a.z + b.z)
}

/// The pose `b` as seen from the pose `a`.
pub(super) fn between(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let (sin, cos) = a.z.sin_cos();
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    Vector3::new(cos * dx + sin * dy, cos * dy - sin * dx, b.z - a.z)
}

/// The Jacobians of [`compose`] by its arguments.
pub(super) fn compose_jacobians(a: &Vector3<f64>, b: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let (sin, cos) = a.z.sin_cos();
    let first = Matrix3::new(1.0, 0.0, -sin * b.x - cos * b.y, 0.0, 1.0, cos * b.x - sin * b.y, 0.0, 0.0, 1.0);
    (first, Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn leg(left_m: f64, right_m: f64, wheels: &Wheels) -> Leg {
        Leg::from_wheels(&WheelMotion { left_m, right_m }, wheels, &MotionNoise::new(1e-5))
    }

    proptest! {
        #[test]
        fn an_arc_is_two_halves(left in -0.5..0.5f64, right in -0.5..0.5f64) {
            let wheels = Wheels::new(0.4);
            let (whole, half) = (leg(left, right, &wheels), leg(0.5 * left, 0.5 * right, &wheels));
            let twice = half.then(&half);
            prop_assert!((whole.motion - twice.motion).amax() < 1e-12);
            prop_assert!((whole.by_wheels - twice.by_wheels).amax() < 1e-9);
            prop_assert!((whole.covariance[(2, 2)] - twice.covariance[(2, 2)]).abs() < 1e-12);
        }

        #[test]
        fn jacobians_are_those_of_central_differences(left in -0.5..0.5f64, right in -0.5..0.5f64, i in -0.1..0.1f64) {
            let wheels = Wheels { imbalance: i, base_m: 0.4 };
            let h = 1e-6;
            let by = |more: Wheels, less: Wheels| (leg(left, right, &more).motion - leg(left, right, &less).motion) / (2.0 * h);
            let imbalance = by(Wheels { imbalance: i + h, ..wheels }, Wheels { imbalance: i - h, ..wheels });
            let base = by(Wheels { base_m: 0.4 * h.exp(), ..wheels }, Wheels { base_m: 0.4 * (-h).exp(), ..wheels });
            prop_assert!((leg(left, right, &wheels).by_wheels - Matrix3x2::from_columns(&[imbalance, base])).amax() < 1e-8);
        }

        #[test]
        fn composing_and_its_jacobians(a in prop::array::uniform3(-2.0..2.0f64), b in prop::array::uniform3(-2.0..2.0f64)) {
            let (a, b) = (Vector3::from(a), Vector3::from(b));
            prop_assert!((between(&a, &compose(&a, &b)) - b).amax() < 1e-12);
            let (first, second) = compose_jacobians(&a, &b);
            for axis in 0..3 {
                let mut d = Vector3::zeros();
                d[axis] = 1e-6;
                prop_assert!(((compose(&(a + d), &b) - compose(&(a - d), &b)) / 2e-6 - first.column(axis)).amax() < 1e-8);
                prop_assert!(((compose(&a, &(b + d)) - compose(&a, &(b - d))) / 2e-6 - second.column(axis)).amax() < 1e-8);
            }
        }
    }

    #[test]
    fn wheels_and_motion() {
        let motion = WheelMotion::from_motion(0.3, 0.2, 0.4);
        assert!((motion.distance_m() - 0.3).abs() < 1e-15 && (motion.turn_rad(0.4) - 0.2).abs() < 1e-15);
    }
}
