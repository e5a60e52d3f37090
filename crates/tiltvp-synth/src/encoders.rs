//! Wheel encoders of a differential drive, and the poses that their readings add up to.

use tiltvp_core::options;

use crate::rng::Rng;
use crate::view::RobotPose;

options! {
    /// The wheels and what their encoders get wrong.
    #[derive(Copy)]
    pub struct Wheels {
        /// Distance between the wheels' contact points, metres.
        [as "wheel_base_m"] base_m: f64 = 0.35 => 0.02..=5.0, "metres in [0.02, 5]";
        /// Variance of a reading per metre that a wheel rolls, metres (Chong and Kleeman 1997).
        encoder_k_m: f64 = 1e-5 => 0.0..=0.1, "metres in [0, 0.1]";
        /// How much larger the left and the right wheel are than the odometry takes them for, relative.
        [as "wheel_radius_errors"] radius_errors: [f64; 2] = [0.0; 2] => -0.5..=0.5, "a share in [-0.5, 0.5]";
    }
}

impl Wheels {
    /// How far the left and the right wheel roll, metres, when the middle between them moves `distance_m` along an arc that
    /// turns by `turn_rad`.
    pub fn displacements(&self, distance_m: f64, turn_rad: f64) -> [f64; 2] {
        let half = 0.5 * self.base_m * turn_rad;
        [distance_m - half, distance_m + half]
    }

    /// Distance in metres and turn in radians of the middle between the wheels, from how far the left and right one rolled.
    pub fn motion(&self, [left_m, right_m]: [f64; 2]) -> (f64, f64) {
        (0.5 * (left_m + right_m), (right_m - left_m) / self.base_m)
    }

    /// The pose after the wheels rolled so far, along an arc of a circle.
    pub fn moved(&self, from: RobotPose, displacements_m: [f64; 2]) -> RobotPose {
        let (distance, turn) = self.motion(displacements_m);
        let half = 0.5 * turn;
        let chord = distance * if half.abs() < 1e-8 { 1.0 } else { half.sin() / half };
        let (s, c) = (from.yaw_rad + half).sin_cos();
        RobotPose { x_m: from.x_m + chord * c, y_m: from.y_m + chord * s, yaw_rad: wrapped(from.yaw_rad + turn) }
    }

    /// What the encoders say when the wheels rolled so far: by the nominal radii, with noise of variance `K |d|`.
    pub(crate) fn read(&self, displacements_m: [f64; 2], rng: &mut Rng) -> [f64; 2] {
        [0, 1].map(|wheel| {
            let nominal = displacements_m[wheel] / (1.0 + self.radius_errors[wheel]);
            nominal + (self.encoder_k_m * nominal.abs()).sqrt() * rng.normal()
        })
    }
}

/// An angle in `[-pi, pi]`.
pub(crate) fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - std::f64::consts::TAU * (angle_rad / std::f64::consts::TAU).round()
}
