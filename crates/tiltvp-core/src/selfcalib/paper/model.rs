//! The models of Scaramuzza, Siegwart and Martinelli (2009): dynamics (26), observation (27), and the Jacobians of appendix A.4.

use nalgebra::{Matrix2, RowVector2, RowVector3, Vector3};

use crate::geometry::wrap_angle;
use crate::selfcalib::model::{Mounting, WheelMotion};

/// A feature in polar coordinates: `D`, the distance of the robot from it, and `theta`, the robot's heading against the
/// direction from the feature to the robot (eq. 19).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Feature {
    /// `D`, metres.
    pub distance_m: f64,
    /// `theta`, radians.
    pub theta_rad: f64,
}

/// The dynamics of one feature, eq. 26.
pub fn dynamics(feature: &Feature, motion: &WheelMotion, wheel_base_m: f64) -> Feature {
    let (d, t) = (motion.distance_m(), motion.turn_rad(wheel_base_m));
    Feature {
        distance_m: feature.distance_m + d * feature.theta_rad.cos(),
        theta_rad: feature.theta_rad + t - d / feature.distance_m * feature.theta_rad.sin(),
    }
}

/// The Jacobians `A` by (D, theta) and `B` by (right, left) of [`dynamics`], eq. 32.
pub fn dynamics_jacobians(feature: &Feature, motion: &WheelMotion, wheel_base_m: f64) -> (Matrix2<f64>, Matrix2<f64>) {
    let (d, distance) = (motion.distance_m(), feature.distance_m);
    let (sin, cos) = feature.theta_rad.sin_cos();
    let a = Matrix2::new(1.0, -d * sin, d / (distance * distance) * sin, 1.0 - d / distance * cos);
    let (half, e) = (0.5 * sin / distance, 1.0 / wheel_base_m);
    (a, Matrix2::new(0.5 * cos, 0.5 * cos, e - half, -e - half))
}

/// The bearing of a feature, eq. 27, in (-pi, pi], with the mounting as (phi, rho, psi).
pub fn observation(feature: &Feature, mounting: &Vector3<f64>) -> f64 {
    let (phi, rho, psi) = (mounting.x, mounting.y, mounting.z);
    let gamma = feature.theta_rad + phi;
    let alpha = (-rho * gamma.sin()).atan2(-feature.distance_m - rho * gamma.cos());
    wrap_angle(alpha - gamma - psi)
}

/// The Jacobians of [`observation`]: (H1, H2) by (D, theta) and (H3, H4, -1) by (phi, rho, psi), appendix A.4.
pub fn observation_jacobians(feature: &Feature, mounting: &Vector3<f64>) -> (RowVector2<f64>, RowVector3<f64>) {
    let (d, rho) = (feature.distance_m, mounting.y);
    let (sin, cos) = (feature.theta_rad + mounting.x).sin_cos();
    let scale = 1.0 / (d * d + 2.0 * rho * d * cos + rho * rho);
    let turn = (-d * rho * cos - d * d) * scale;
    (RowVector2::new(-rho * sin * scale, turn), RowVector3::new(turn, d * sin * scale, -1.0))
}

/// The `theta` at which a feature at distance `D` is seen at this bearing.
pub(super) fn theta_of(distance: f64, bearing: f64, mounting: &Vector3<f64>) -> f64 {
    let camera = Mounting::from_polar(mounting.x, mounting.y, mounting.z);
    let (sin, cos) = (bearing + mounting.x + mounting.z).sin_cos();
    let along = camera.x_m * cos + camera.y_m * sin;
    let reach = -along + (along * along - mounting.y * mounting.y + distance * distance).max(0.0).sqrt();
    (camera.y_m + reach * sin).atan2(-(camera.x_m + reach * cos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::model::{MotionNoise, RelativeMotion, Wheels, compose};
    use nalgebra::Vector2;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn feature() -> impl Strategy<Value = Feature> {
        (0.8..6.0f64, -3.0..3.0f64).prop_map(|(distance_m, theta_rad)| Feature { distance_m, theta_rad })
    }

    fn mounting() -> impl Strategy<Value = Vector3<f64>> {
        (-3.0..3.0f64, 0.01..0.5f64, -3.0..3.0f64).prop_map(|(phi, rho, psi)| Vector3::new(phi, rho, psi))
    }

    const H: f64 = 1e-6;

    proptest! {
        #[test]
        fn dynamics_have_the_jacobians_of_the_appendix(f in feature(), left in -0.2..0.2f64, right in -0.2..0.2f64) {
            let motion = WheelMotion { left_m: left, right_m: right };
            let (a, b) = dynamics_jacobians(&f, &motion, 0.4);
            let at = |d: f64, t: f64, r: f64, l: f64| {
                let f = Feature { distance_m: f.distance_m + d, theta_rad: f.theta_rad + t };
                let next = dynamics(&f, &WheelMotion { left_m: left + l, right_m: right + r }, 0.4);
                Vector2::new(next.distance_m, next.theta_rad)
            };
            let given = [a.column(0), a.column(1), b.column(0), b.column(1)];
            for (k, given) in given.iter().enumerate() {
                let d = |s: f64| { let mut x = [0.0; 4]; x[k] = s; at(x[0], x[1], x[2], x[3]) };
                prop_assert!(((d(H) - d(-H)) / (2.0 * H) - given).amax() < 1e-7);
            }
        }

        #[test]
        fn the_observation_has_the_jacobian_of_the_appendix(f in feature(), m in mounting()) {
            let (by_feature, by_mounting) = observation_jacobians(&f, &m);
            let at = |x: [f64; 5]| observation(
                &Feature { distance_m: f.distance_m + x[0], theta_rad: f.theta_rad + x[1] },
                &(m + Vector3::new(x[2], x[3], x[4])),
            );
            let given = [by_feature[0], by_feature[1], by_mounting[0], by_mounting[1], by_mounting[2]];
            for (k, given) in given.iter().enumerate() {
                let d = |s: f64| { let mut x = [0.0; 5]; x[k] = s; at(x) };
                prop_assert!((wrap_angle(d(H) - d(-H)) / (2.0 * H) - given).abs() < 1e-7);
            }
        }

        #[test]
        fn the_observation_is_that_of_the_plane(
            x in -3.0..3.0f64, y in 1.0..3.0f64, heading in -3.0..3.0f64, m in mounting(),
        ) {
            // The feature at the origin: eqs. 16 and 17.
            let f = Feature { distance_m: x.hypot(y), theta_rad: heading - y.atan2(x) };
            let camera = Vector2::new(x + m.y * (heading + m.x).cos(), y + m.y * (heading + m.x).sin());
            let expected = (-camera.y).atan2(-camera.x) - heading - m.x - m.z;
            prop_assert!(wrap_angle(observation(&f, &m) - expected).abs() < 1e-9);
            let seen = theta_of(f.distance_m, observation(&f, &m), &m);
            prop_assert!(wrap_angle(seen - f.theta_rad).abs() < 1e-9);
        }

        #[test]
        fn short_steps_follow_the_plane(x in -3.0..3.0f64, y in 1.0..3.0f64, heading in -3.0..3.0f64) {
            let f = Feature { distance_m: x.hypot(y), theta_rad: heading - y.atan2(x) };
            let motion = WheelMotion { left_m: 1e-4, right_m: 1.5e-4 };
            let odometry = RelativeMotion::from_wheels(&motion, &Wheels::new(0.4), &MotionNoise::new(1e-5));
            let pose = compose(&Vector3::new(x, y, heading), &odometry.motion);
            let next = dynamics(&f, &motion, 0.4);
            prop_assert!((next.distance_m - pose.x.hypot(pose.y)).abs() < 1e-7);
            prop_assert!(wrap_angle(next.theta_rad - (pose.z - pose.y.atan2(pose.x))).abs() < 1e-7);
        }
    }

    #[test]
    fn a_feature_to_the_left() {
        // At the origin of camera and robot: theta of a feature to the left is a quarter of a turn.
        let seen = Feature { distance_m: 2.0, theta_rad: FRAC_PI_2 };
        assert!((observation(&seen, &Vector3::zeros()) - FRAC_PI_2).abs() < 1e-12);
    }
}
