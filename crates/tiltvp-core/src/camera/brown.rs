//! Radial and tangential distortion of an image plane after Brown and Conrady, in OpenCV's meaning of its coefficients.

use nalgebra::{Matrix2, Vector2};

use super::polynomial::{derivative, first_fall, product, sum};
use super::rim::{FARTHEST, FOLD};
use super::schema::ParameterSchema;
use super::solve;
use crate::error::{Error, Result};

pub(super) const K1: ParameterSchema = ParameterSchema::coefficient("k1", "radial distortion, of r^2");
pub(super) const K2: ParameterSchema = ParameterSchema::coefficient("k2", "radial distortion, of r^4");
pub(super) const K3: ParameterSchema = ParameterSchema::coefficient("k3", "radial distortion, of r^6");
pub(super) const P1: ParameterSchema = ParameterSchema::coefficient("p1", "tangential distortion");
pub(super) const P2: ParameterSchema = ParameterSchema::coefficient("p2", "tangential distortion");

/// The distortion, with `s = x^2 + y^2` and `f = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)`:
/// `x' = x f + 2 p1 x y + p2 (s + 2 x^2)`, `y' = y f + p1 (s + 2 y^2) + 2 p2 x y`.
///
/// It is the gradient of a potential, so its Jacobian is symmetric; where that is positive definite on a disc, no two
/// points of the disc meet. Its eigenvalues are at least `min(f, d(r f)/dr) - 6 r |p|`; the valid disc ends where this
/// bound falls to zero (by [`FOLD`], measured per angle: `(1 + r^2)` times the bound), or where points are distorted to
/// beyond twice [`FARTHEST`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Brown {
    k: [f64; 6],
    p: [f64; 2],
    limit: f64,
}

impl Brown {
    /// From `[k1, k2, p1, p2, k3, k4, k5, k6]`, OpenCV's order.
    pub(super) fn new(model: &'static str, coefficients: [f64; 8]) -> Result<Self> {
        const NAMES: [&str; 8] = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];
        super::grid::finite(model, NAMES, coefficients)?;
        let [k1, k2, p1, p2, k3, k4, k5, k6] = coefficients;
        // In powers of r: the factor is n / d.
        let n = [1.0, 0.0, k1, 0.0, k2, 0.0, k3];
        let d = [1.0, 0.0, k4, 0.0, k5, 0.0, k6];
        let r = [0.0, 1.0];
        let dd = product(&d, &d);
        // The least eigenvalue allowed, times (1 + r^2) to stay a polynomial.
        let circle = [1.0, 0.0, 1.0];
        let least = sum(&[FOLD], 6.0 * p1.hypot(p2), &product(&r, &circle));
        let wronskian = sum(&product(&derivative(&n), &d), -1.0, &product(&n, &derivative(&d)));
        let radial = sum(&product(&n, &d), 1.0, &product(&r, &wronskian));
        let along = sum(&product(&radial, &circle), -1.0, &product(&dd, &least));
        let across = sum(&product(&n, &circle), -1.0, &product(&d, &least));
        // A radius in the distorted plane of no more than twice what one may be without distortion.
        let reach = sum(&product(&[2.0 * FARTHEST], &d), -1.0, &product(&r, &n));
        if along.iter().chain(&across).any(|c| !c.is_finite()) {
            return Err(Error::camera(model, "k1 .. k6, p1, p2", format!("{coefficients:?}"), "numbers below 1e100"));
        }
        let limit = [&d[..], &along, &across, &reach]
            .into_iter()
            .filter_map(|bound| first_fall(bound, FARTHEST))
            .fold(FARTHEST, f64::min);
        Ok(Self { k: [k1, k2, k3, k4, k5, k6], p: [p1, p2], limit })
    }

    /// `[k1, k2, p1, p2, k3, k4, k5, k6]`.
    pub(super) fn coefficients(&self) -> [f64; 8] {
        let ([k1, k2, k3, k4, k5, k6], [p1, p2]) = (self.k, self.p);
        [k1, k2, p1, p2, k3, k4, k5, k6]
    }

    /// The radius of the valid disc, in the undistorted plane.
    pub(super) fn limit(&self) -> f64 {
        self.limit
    }

    /// `(f, df/ds)`.
    #[inline]
    fn factor(&self, s: f64) -> (f64, f64) {
        let [k1, k2, k3, k4, k5, k6] = self.k;
        let n = 1.0 + s * (k1 + s * (k2 + s * k3));
        let dn = k1 + s * (2.0 * k2 + s * 3.0 * k3);
        if k4 == 0.0 && k5 == 0.0 && k6 == 0.0 {
            return (n, dn);
        }
        let d = 1.0 + s * (k4 + s * (k5 + s * k6));
        let dd = k4 + s * (2.0 * k5 + s * 3.0 * k6);
        (n / d, (dn - n / d * dd) / d)
    }

    /// The distorted point.
    #[inline]
    pub(super) fn distort(&self, point: &Vector2<f64>) -> Vector2<f64> {
        let s = point.norm_squared();
        self.shifted(point, s, self.factor(s).0)
    }

    #[inline]
    fn shifted(&self, point: &Vector2<f64>, s: f64, f: f64) -> Vector2<f64> {
        let ([p1, p2], x, y) = (self.p, point.x, point.y);
        let xy2 = 2.0 * x * y;
        Vector2::new(x * f + p1 * xy2 + p2 * (s + 2.0 * x * x), y * f + p1 * (s + 2.0 * y * y) + p2 * xy2)
    }

    /// The distorted point and its (symmetric) derivative by the point.
    #[inline]
    pub(super) fn distort_jacobian(&self, point: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let s = point.norm_squared();
        let (f, df) = self.factor(s);
        let ([p1, p2], x, y) = (self.p, point.x, point.y);
        let across = 2.0 * (df * x * y + p1 * x + p2 * y);
        let jacobian = Matrix2::new(
            f + 2.0 * df * x * x + 2.0 * p1 * y + 6.0 * p2 * x,
            across,
            across,
            f + 2.0 * df * y * y + 6.0 * p1 * y + 2.0 * p2 * x,
        );
        (self.shifted(point, s, f), jacobian)
    }

    /// The point of the valid disc that is distorted to the one given, `None` if there is none.
    ///
    /// The radial part alone is inverted in a bracket; where there is a tangential part Newton's method in the plane
    /// starts from there, with steps shortened until they stay in the disc and lessen the error.
    pub(super) fn undistort(&self, distorted: &Vector2<f64>) -> Option<Vector2<f64>> {
        let goal = distorted.norm();
        if goal == 0.0 {
            return Some(Vector2::zeros());
        }
        // Beyond what can be squared every point would seem to be at the centre.
        if !goal.is_finite() {
            return None;
        }
        let radial = |r: f64| {
            let (f, df) = self.factor(r * r);
            (r * f - goal, f + 2.0 * r * r * df)
        };
        let tangential = self.p != [0.0, 0.0];
        let r = if radial(self.limit).0 >= 0.0 {
            solve::increasing(0.0, self.limit, goal, radial)
        } else if tangential {
            self.limit
        } else {
            return None;
        };
        let start = distorted * (r / goal);
        if tangential { self.polish(start, distorted, goal) } else { Some(start) }
    }

    fn polish(&self, start: Vector2<f64>, distorted: &Vector2<f64>, goal: f64) -> Option<Vector2<f64>> {
        let mut point = start;
        let (mut image, mut jacobian) = self.distort_jacobian(&point);
        let mut error = image - distorted;
        for _ in 0..50 {
            let step = jacobian.try_inverse()? * error;
            let mut part = 1.0;
            let shorter = loop {
                let candidate = point - step * part;
                if candidate.norm() <= self.limit {
                    (image, jacobian) = self.distort_jacobian(&candidate);
                    let now = image - distorted;
                    if now.norm_squared() < error.norm_squared() {
                        break Some((candidate, now));
                    }
                }
                part *= 0.5;
                if part < 1e-4 {
                    break None;
                }
            };
            let Some((candidate, now)) = shorter else { break };
            (point, error) = (candidate, now);
            if error.norm() <= f64::EPSILON * goal {
                break;
            }
        }
        (error.norm() <= 1e-12 * goal).then_some(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn no_ray_comes_from_where_squares_overflow() {
        let brown = Brown::new("pinhole", [-0.31, 0.12, 9e-4, -7e-4, -0.021, 0.0, 0.0, 0.0]).expect("a lens");
        for far in [1e3, 1e100, 1e154, 1e200, 1e300, f64::MAX] {
            assert_eq!(brown.undistort(&Vector2::new(far, -0.5)), None, "{far}");
        }
    }

    proptest! {
        #[test]
        fn undistort_inverts_over_the_whole_disc(
            k1 in -0.5..0.5f64, k2 in -0.3..0.3f64, k4 in -0.2..0.5f64, p1 in -0.01..0.01f64, p2 in -0.01..0.01f64,
            part in 0.0..0.9999f64, phi in 0.0..6.3f64,
        ) {
            let brown = Brown::new("pinhole", [k1, k2, p1, p2, 0.01, k4, 0.0, 0.0])?;
            let r = part * brown.limit().min(20.0);
            let point = Vector2::new(r * phi.cos(), r * phi.sin());
            let back = brown.undistort(&brown.distort(&point));
            prop_assert!(back.is_some_and(|p| (p - point).norm() < 1e-9 * (1.0 + r)), "{:?} {:?} {}", back, point, brown.limit());
        }
    }
}
