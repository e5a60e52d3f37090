//! A vertical line of one image, and all lines of it with the frame that their bearings are in.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geometry::unit;

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
    /// The [`fingerprint`] of the camera and the mounting that the lines were found with; none where that is not known.
    pub seen_by: Option<u32>,
}

impl LineFrame {
    /// The rotation from the upright robot's frame to the robot's.
    pub fn robot_from_upright(&self) -> Matrix3<f64> {
        crate::geometry::Tilt::from_normal(&self.normal)
            .map_or_else(Matrix3::identity, |tilt| tilt.leaning_from_upright())
    }

    /// Whether the camera and the mounting of that [`fingerprint`] see the lines of this frame where they are.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if they were found with others.
    pub fn check_seen_by(&self, fingerprint: u32) -> Result<()> {
        if self.seen_by.is_none_or(|own| own == fingerprint) {
            return Ok(());
        }
        let expected = "lines that were found with the same camera and mounting";
        Err(Error::argument("lines", "lines of another camera or mounting", expected))
    }
}

impl Lines {
    /// Whether all bearings are angles, and known as well as angles can be, all elevations are angles, all polarities are from -1 to 1,
    /// and the ground normal is a direction.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for others.
    pub fn check(&self) -> Result<()> {
        let normal = &self.frame.normal;
        if unit(normal).is_none() {
            return Err(Error::argument("lines", format!("a ground normal of {normal:?}"), "a finite one"));
        }
        let is_line = |line: &Line| {
            let angles = [line.bearing_rad, line.elevation_min_rad, line.elevation_max_rad];
            let known = (0.0..=PI).contains(&line.sigma_rad);
            known && angles.iter().all(|angle| angle.is_finite()) && line.polarity.abs() <= 1.0
        };
        match self.lines.iter().find(|line| !is_line(line)) {
            Some(line) => {
                let expected = "finite bearings, known to 0 to pi, and elevations, and polarities from -1 to 1";
                Err(Error::argument("lines", format!("{line:?}"), expected))
            }
            None => Ok(()),
        }
    }

    /// Whether they are lines of what is perhaps known to have found others, where `ordered` by rising bearing.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), and [`Error::InvalidArgument`] for another camera, mounting or order.
    pub(super) fn check_after(&self, seen_by: Option<u32>, ordered: bool) -> Result<()> {
        self.check()?;
        if ordered && !self.lines.is_sorted_by(|a, b| a.bearing_rad <= b.bearing_rad) {
            return Err(Error::argument("lines", "bearings in another order", "lines by rising bearing"));
        }
        seen_by.map_or(Ok(()), |seen_by| self.frame.check_seen_by(seen_by))
    }
}

/// A number that tells a camera and its mounting from others, by what pixels all over the image see, to a millionth.
///
/// Images of another size are the same to great circles; radial lines meet in a pixel.
pub fn fingerprint(camera: &Camera, robot_from_camera: &Matrix3<f64>, is_radial: bool) -> u32 {
    const STEPS: u32 = 16;
    let size = if is_radial { [camera.width(), camera.height()] } else { [0; 2] };
    let place = |i: u32, side: u32| (f64::from(i) + 0.5) / f64::from(STEPS) * f64::from(side) - 0.5;
    let rays = (0..STEPS * STEPS).flat_map(|i| {
        let pixel = Vector2::new(place(i % STEPS, camera.width()), place(i / STEPS, camera.height()));
        let ray = camera.unproject(&pixel).map_or_else(Vector3::zeros, |ray| robot_from_camera * ray);
        [ray.x, ray.y, ray.z].map(|x| (x * 1e6).round() as i32 as u32)
    });
    // Fowler, Noll and Vo's hash (FNV-1a), of words.
    size.into_iter()
        .chain(rays)
        .fold(0x811c_9dc5, |hash: u32, word| (hash ^ word).wrapping_mul(0x0100_0193).rotate_left(5))
}

impl Default for LineFrame {
    fn default() -> Self {
        Self { normal: Vector3::z(), center_px: None, seen_by: None }
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
