//! The tilt of a robot: how far it leans (alpha) and in which direction (beta).

use nalgebra::{Matrix3, Vector3};

use super::bearing::unit;

/// A lean of the robot against the ground plane (Fleer 2017, eq. 1).
///
/// `normal` is the ground plane's normal seen from the leaning robot,
/// `n_robot = (-sin a cos b, -sin a sin b, cos a)`: `beta = 0` is a forward lean, `beta = +pi/2` a lean to the left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tilt {
    normal: Vector3<f64>,
}

impl Tilt {
    /// No lean at all.
    pub const UPRIGHT: Self = Self { normal: Vector3::new(0.0, 0.0, 1.0) };

    /// From the lean `alpha_rad` and its direction `beta_rad`, both in radians.
    pub fn from_alpha_beta(alpha_rad: f64, beta_rad: f64) -> Self {
        let (sin_a, cos_a) = alpha_rad.sin_cos();
        let (sin_b, cos_b) = beta_rad.sin_cos();
        Self { normal: Vector3::new(-sin_a * cos_b, -sin_a * sin_b, cos_a) }
    }

    /// From the ground normal in the robot frame, of any length but zero. A unit vector is kept to the last bit.
    pub fn from_normal(normal: &Vector3<f64>) -> Option<Self> {
        if (normal.norm_squared() - 1.0).abs() <= 8.0 * f64::EPSILON {
            return Some(Self { normal: *normal });
        }
        unit(normal).map(|normal| Self { normal })
    }

    /// The ground normal in the robot frame, a unit vector.
    pub fn normal(&self) -> Vector3<f64> {
        self.normal
    }

    /// How far the robot leans, in `[0, pi]` radians.
    pub fn alpha_rad(&self) -> f64 {
        self.normal.xy().norm().atan2(self.normal.z)
    }

    /// In which direction the robot leans, in `(-pi, pi]` radians; 0 where it does not lean.
    pub fn beta_rad(&self) -> f64 {
        if self.normal.x == 0.0 && self.normal.y == 0.0 {
            return 0.0;
        }
        (-self.normal.y).atan2(-self.normal.x)
    }

    /// Roll about the robot's `x` axis, right side down positive, in radians (ROS REP 103, `Rz Ry Rx`).
    pub fn roll_rad(&self) -> f64 {
        self.normal.y.atan2(self.normal.z)
    }

    /// Pitch about the robot's `y` axis, nose down positive, in radians (ROS REP 103, `Rz Ry Rx`).
    pub fn pitch_rad(&self) -> f64 {
        (-self.normal.x).atan2(self.normal.yz().norm())
    }

    /// The rotation `R_ab` with `n_robot = R_ab (0, 0, 1)`: takes directions of the upright robot's frame to the leaning
    /// robot's, with no turn about the vertical.
    pub fn leaning_from_upright(&self) -> Matrix3<f64> {
        let basis = super::tangent_basis(&self.normal);
        Matrix3::from_columns(&[basis.column(0).into_owned(), basis.column(1).into_owned(), self.normal])
    }

    /// The angle between the two ground normals in radians: the error measure of Fleer (2017), eq. 44.
    pub fn angle_to(&self, other: &Self) -> f64 {
        super::angle_between(&self.normal, &other.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Rotation3;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn forward_lean_points_the_normal_backwards() {
        let tilt = Tilt::from_alpha_beta(0.1, 0.0);
        assert_relative_eq!(tilt.normal(), Vector3::new(-0.1f64.sin(), 0.0, 0.1f64.cos()), epsilon = 1e-15);
        assert_relative_eq!(tilt.pitch_rad(), 0.1, epsilon = 1e-15);
        let left = Tilt::from_alpha_beta(0.1, FRAC_PI_2);
        assert_relative_eq!(left.normal().y, -0.1f64.sin(), epsilon = 1e-15);
        assert_relative_eq!(left.roll_rad(), -0.1, epsilon = 1e-15);
    }

    proptest! {
        #[test]
        fn alpha_beta_round_trip(alpha in 1e-6..3.1f64, beta in -3.1..3.1f64) {
            let tilt = Tilt::from_alpha_beta(alpha, beta);
            prop_assert!((tilt.alpha_rad() - alpha).abs() < 1e-9);
            prop_assert!((tilt.beta_rad() - beta).abs() < 1e-9);
        }

        #[test]
        fn roll_and_pitch_are_those_of_the_attitude(roll in -1.5..1.5f64, pitch in -1.5..1.5f64, yaw in -3.0..3.0f64) {
            let ground_from_robot = Rotation3::from_euler_angles(roll, pitch, yaw);
            let tilt = Tilt::from_normal(&(ground_from_robot.inverse() * Vector3::z())).unwrap();
            prop_assert!((tilt.roll_rad() - roll).abs() < 1e-9);
            prop_assert!((tilt.pitch_rad() - pitch).abs() < 1e-9);
        }

        #[test]
        fn a_normal_is_kept_to_the_last_bit(x in -1e3..1e3f64, y in -1e3..1e3f64, z in -1e3..1e3f64) {
            prop_assume!(x != 0.0 || y != 0.0 || z != 0.0);
            let tilt = Tilt::from_normal(&Vector3::new(x, y, z));
            prop_assert_eq!(tilt.and_then(|tilt| Tilt::from_normal(&tilt.normal())), tilt);
        }

        #[test]
        fn rotation_takes_the_vertical_to_the_normal(alpha in 0.0..3.0f64, beta in -3.1..3.1f64) {
            let tilt = Tilt::from_alpha_beta(alpha, beta);
            let rotation = tilt.leaning_from_upright();
            prop_assert!((rotation * Vector3::z() - tilt.normal()).norm() < 1e-12);
            prop_assert!((rotation * rotation.transpose() - Matrix3::identity()).norm() < 1e-9);
            prop_assert!((rotation.determinant() - 1.0).abs() < 1e-9);
        }
    }
}
