//! What a lens does before its pixel grid, and how lens and grid together are a camera model.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::grid::PixelGrid;
use super::model::CameraModel;
use crate::geometry::tangent_basis;

/// A central projection to a plane of its own, followed by an affine map to pixels.
pub(super) trait Lens {
    /// From the plane of the lens to pixels.
    fn grid(&self) -> &PixelGrid;

    /// The point that sees a bearing of any sane length.
    fn point(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>>;

    /// [`point`](Self::point) with its derivative by the bearing.
    fn point_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)>;

    /// The unit bearing that a finite point sees.
    fn bearing(&self, point: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// [`bearing`](Self::bearing) with its derivative by the point.
    ///
    /// With `T` a basis of the plane tangent to the sphere at the bearing and `J` the derivative of the point,
    /// the derivative of the inverse is `T (J T)^-1`.
    fn bearing_jacobian(&self, point: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        let bearing = self.bearing(point)?;
        let (_, jacobian) = self.point_jacobian(&bearing)?;
        let basis = tangent_basis(&bearing);
        Some((bearing, basis * (jacobian * basis).try_inverse()?))
    }

    /// The rim of the lens, as an angle from the ray through its centre, in radians.
    fn rim_rad(&self) -> f64;

    /// The `z` of the ray through the centre.
    fn axis_z(&self) -> f64 {
        1.0
    }
}

impl<L: Lens> CameraModel for L {
    #[inline]
    fn project(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        let point = self.point(sane(bearing)?)?;
        seen(self.grid().pixel(&point))
    }

    #[inline]
    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        self.bearing(&seen(self.grid().point(pixel))?)
    }

    #[inline]
    fn project_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (point, jacobian) = self.point_jacobian(sane(bearing)?)?;
        Some((seen(self.grid().pixel(&point))?, self.grid().pixel_jacobian(&jacobian)))
    }

    #[inline]
    fn unproject_jacobian(&self, pixel: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        let (bearing, jacobian) = self.bearing_jacobian(&seen(self.grid().point(pixel))?)?;
        Some((bearing, self.grid().bearing_jacobian(&jacobian)))
    }

    fn max_theta_rad(&self) -> f64 {
        self.rim_rad()
    }

    fn axis_z(&self) -> f64 {
        Lens::axis_z(self)
    }
}

/// A bearing whose squared length is a normal number.
#[inline]
pub(super) fn sane(bearing: &Vector3<f64>) -> Option<&Vector3<f64>> {
    bearing.norm_squared().is_normal().then_some(bearing)
}

/// A point or pixel with finite numbers.
#[inline]
pub(super) fn seen(pixel: Vector2<f64>) -> Option<Vector2<f64>> {
    (pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
}
