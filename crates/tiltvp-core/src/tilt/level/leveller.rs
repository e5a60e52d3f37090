//! `Leveller`: level images of one camera, by tables that are made once.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::grid::{Corners, Places};
use super::pixels::{Fill, Map, Source};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geometry::{Tilt, validate_rotation};
use crate::interrupt::check;

/// How far from where it is a pixel may be looked for, in pixels of the leaning image (`maps_are_as_exact_as_they_say`).
pub const MAP_ERROR_PX: f64 = 0.05;

/// Pixels of a level image whose rays are all kept, 50 MB: of larger ones, as panoramas are, those within cells that must be split are
/// made again for each image, which takes little beside so many pixels.
const MOST_RAYS: usize = 1 << 22;

/// What a level image shows: for each pixel the ray in the frame of the upright robot.
///
/// `v_leaning = R^T R_ab v_upright` with `R = robot_from_camera` and `R_ab` of [`Tilt::leaning_from_upright`] finds it in the leaning
/// image. Rays are made once; of a tilt only those at the corners of cells are projected, and places between them interpolated where
/// that is good to [`MAP_ERROR_PX`].
#[derive(Debug, Clone)]
pub struct Leveller {
    camera: Camera,
    robot_from_camera: Matrix3<f64>,
    width: usize,
    height: usize,
    /// Makes the rays that are not kept.
    shown: Option<(Camera, Matrix3<f64>)>,
    /// Of all pixels in row order, NaN where nothing is shown; empty where there are too many.
    rays: Vec<[f32; 3]>,
    corners: Corners,
    corner_rays: Vec<[f32; 3]>,
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
        validate_rotation(robot_from_camera)?;
        validate_rotation(robot_from_shown)?;
        let (width, height) = (shown.width() as usize, shown.height() as usize);
        let mut rays = Vec::new();
        if width * height <= MOST_RAYS {
            shown.check_memory(size_of::<[f32; 3]>())?;
            for v in 0..height {
                check();
                rays.extend((0..width).map(|u| kept(ray_of(&shown, robot_from_shown, [u, v]))));
            }
        }
        let shown = Some((shown, *robot_from_shown));
        Ok(Self::of(camera, *robot_from_camera, [width, height], shown, rays))
    }

    /// Level images whose pixels look along given rays of the robot frame, in row order, of any length; NaN shows nothing.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the mounting is no rotation, or there are not `width * height` rays, at least one.
    pub fn from_rays(
        camera: Camera,
        robot_from_camera: &Matrix3<f64>,
        width: usize,
        rays: Vec<[f32; 3]>,
    ) -> Result<Self> {
        validate_rotation(robot_from_camera)?;
        if rays.is_empty() || width == 0 || !rays.len().is_multiple_of(width) {
            let got = format!("{} in rows of {width}", rays.len());
            return Err(Error::argument("rays", got, "full rows of at least one"));
        }
        let size = [width, rays.len() / width];
        Ok(Self::of(camera, *robot_from_camera, size, None, rays))
    }

    fn of(
        camera: Camera,
        robot_from_camera: Matrix3<f64>,
        [width, height]: [usize; 2],
        shown: Option<(Camera, Matrix3<f64>)>,
        rays: Vec<[f32; 3]>,
    ) -> Self {
        let corners = Corners::new([width, height]);
        let mut made = Self { camera, robot_from_camera, width, height, shown, rays, corner_rays: Vec::new(), corners };
        made.corner_rays = made.corners.pixels().map(|pixel| kept(made.ray(pixel))).collect();
        made
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
        self.width
    }

    /// Rows of level images.
    pub fn height(&self) -> usize {
        self.height
    }

    /// A level image, in row order without gaps, from one of the camera of as many channels; black where nothing was seen.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless there are one or three channels, and bytes for all pixels of the camera.
    pub fn level(&self, image: &[u8], channels: usize, tilt: &Tilt) -> Result<Vec<u8>> {
        let (width, height) = (self.camera.width() as usize, self.camera.height() as usize);
        if ![1, 3].contains(&channels) || image.len() != width * height * channels {
            let got = format!("{} bytes of {channels} channels", image.len());
            return Err(Error::argument(
                "image",
                got,
                format!("{height} rows of {width} pixels of one or three bytes"),
            ));
        }
        let mut out = vec![0; self.width * self.height * channels];
        match channels {
            1 => self.fill::<1>(image, tilt, &mut out),
            _ => self.fill::<3>(image, tilt, &mut out),
        }
        Ok(out)
    }

    fn fill<const CHANNELS: usize>(&self, data: &[u8], tilt: &Tilt, out: &mut [u8]) {
        let (width, height) = (self.camera.width() as usize, self.camera.height() as usize);
        let places = self.places(tilt);
        let source = Source::<CHANNELS> { data, width, height, is_round: places.period.is_some() };
        self.corners.walk(
            &self.corner_rays,
            &|pixel| self.ray(pixel),
            &places,
            &mut Fill { source, out, width: self.width },
        );
    }

    /// For each pixel of the level image, in row order, the pixel `(u, v)` of the leaning image that shows the same direction; NaN
    /// where there is none.
    pub fn map(&self, tilt: &Tilt) -> Vec<[f32; 2]> {
        let places = self.places(tilt);
        let mut out = vec![[f32::NAN; 2]; self.width * self.height];
        let mut map = Map { out: &mut out, width: self.width, period: places.period };
        self.corners.walk(&self.corner_rays, &|pixel| self.ray(pixel), &places, &mut map);
        out
    }

    fn places(&self, tilt: &Tilt) -> Places<'_> {
        Places::new(&self.camera, self.robot_from_camera.transpose() * tilt.leaning_from_upright())
    }

    /// Where a pixel looks in the frame of the upright robot.
    fn ray(&self, [u, v]: [usize; 2]) -> Option<Vector3<f64>> {
        match (self.rays.get(v * self.width + u), &self.shown) {
            (Some(ray), _) => ray[0].is_finite().then(|| Vector3::from(ray.map(f64::from))),
            (None, Some((shown, robot_from_shown))) => ray_of(shown, robot_from_shown, [u, v]),
            (None, None) => None,
        }
    }
}

fn ray_of(shown: &Camera, robot_from_shown: &Matrix3<f64>, [u, v]: [usize; 2]) -> Option<Vector3<f64>> {
    shown.unproject(&Vector2::new(u as f64, v as f64)).map(|ray| robot_from_shown * ray)
}

/// A ray as it is kept: numbers of 24 bits are good to a hundredth of a pixel in any image.
fn kept(ray: Option<Vector3<f64>>) -> [f32; 3] {
    ray.map_or([f32::NAN; 3], |ray| [ray.x as f32, ray.y as f32, ray.z as f32])
}
