//! Where the camera is and how it looks: lens, mounting, pose and tilt.

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::{Error, Result};

/// The longest side of an image, pixels: the light of a square of such sides takes 3.5 GB.
pub(crate) const LARGEST_SIDE_PX: usize = 16_384;

/// A lens: the unit bearing, in the camera frame, of an image point `(x, y)` in pixels (centres are integers), or none
/// outside the lens' valid set. Any closure of that shape is one.
pub trait Lens: Sync {
    /// The unit bearing of the image point `(x_px, y_px)` in the camera frame.
    fn bearing(&self, x_px: f64, y_px: f64) -> Option<Vector3<f64>>;
}

impl<F: Fn(f64, f64) -> Option<Vector3<f64>> + Sync> Lens for F {
    fn bearing(&self, x_px: f64, y_px: f64) -> Option<Vector3<f64>> {
        self(x_px, y_px)
    }
}

/// Where a robot stands on the floor, world frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RobotPose {
    /// Position along the world's `x`, metres.
    pub x_m: f64,
    /// Position along the world's `y`, metres.
    pub y_m: f64,
    /// Heading: the angle from the world's `x` to the upright robot's `x`, counter-clockwise, radians.
    pub yaw_rad: f64,
}

/// One look at a world.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Image width, pixels.
    pub width_px: usize,
    /// Image height, pixels.
    pub height_px: usize,
    /// The lens.
    pub lens: &'a dyn Lens,
    /// Rotation from camera to robot coordinates; identity for a camera that looks straight up with its image's right
    /// towards the robot's front.
    pub robot_from_camera: Matrix3<f64>,
    /// Where the robot stands.
    pub pose: RobotPose,
    /// Height of the camera's centre above the floor, metres.
    pub camera_height_m: f64,
    /// How the robot leans; it turns about the camera's centre.
    pub tilt: Tilt,
}

impl<'a> View<'a> {
    /// An upright view from 0.3 m above the floor, straight up.
    pub fn new(lens: &'a dyn Lens, width_px: usize, height_px: usize, pose: RobotPose) -> Self {
        Self {
            width_px,
            height_px,
            lens,
            robot_from_camera: Matrix3::identity(),
            pose,
            camera_height_m: 0.3,
            tilt: Tilt::UPRIGHT,
        }
    }

    /// Checks every field's domain.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] for the first field outside its domain.
    pub fn validate(&self) -> Result<()> {
        for (name, size) in [("view.width_px", self.width_px), ("view.height_px", self.height_px)] {
            if !(1..=LARGEST_SIDE_PX).contains(&size) {
                return Err(Error::option(name, size, format!("pixels in [1, {LARGEST_SIDE_PX}]")));
            }
        }
        let RobotPose { x_m, y_m, yaw_rad } = self.pose;
        for (name, value) in [("view.pose.x_m", x_m), ("view.pose.y_m", y_m), ("view.pose.yaw_rad", yaw_rad)] {
            if !value.is_finite() {
                return Err(Error::option(name, value, "a finite number"));
            }
        }
        if !(self.camera_height_m > 0.0 && self.camera_height_m.is_finite()) {
            return Err(Error::option("view.camera_height_m", self.camera_height_m, "a positive number of metres"));
        }
        let rotation = &self.robot_from_camera;
        let off = (rotation * rotation.transpose() - Matrix3::identity()).norm();
        if !(off < 1e-6 && rotation.determinant() > 0.0) {
            return Err(Error::argument("view.robot_from_camera", rotation, "a rotation matrix"));
        }
        Ok(())
    }

    /// The camera's centre in the world, metres.
    pub fn center(&self) -> Vector3<f64> {
        Vector3::new(self.pose.x_m, self.pose.y_m, self.camera_height_m)
    }

    /// Rotation from robot to world coordinates, `Rz(yaw) R_tilt^T`.
    pub fn world_from_robot(&self) -> Matrix3<f64> {
        let (s, c) = self.pose.yaw_rad.sin_cos();
        Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0) * self.tilt.leaning_from_upright().transpose()
    }

    /// Rotation from camera to world coordinates, `Rz(yaw) R_tilt^T robot_from_camera`.
    pub fn world_from_camera(&self) -> Matrix3<f64> {
        self.world_from_robot() * self.robot_from_camera
    }
}
