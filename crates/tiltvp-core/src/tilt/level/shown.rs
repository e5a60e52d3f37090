//! What a level image shows: for each pixel the ray in the frame of the upright robot.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geometry::validate_rotation;
use crate::interrupt::check;

/// Pixels of a level image whose rays are all kept, 50 MB: of larger ones, as panoramas are, those within cells that must be split are
/// made again for each image, which takes little beside so many pixels.
const MOST_RAYS: usize = 1 << 22;

/// Rays by pixel, made once.
#[derive(Debug, Clone)]
pub(super) struct Shown {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// Makes the rays that are not kept, and how it looks.
    camera: Option<(Camera, Matrix3<f64>)>,
    /// Of all pixels in row order, NaN where nothing is shown; empty where there are too many.
    rays: Vec<[f32; 3]>,
}

impl Shown {
    /// What a camera shows.
    pub(super) fn by(camera: Camera, robot_from_camera: &Matrix3<f64>) -> Result<Self> {
        validate_rotation(robot_from_camera)?;
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let mut rays = Vec::new();
        if width * height <= MOST_RAYS {
            camera.check_memory(size_of::<[f32; 3]>())?;
            for v in 0..height {
                check();
                rays.extend(
                    (0..width).map(|u| kept(camera.unproject(&place([u, v])).map(|ray| robot_from_camera * ray))),
                );
            }
        }
        Ok(Self { size: [width, height], camera: Some((camera, *robot_from_camera)), rays })
    }

    /// Given rays, in rows of `width`.
    pub(super) fn of(rays: Vec<[f32; 3]>, width: usize) -> Result<Self> {
        if rays.is_empty() || width == 0 || !rays.len().is_multiple_of(width) {
            let got = format!("{} in rows of {width}", rays.len());
            return Err(Error::argument("rays", got, "full rows of at least one"));
        }
        Ok(Self { size: [width, rays.len() / width], camera: None, rays })
    }

    /// Where a pixel looks; none where it shows nothing.
    pub(super) fn ray(&self, [u, v]: [usize; 2]) -> Option<Vector3<f64>> {
        match (self.rays.get(v * self.size[0] + u), &self.camera) {
            (Some(ray), _) => ray[0].is_finite().then(|| Vector3::from(ray.map(f64::from))),
            (None, Some((camera, turn))) => camera.unproject(&place([u, v])).map(|ray| turn * ray),
            (None, None) => None,
        }
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

/// A ray as it is kept: numbers of 24 bits are good to a hundredth of a pixel in any image.
fn kept(ray: Option<Vector3<f64>>) -> [f32; 3] {
    ray.map_or([f32::NAN; 3], |ray| [ray.x as f32, ray.y as f32, ray.z as f32])
}
