//! What every central camera model answers: bearing to pixel and back, with Jacobians.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

/// A central projection: every pixel of the valid set is one unit bearing.
///
/// Bearings are in the camera frame (`z` along the optical axis, `x` right, `y` down); pixel centres are at integers.
/// `None` means that the model has no answer there, never that the question was wrong.
pub trait CameraModel {
    /// The pixel `(u, v)` that sees a direction, given as a bearing of any positive length.
    fn project(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>>;

    /// The unit bearing that a pixel sees.
    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// [`project`](Self::project) with `d pixel / d bearing`, in pixels per unit of the bearing as given.
    fn project_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)>;

    /// [`unproject`](Self::unproject) with `d bearing / d pixel` of the unit bearing, per pixel.
    fn unproject_jacobian(&self, pixel: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)>;

    /// The largest angle that the model answers for, from the ray through the centre of the image, in radians.
    fn max_theta_rad(&self) -> f64;

    /// Columns and rows of the image, for a model that is made for one size of it.
    fn image_size(&self) -> Option<[u32; 2]> {
        None
    }

    /// The `z` of the unit ray through the centre of the image: 1, or -1 for a mirror given in its physical frame.
    fn axis_z(&self) -> f64 {
        1.0
    }
}
