//! Projection of an ellipsoid about the centre from a point shifted along the axis: what the unified models share.

use nalgebra::{Matrix2x3, RowVector3, Vector2, Vector3};

use super::rim::{NARROWEST_RAD, Rim};
use crate::error::{Error, Result};

/// `m = (x, y) / (a d + b z)` with `d = sqrt(beta (x^2 + y^2) + z^2)`.
///
/// Unified (Mei): `a = xi, b = 1, beta = 1`. Extended unified: `a = alpha, b = 1 - alpha`. Valid for `z > -w d`, where
/// `w = a / b` if `a <= b` (the plane is infinite there), `w = b / a` otherwise (the image folds there)
/// (Usenko et al. 2018, eq. 21, 34).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ShiftedSphere {
    a: f64,
    b: f64,
    beta: f64,
    rim: Rim,
}

impl ShiftedSphere {
    /// Finds the rim; `a` and `b` must not be negative nor both zero, `beta` must be positive.
    pub(super) fn new(model: &'static str, a: f64, b: f64, beta: f64) -> Result<Self> {
        let w = if a <= b { a / b } else { b / a };
        let end = ((1.0 - w * w).max(0.0) / beta).sqrt().atan2(-w);
        let open = Self { a, b, beta, rim: Rim::new(end, 0.0) };
        let rim = Rim::find(end, |theta| {
            let (sin, cos) = theta.sin_cos();
            let (m, j) = open.raw_jacobian(&Vector3::new(sin, 0.0, cos));
            (m.x, j[(0, 0)] * cos - j[(0, 2)] * sin)
        });
        let sphere = Self { rim, ..open };
        sphere.checked(model)
    }

    /// The same sphere seen only up to a radius in the plane.
    pub(super) fn within_radius(mut self, model: &'static str, radius: f64) -> Result<Self> {
        if radius < self.rim.radius {
            let edge = self.raw_bearing(&Vector2::new(radius, 0.0));
            self.rim = Rim::new(edge.x.atan2(edge.z), radius);
        }
        self.checked(model)
    }

    fn checked(self, model: &'static str) -> Result<Self> {
        if self.rim.theta > NARROWEST_RAD {
            return Ok(self);
        }
        Err(Error::camera(model, "field of view", self.rim.theta, "parameters under which more than the axis is seen"))
    }

    pub(super) fn rim(&self) -> &Rim {
        &self.rim
    }

    pub(super) fn shift(&self) -> f64 {
        self.a
    }

    pub(super) fn beta(&self) -> f64 {
        self.beta
    }

    #[inline]
    pub(super) fn point(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        let xy = bearing.xy();
        let rho2 = xy.norm_squared();
        let d = (self.beta * rho2 + bearing.z * bearing.z).sqrt();
        self.rim.admits(rho2.sqrt(), bearing.z).then(|| xy / (self.a * d + self.b * bearing.z))
    }

    #[inline]
    pub(super) fn point_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        self.rim.admits(bearing.xy().norm(), bearing.z).then(|| self.raw_jacobian(bearing))
    }

    fn raw_jacobian(&self, bearing: &Vector3<f64>) -> (Vector2<f64>, Matrix2x3<f64>) {
        let (xy, z) = (bearing.xy(), bearing.z);
        let d = (self.beta * xy.norm_squared() + z * z).sqrt();
        let denominator = self.a * d + self.b * z;
        let m = xy / denominator;
        let part = self.a * self.beta / d;
        let slope = RowVector3::new(part * xy.x, part * xy.y, self.a * z / d + self.b);
        let mut jacobian = m * slope * (-1.0 / denominator);
        jacobian[(0, 0)] += 1.0 / denominator;
        jacobian[(1, 1)] += 1.0 / denominator;
        (m, jacobian)
    }

    /// The unit bearing that a point of the plane sees: with `s = beta |m|^2` and `d = 1`,
    /// `z = (sqrt(1 + (b^2 - a^2) s) - a b s) / (1 + b^2 s)` and `(x, y) = m (a + b z)`, of which the second factor is
    /// `(a + b sqrt(1 + (b^2 - a^2) s)) / (1 + b^2 s)`: towards the rim `a + b z` alone is what rounding leaves of a difference.
    #[inline]
    pub(super) fn bearing(&self, point: &Vector2<f64>) -> Option<Vector3<f64>> {
        (point.norm_squared() <= self.rim.radius * self.rim.radius).then(|| self.raw_bearing(point))
    }

    #[inline]
    fn raw_bearing(&self, point: &Vector2<f64>) -> Vector3<f64> {
        let (a, b) = (self.a, self.b);
        let s = self.beta * point.norm_squared();
        let (root, below) = ((1.0 + (b * b - a * a) * s).max(0.0).sqrt(), 1.0 + b * b * s);
        let xy = point * ((a + b * root) / below);
        Vector3::new(xy.x, xy.y, (root - a * b * s) / below).normalize()
    }
}
