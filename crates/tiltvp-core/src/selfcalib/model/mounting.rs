//! Where the camera sits on the robot: as (x, y, yaw), which always exists, and as the paper's (phi, rho, psi).

use nalgebra::{Matrix3, Vector3};

use crate::geometry::wrap_angle;

/// The pose of the camera in the robot's frame: x forward, y left, yaw counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mounting {
    /// Forward of the middle of the wheel axle, metres.
    pub x_m: f64,
    /// Left of it, metres.
    pub y_m: f64,
    /// Direction of the camera's x axis, `phi + psi`, radians.
    pub yaw_rad: f64,
}

impl Mounting {
    /// From the angle `phi` and the distance `rho` of the camera and its turn `psi` (Scaramuzza et al. 2009, fig. 19): `x = rho cos phi`,
    /// `y = rho sin phi`, `yaw = phi + psi`.
    pub fn from_polar(phi_rad: f64, rho_m: f64, psi_rad: f64) -> Self {
        let (sin, cos) = phi_rad.sin_cos();
        Self { x_m: rho_m * cos, y_m: rho_m * sin, yaw_rad: wrap_angle(phi_rad + psi_rad) }
    }

    /// From the vector (x, y, yaw).
    pub fn from_vector(v: &Vector3<f64>) -> Self {
        Self { x_m: v.x, y_m: v.y, yaw_rad: wrap_angle(v.z) }
    }

    /// As the vector (x, y, yaw).
    pub fn vector(&self) -> Vector3<f64> {
        Vector3::new(self.x_m, self.y_m, self.yaw_rad)
    }

    /// The paper's `phi`, in (-pi, pi]; 0 where `rho` is, where it is undefined.
    pub fn phi_rad(&self) -> f64 {
        self.y_m.atan2(self.x_m)
    }

    /// The paper's `rho`.
    pub fn rho_m(&self) -> f64 {
        self.x_m.hypot(self.y_m)
    }

    /// The paper's `psi = yaw - phi`, in (-pi, pi].
    pub fn psi_rad(&self) -> f64 {
        wrap_angle(self.yaw_rad - self.phi_rad())
    }

    /// The Jacobian of (phi, rho, psi) by (x, y, yaw); infinite entries at `rho = 0`.
    pub fn polar_by_vector(&self) -> Matrix3<f64> {
        let rho = self.rho_m();
        let (sin, cos) = self.phi_rad().sin_cos();
        let (px, py) = (-sin / rho, cos / rho);
        Matrix3::new(px, py, 0.0, cos, sin, 0.0, -px, -py, 1.0)
    }

    /// The Jacobian of (x, y, yaw) by (phi, rho, psi).
    pub fn vector_by_polar(&self) -> Matrix3<f64> {
        let rho = self.rho_m();
        let (sin, cos) = self.phi_rad().sin_cos();
        Matrix3::new(-rho * sin, cos, 0.0, rho * cos, sin, 0.0, 1.0, 0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn there_and_back(phi in -3.1..3.1f64, rho in 0.01..5.0f64, psi in -3.1..3.1f64) {
            let m = Mounting::from_polar(phi, rho, psi);
            prop_assert!((m.phi_rad() - phi).abs() < 1e-12 && (m.rho_m() - rho).abs() < 1e-12);
            prop_assert!(wrap_angle(m.psi_rad() - psi).abs() < 1e-12);
            prop_assert!((m.polar_by_vector() * m.vector_by_polar() - Matrix3::identity()).amax() < 1e-9);
            let step = 1e-6;
            for (axis, column) in m.vector_by_polar().column_iter().enumerate() {
                let mut d = Vector3::zeros();
                d[axis] = step;
                let at = |s: f64| Mounting::from_polar(phi + s * d.x, rho + s * d.y, psi + s * d.z).vector();
                let difference = (at(1.0) - at(-1.0)).map(wrap_angle) / (2.0 * step);
                prop_assert!((difference - column).amax() < 1e-6);
            }
        }
    }
}
