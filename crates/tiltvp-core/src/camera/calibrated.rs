//! A calibrated camera: a model, the size of its images, and the set of rays for which it answers.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::model::CameraModel;
use super::rim::Rim;
use super::{Model, with_model};
use crate::error::{Error, Result};
use crate::geometry::squarable;

/// The longest side of an image. No camera and no panorama has so many pixels a side: a longer one is a slip in a file, and
/// tables of its pixels would not fit into memory (`every_model_refuses_an_impossible_size`).
pub const LARGEST_SIDE_PX: u32 = 100_000;

/// The most pixels of an image: a panorama of 20,000 x 10,000, above the 151 megapixels of the largest sensors that are sold.
/// Tables of more would take over 8 GB, so that a slip in a small file could end the process.
pub const MOST_PIXELS: u64 = 200_000_000;

/// A calibrated central camera.
///
/// If `mirror` is set the image is seen in a mirror: bearings have the `z` component of the model negated, so that the
/// centre of the image of an upward-looking camera under a convex mirror looks down, as it does.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    width: u32,
    height: u32,
    model: Model,
    mirror: bool,
    max_theta_rad: f64,
    /// The limit, where it is tighter than the model's own.
    limit: Option<Rim>,
    /// The `z` of the model's ray through the centre of the image.
    axis_z: f64,
}

impl Camera {
    /// A camera with images of `width` x `height` pixels that answers wherever its model does.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] unless the sides of the image are from 1 to [`LARGEST_SIDE_PX`], its pixels at most
    /// [`MOST_PIXELS`], and the sides those of the model if it is made for one size.
    pub fn new(width: u32, height: u32, model: Model) -> Result<Self> {
        for (name, side) in [("width", width), ("height", height)] {
            if !(1..=LARGEST_SIDE_PX).contains(&side) {
                return Err(Error::camera(model.name(), name, side, format!("1 to {LARGEST_SIDE_PX} pixels")));
            }
        }
        if u64::from(width) * u64::from(height) > MOST_PIXELS {
            let expected = format!("at most {MOST_PIXELS} pixels in all");
            return Err(Error::camera(model.name(), "width, height", format!("{width} x {height}"), expected));
        }
        if let Some([w, h]) = model.as_dyn().image_size().filter(|size| *size != [width, height]) {
            let expected = format!("{w} x {h}, the size that the model is made for");
            return Err(Error::camera(model.name(), "width, height", format!("{width} x {height}"), expected));
        }
        let (max_theta_rad, axis_z) = (model.as_dyn().max_theta_rad(), model.as_dyn().axis_z());
        Ok(Self { width, height, model, mirror: false, max_theta_rad, limit: None, axis_z })
    }

    /// The same camera that answers only within `max_theta_rad` of the ray through the centre of the image.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] unless `0 < max_theta_rad <= pi`.
    pub fn with_max_theta_rad(mut self, max_theta_rad: f64) -> Result<Self> {
        if !(max_theta_rad > 0.0 && max_theta_rad <= std::f64::consts::PI) {
            return Err(Error::camera(self.model.name(), "max_theta_rad", max_theta_rad, "an angle in (0, pi]"));
        }
        let own = self.model.as_dyn().max_theta_rad();
        self.max_theta_rad = max_theta_rad.min(own);
        self.limit = (max_theta_rad < own).then(|| Rim::new(max_theta_rad, 0.0));
        Ok(self)
    }

    /// The same camera seen in a mirror: the `z` component of every bearing changes its sign.
    #[must_use]
    pub fn mirrored(mut self) -> Self {
        self.mirror = !self.mirror;
        self
    }

    /// Columns of the image.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of the image.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The lens.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Whether the image is seen in a mirror.
    pub fn is_mirrored(&self) -> bool {
        self.mirror
    }

    /// The largest angle, from the ray through the centre of the image, for which the camera answers, in radians.
    pub fn max_theta_rad(&self) -> f64 {
        self.max_theta_rad
    }

    /// Asks for so many bytes a pixel of the image at once and gives them back: tables of this size can be made then, and need not
    /// be asked for one by one. (Another thread may take the memory in between; a process that is short of it then ends.)
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] where the memory cannot be had.
    pub fn check_memory(&self, bytes_per_pixel: usize) -> Result<()> {
        let bytes = self.width as usize * self.height as usize * bytes_per_pixel;
        Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| {
            let expected = format!("an image for whose tables, here of {} MiB, there is memory", bytes >> 20);
            Error::camera(self.model.name(), "width, height", format!("{} x {}", self.width, self.height), expected)
        })
    }

    /// Whether a pixel lies in the image, the outer halves of the border pixels included.
    pub fn contains(&self, pixel: &Vector2<f64>) -> bool {
        (-0.5..f64::from(self.width) - 0.5).contains(&pixel.x)
            && (-0.5..f64::from(self.height) - 0.5).contains(&pixel.y)
    }

    /// The pixel that sees a bearing of any positive length, `None` outside the valid set.
    pub fn project(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        with_model!(&self.model, model => self.project_by(model, bearing))
    }

    /// The unit bearing that a pixel sees, `None` outside the valid set.
    pub fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        with_model!(&self.model, model => self.unproject_by(model, pixel))
    }

    /// [`project`](Self::project) with `d pixel / d bearing`.
    pub fn project_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        with_model!(&self.model, model => self.project_jacobian_by(model, bearing))
    }

    /// Pixels per radian at a unit bearing, root mean square over directions in the image.
    pub(crate) fn px_per_rad(&self, bearing: &Vector3<f64>) -> Option<f64> {
        self.project_jacobian(bearing).map(|(_, jacobian)| jacobian.norm() / 2f64.sqrt())
    }

    /// [`unproject`](Self::unproject) with `d bearing / d pixel`.
    pub fn unproject_jacobian(&self, pixel: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        with_model!(&self.model, model => self.unproject_jacobian_by(model, pixel))
    }

    /// As [`project`](Self::project), without the limit of [`with_max_theta_rad`](Self::with_max_theta_rad).
    pub(crate) fn project_unlimited(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        with_model!(&self.model, model => model.project(&self.reflect(bearing)))
    }

    /// As [`unproject`](Self::unproject), without that limit.
    pub(crate) fn unproject_unlimited(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        with_model!(&self.model, model => model.unproject(pixel)).map(|bearing| self.reflect(&bearing))
    }

    /// As [`unproject_jacobian`](Self::unproject_jacobian), without that limit.
    pub(crate) fn unproject_jacobian_unlimited(&self, pixel: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        with_model!(&self.model, model => self.unlimited_jacobian_by(model, pixel))
    }

    /// That limit, if there is one: bearings are seen whose component along an axis is at least so much.
    pub(crate) fn limit(&self) -> Option<(Vector3<f64>, f64)> {
        let axis = self.reflect(&Vector3::new(0.0, 0.0, self.axis_z.signum()));
        self.limit.map(|_| (axis, self.max_theta_rad.cos()))
    }

    #[inline]
    pub(super) fn project_by(&self, model: &impl CameraModel, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (bearing, _) = squarable(&self.reflect(bearing));
        self.within(&bearing).then(|| model.project(&bearing)).flatten()
    }

    #[inline]
    pub(super) fn unproject_by(&self, model: &impl CameraModel, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let bearing = model.unproject(pixel)?;
        self.within(&bearing).then(|| self.reflect(&bearing))
    }

    #[inline]
    pub(super) fn project_jacobian_by(
        &self,
        model: &impl CameraModel,
        bearing: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (bearing, shorter) = squarable(&self.reflect(bearing));
        let (pixel, mut jacobian) = self.within(&bearing).then(|| model.project_jacobian(&bearing)).flatten()?;
        jacobian /= shorter;
        if self.mirror {
            jacobian.column_mut(2).neg_mut();
        }
        Some((pixel, jacobian))
    }

    #[inline]
    pub(super) fn unproject_jacobian_by(
        &self,
        model: &impl CameraModel,
        pixel: &Vector2<f64>,
    ) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        self.unlimited_jacobian_by(model, pixel).filter(|(bearing, _)| self.within(&self.reflect(bearing)))
    }

    #[inline]
    fn unlimited_jacobian_by(
        &self,
        model: &impl CameraModel,
        pixel: &Vector2<f64>,
    ) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        let (bearing, mut jacobian) = model.unproject_jacobian(pixel)?;
        if self.mirror {
            jacobian.row_mut(2).neg_mut();
        }
        Some((self.reflect(&bearing), jacobian))
    }

    #[inline]
    fn reflect(&self, bearing: &Vector3<f64>) -> Vector3<f64> {
        if self.mirror { Vector3::new(bearing.x, bearing.y, -bearing.z) } else { *bearing }
    }

    /// Whether a bearing of the model is within a limit that is tighter than the model's own.
    #[inline]
    fn within(&self, bearing: &Vector3<f64>) -> bool {
        self.limit.is_none_or(|limit| limit.admits(bearing.xy().norm(), self.axis_z * bearing.z))
    }
}
