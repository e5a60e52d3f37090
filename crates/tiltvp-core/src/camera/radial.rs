//! What all lenses that are round about their axis share: the angle from the axis maps to a radius.

use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, Vector2, Vector3};

/// A profile `r(theta)`, strictly growing on its domain, with derivatives.
pub(super) trait Radial {
    /// `(r, dr/dtheta)` at an angle from the axis in radians, in pixels (or units of the focal length).
    fn radius(&self, theta: f64) -> Option<(f64, f64)>;

    /// `(theta, dtheta/dr)` at a radius: the exact inverse of [`radius`](Self::radius).
    fn theta(&self, radius: f64) -> Option<(f64, f64)>;
}

/// Below this sine of the angle from the axis the direction in the image plane is taken from the limit on the axis,
/// whose relative error is the square of this.
const ON_AXIS: f64 = 1e-12;

/// The point `r(theta) (cos phi, sin phi)` that sees a bearing, and its derivative by the bearing.
///
/// With `rho = |(x, y)|`, `e = (x, y) / rho` and `n2 = |bearing|^2`:
/// `dtheta/d(x, y) = e z / n2`, `dtheta/dz = -rho / n2`, and `de/d(x, y) = (I - e e^T) / rho`.
pub(super) fn project(profile: &impl Radial, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
    let n2 = bearing.norm_squared();
    if !(n2.is_finite() && n2 > 0.0) {
        return None;
    }
    let xy = bearing.xy();
    let rho = xy.norm();
    let theta = rho.atan2(bearing.z);
    let (r, dr) = profile.radius(theta)?;
    let mut jacobian = Matrix2x3::zeros();
    if rho <= ON_AXIS * n2.sqrt() {
        if bearing.z < 0.0 {
            return None;
        }
        jacobian[(0, 0)] = dr / bearing.z;
        jacobian[(1, 1)] = dr / bearing.z;
        return Some((xy * (dr / bearing.z), jacobian));
    }
    let e = xy / rho;
    let outer = e * e.transpose();
    let plane = outer * (dr * bearing.z / n2) + (Matrix2::identity() - outer) * (r / rho);
    jacobian.fixed_view_mut::<2, 2>(0, 0).copy_from(&plane);
    jacobian.set_column(2, &(e * (-dr * rho / n2)));
    Some((e * r, jacobian))
}

/// The unit bearing seen by the point `r (cos phi, sin phi)`, and its derivative by the point.
///
/// With `e` the point's direction: bearing `(sin theta e, cos theta)`, derivative
/// `(cos theta theta' e e^T + sin theta / r (I - e e^T), -sin theta theta' e^T)`.
pub(super) fn unproject(profile: &impl Radial, point: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
    let r = point.norm();
    if !r.is_finite() {
        return None;
    }
    let (theta, dtheta) = profile.theta(r)?;
    let (sin, cos) = theta.sin_cos();
    let (e, sin_over_r) = if theta <= ON_AXIS { (Vector2::x(), dtheta) } else { (point / r, sin / r) };
    let outer = e * e.transpose();
    let plane = outer * (cos * dtheta) + (Matrix2::identity() - outer) * sin_over_r;
    let mut jacobian = Matrix3x2::zeros();
    jacobian.fixed_view_mut::<2, 2>(0, 0).copy_from(&plane);
    jacobian.set_row(2, &(e.transpose() * (-sin * dtheta)));
    let xy = if theta <= ON_AXIS { point * dtheta } else { e * sin };
    Some((Vector3::new(xy.x, xy.y, cos), jacobian))
}

/// [`project`] without the derivative.
#[inline]
pub(super) fn point(profile: &impl Radial, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
    let xy = bearing.xy();
    let rho = xy.norm();
    if rho <= ON_AXIS * bearing.z.abs() {
        return if bearing.z > 0.0 { profile.radius(0.0).map(|(_, dr)| xy * (dr / bearing.z)) } else { None };
    }
    let (r, _) = profile.radius(rho.atan2(bearing.z))?;
    Some(xy * (r / rho))
}

/// [`unproject`] without the derivative.
#[inline]
pub(super) fn bearing(profile: &impl Radial, point: &Vector2<f64>) -> Option<Vector3<f64>> {
    let r = point.norm();
    let (theta, dtheta) = profile.theta(r)?;
    let (sin, cos) = theta.sin_cos();
    let xy = if theta <= ON_AXIS { point * dtheta } else { point * (sin / r) };
    Some(Vector3::new(xy.x, xy.y, cos))
}
