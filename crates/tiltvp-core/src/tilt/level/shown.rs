//! What a level image shows: for each pixel the ray in the frame of the upright robot.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::surface::CELL;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geometry::validate_rotation;
use crate::interrupt::check;

/// Pixels of a level image whose rays are all kept, 50 MB: of larger ones, as panoramas are, those within cells that must be split are
/// made again for each image, which takes little beside so many pixels.
const MOST_RAYS: usize = 1 << 22;

/// How far the length of a ray may be off 1, as numbers in few digits are.
const LENGTH_OFF: f32 = 1e-3;

/// Rays by pixel, made once.
#[derive(Debug, Clone)]
pub(super) struct Shown {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// Makes the rays that are not kept, and how it looks.
    camera: Option<(Camera, Matrix3<f64>)>,
    /// Of all pixels in row order, by coordinates, NaN where nothing is shown; empty where there are too many.
    rays: [Vec<f32>; 3],
}

impl Shown {
    /// What a camera shows.
    pub(super) fn by(camera: Camera, robot_from_camera: &Matrix3<f64>) -> Result<Self> {
        validate_rotation(robot_from_camera)?;
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let is_kept = width * height <= MOST_RAYS;
        if is_kept {
            camera.check_memory(size_of::<[f32; 3]>())?;
        }
        let mut made = Self {
            size: [width, height],
            camera: Some((camera, *robot_from_camera)),
            rays: <[Vec<f32>; 3]>::default(),
        };
        if is_kept {
            let mut rays = [(); 3].map(|()| vec![f32::NAN; width * height]);
            for v in 0..height {
                check();
                made.write_row([0, v], rays.each_mut().map(|values| &mut values[v * width..][..width]));
            }
            made.rays = rays;
        }
        Ok(made)
    }

    /// Given rays, unit vectors or NaN, in rows of `width`.
    pub(super) fn of(rays: &[[f32; 3]], width: usize) -> Result<Self> {
        if rays.is_empty() || width == 0 || !rays.len().is_multiple_of(width) {
            let got = format!("{} in rows of {width}", rays.len());
            return Err(Error::argument("rays", got, "full rows of at least one"));
        }
        let is_unit = |ray: &[f32; 3]| (Vector3::from(*ray).norm() - 1.0).abs() < LENGTH_OFF;
        if let Some(at) = rays.iter().position(|ray| !(is_unit(ray) || ray.iter().all(|x| x.is_nan()))) {
            let got = format!("{:?} in row {at}", rays[at]);
            return Err(Error::argument("rays", got, "unit vectors, or NaN where nothing is shown"));
        }
        let height = rays.len() / width;
        let rays = [0, 1, 2].map(|axis| rays.iter().map(|ray| ray[axis]).collect());
        Ok(Self { size: [width, height], camera: None, rays })
    }

    /// Where a pixel looks; none where it shows nothing.
    pub(super) fn ray(&self, [u, v]: [usize; 2]) -> Option<Vector3<f64>> {
        let ([x, y, z], at) = (&self.rays, v * self.size[0] + u);
        match (x.get(at), &self.camera) {
            (Some(x), _) => x.is_finite().then(|| Vector3::from([*x, y[at], z[at]].map(f64::from))),
            (None, Some((camera, turn))) => camera.unproject(&place([u, v])).map(|ray| turn * ray),
            (None, None) => None,
        }
    }

    /// Writes where pixels of a row look from one on, by coordinates, NaN where they show nothing.
    fn write_row(&self, [first, v]: [usize; 2], rays: [&mut [f32]; 3]) {
        let [x, y, z] = rays;
        for (k, ((x, y), z)) in x.iter_mut().zip(y).zip(z).enumerate() {
            // Numbers of 24 bits are good to a hundredth of a pixel in any image.
            let ray = self.ray([first + k, v]).map_or([f32::NAN; 3], |ray| [ray.x as f32, ray.y as f32, ray.z as f32]);
            (*x, *y, *z) = (ray[0], ray[1], ray[2]);
        }
    }

    /// Where the pixels of a cell look, by coordinates, NaN where they show nothing; and how many numbers there are from one row to the
    /// next. Those that are not kept are made.
    pub(super) fn rays<'a>(
        &'a self,
        [u, v]: [usize; 2],
        [columns, rows]: [usize; 2],
        made: &'a mut [[f32; CELL * CELL]; 3],
    ) -> ([&'a [f32]; 3], usize) {
        if self.rays[0].is_empty() {
            for row in 0..rows {
                self.write_row([u, v + row], made.each_mut().map(|values| &mut values[row * CELL..][..columns]));
            }
            return (made.each_ref().map(|values| &values[..]), CELL);
        }
        (self.rays.each_ref().map(|values| &values[v * self.size[0] + u..]), self.size[0])
    }

    /// Where it would look without the limit of the camera's field of view, too: what is interpolated does not end there.
    pub(super) fn unlimited_ray(&self, pixel: [usize; 2]) -> Option<Vector3<f64>> {
        let beyond = || {
            let (camera, turn) = self.camera.as_ref()?;
            camera.unproject_unlimited(&place(pixel)).map(|ray| turn * ray)
        };
        self.ray(pixel).or_else(beyond)
    }
}

fn place([u, v]: [usize; 2]) -> Vector2<f64> {
    Vector2::new(u as f64, v as f64)
}
