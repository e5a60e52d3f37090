//! `Leveller`: where pixels of level images of one camera are in its own, by tables that are made once.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix3;

use super::grid::{Corners, Found};
use super::places::Places;
use super::shown::Shown;
use super::strip::Strip;
use super::surface::CELL;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geometry::{Tilt, validate_rotation};

/// How far from where it is a pixel may be looked for, in pixels of the leaning image (`maps_are_as_exact_as_they_say`).
pub const MAP_ERROR_PX: f64 = 0.05;

/// Pixels whose map is made together: its 0.5 MB stay in a second cache while levels are taken.
const STRIP: usize = 1 << 16;

/// Maps from level images of one camera to its own.
///
/// `v_leaning = R^T R_ab v_upright` with `R = robot_from_camera` and `R_ab` of [`Tilt::leaning_from_upright`] finds a ray in the leaning
/// image. Rays are made once; of a tilt only those at the corners of cells are projected, and places between them interpolated where
/// that is good to [`MAP_ERROR_PX`].
#[derive(Debug, Clone)]
pub struct Leveller {
    camera: Camera,
    robot_from_camera: Matrix3<f64>,
    shown: Shown,
    corners: Corners,
}

impl Leveller {
    /// Level images as another camera would take them on the upright robot, or the same.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if a mounting is no rotation, [`Error::InvalidCamera`] where the memory does not suffice.
    pub fn new(
        camera: Camera,
        robot_from_camera: &Matrix3<f64>,
        shown: Camera,
        robot_from_shown: &Matrix3<f64>,
    ) -> Result<Self> {
        Self::of(camera, robot_from_camera, Shown::by(shown, robot_from_shown)?)
    }

    /// Level images whose pixels look along given rays of the robot frame, in row order, unit vectors; NaN shows nothing.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the mounting is no rotation, a ray no unit vector, or there are not `width * height` rays, at
    /// least one.
    pub fn from_rays(
        camera: Camera,
        robot_from_camera: &Matrix3<f64>,
        width: usize,
        rays: &[[f32; 3]],
    ) -> Result<Self> {
        Self::of(camera, robot_from_camera, Shown::of(rays, width)?)
    }

    fn of(camera: Camera, robot_from_camera: &Matrix3<f64>, shown: Shown) -> Result<Self> {
        validate_rotation(robot_from_camera)?;
        let corners = Corners::new(&shown, &camera);
        Ok(Self { camera, robot_from_camera: *robot_from_camera, shown, corners })
    }

    /// Whose images are made level.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// How it sits on the robot.
    pub fn robot_from_camera(&self) -> &Matrix3<f64> {
        &self.robot_from_camera
    }

    /// Columns of level images.
    pub fn width(&self) -> usize {
        self.shown.size[0]
    }

    /// Rows of level images.
    pub fn height(&self) -> usize {
        self.shown.size[1]
    }

    /// The map of level images by one tilt.
    pub fn map(self: &Arc<Self>, tilt: &Tilt) -> LevelMap {
        let rotation = self.robot_from_camera.transpose() * tilt.leaning_from_upright();
        let found = self.corners.found(&self.shown, &Places::new(&self.camera, rotation));
        LevelMap { leveller: Arc::clone(self), rotation, found }
    }
}

/// Where the pixels of a level image are in the leaning one, row by row: what remapping takes, as OpenCV's `remap` does.
#[derive(Debug, Clone)]
pub struct LevelMap {
    leveller: Arc<Leveller>,
    /// Takes rays of the level image to those of the camera.
    rotation: Matrix3<f64>,
    found: Found,
}

impl LevelMap {
    /// Pixels in each row.
    pub fn width(&self) -> usize {
        self.leveller.width()
    }

    /// Pixels of each column.
    pub fn height(&self) -> usize {
        self.leveller.height()
    }

    /// Rows that are written together: those of whole cells, about 65,536 pixels.
    pub fn strip_rows(&self) -> usize {
        (STRIP / (CELL * self.width())).max(1) * CELL
    }

    /// Writes the strip of that number: for the pixels of its rows, in row order, the column and the row of the pixel of the leaning
    /// image that shows the same direction, or twice `unseen`. It has [`strip_rows`](Self::strip_rows), or those that are left. Only
    /// the columns that are returned are written: nothing is seen beside them.
    ///
    /// They are from 0 to the last column and row, between which levels are to be interpolated. Right of a panorama's last column is
    /// its first one.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if either of `places` has not as many numbers as the strip has pixels.
    pub fn write_strip(&self, number: usize, places: [&mut [f32]; 2], unseen: f32) -> Result<Range<usize>> {
        let [first, end] = [number, number.saturating_add(1)]
            .map(|number| number.saturating_mul(self.strip_rows()).min(self.height()));
        let pixels = (end - first) * self.width();
        let given = places.each_ref().map(|numbers| numbers.len());
        if given != [pixels; 2] {
            let expected = format!("{pixels} each, the pixels of strip {number}");
            return Err(Error::argument("places", format!("{given:?} numbers"), expected));
        }
        let leveller = &*self.leveller;
        let mut strip = Strip::new(first..end, places, self.width(), &leveller.camera, unseen);
        let camera = Places::new(&leveller.camera, self.rotation);
        Ok(leveller.corners.write(&self.found, &leveller.shown, &camera, &mut strip))
    }
}
