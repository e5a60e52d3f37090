//! A vertical line of one image, and all lines of it with the frame that their bearings are in.

use nalgebra::{Matrix3, Vector2, Vector3};

/// A vertical line of the world as one image shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Azimuth `atan2(y, x)` about the vertical in the upright robot's frame, in `(-pi, pi]` radians.
    pub bearing_rad: f64,
    /// Standard deviation of the bearing in radians.
    pub sigma_rad: f64,
    /// How many edge pixels, one across the edge, are on the line.
    pub support_px: u32,
    /// Elevation of the lowest pixel above the upright robot's horizon, in radians.
    pub elevation_min_rad: f64,
    /// Elevation of the highest pixel, in radians.
    pub elevation_max_rad: f64,
    /// The share of the pixels that are brighter on the side of greater azimuth, minus the share of the others: in `[-1, 1]`.
    pub polarity: f64,
}

/// What a bearing of a line is a bearing in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineFrame {
    /// The ground normal in the robot frame that was taken for the vertical, a unit vector.
    pub normal: Vector3<f64>,
    /// Where the lines of the radial variant meet, in pixels; none for great circles.
    pub center_px: Option<Vector2<f64>>,
}

impl LineFrame {
    /// The rotation from the upright robot's frame to the robot's.
    pub fn robot_from_upright(&self) -> Matrix3<f64> {
        crate::geometry::Tilt::from_normal(&self.normal)
            .map_or_else(Matrix3::identity, |tilt| tilt.leaning_from_upright())
    }
}

impl Default for LineFrame {
    fn default() -> Self {
        Self { normal: Vector3::z(), center_px: None }
    }
}

/// The lines of one image, by rising bearing, and their frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lines {
    /// The lines.
    pub lines: Vec<Line>,
    /// The frame of their bearings.
    pub frame: LineFrame,
}
