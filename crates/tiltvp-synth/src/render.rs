//! Ray casting a world through a lens.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use tiltvp_core::geometry::{Tilt, angle_between};
use tiltvp_core::interrupt::check;
use tiltvp_core::{Error, Result};

use crate::noise::hash_unit;
use crate::segment::Segment;
use crate::tone::{Film, Image, RenderOptions};
use crate::view::{LARGEST_SIDE_PX, RobotPose, View};
use crate::world::World;

/// What is known of a rendered image.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The robot's tilt.
    pub tilt: Tilt,
    /// Where the robot stood.
    pub pose: RobotPose,
    /// The camera's centre in the world, metres.
    pub center: Vector3<f64>,
    /// Rotation from camera to world coordinates.
    pub world_from_camera: Matrix3<f64>,
    /// The world's vertical edges, world frame, whether visible from here or not.
    pub vertical_edges: Vec<Segment>,
}

/// An image and the truth behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendering {
    /// The image.
    pub image: Image,
    /// The truth.
    pub truth: Truth,
}

/// Renders a view of a world.
///
/// The direction of a pixel's ray in the world is `Rz(yaw) R_tilt^T robot_from_camera bearing`. Rows are rendered in parallel on
/// the current rayon pool; the bytes do not depend on it.
///
/// # Errors
/// If the options or the view are outside their domains, or the camera is outside the room.
pub fn render(world: &World, view: &View<'_>, options: &RenderOptions) -> Result<Rendering> {
    options.validate()?;
    let center = world.center_of(view)?;
    let world_from_camera = view.world_from_camera();
    let (width, height, n) = (view.width_px, view.height_px, options.samples);
    let seed = (options.seed ^ (options.seed >> 32)) as u32;

    let mut light = vec![[0f32; 3]; width * height];
    let mut valid = vec![false; width * height];
    light.par_chunks_mut(width).zip(valid.par_chunks_mut(width)).enumerate().for_each(|(y, (row, valid_row))| {
        for x in 0..width {
            check();
            let pixel_angle = pixel_angle(view, x as f64, y as f64) / n as f64;
            let mut sum = [0.0; 3];
            for k in 0..n * n {
                let place = |cell: usize, axis: u32| {
                    let jitter = hash_unit((y * width + x) as i64, k as i64, seed.wrapping_add(axis));
                    (cell as f64 + jitter) / n as f64 - 0.5
                };
                let (px, py) = (x as f64 + place(k % n, 1), y as f64 + place(k / n, 2));
                let Some(bearing) = view.lens.bearing(px, py) else { continue };
                valid_row[x] = true;
                let color = world.radiance(&center, &(world_from_camera * bearing), pixel_angle);
                let off_axis = bearing.xy().norm().atan2(bearing.z) / std::f64::consts::FRAC_PI_2;
                let kept = (1.0 - options.vignetting * off_axis * off_axis).max(0.0) / (n * n) as f64;
                for c in 0..3 {
                    sum[c] += color[c] * kept;
                }
            }
            row[x] = sum.map(|c| c as f32);
        }
    });
    let image = Film { width, light, valid }.develop(options);
    let truth = Truth {
        tilt: view.tilt,
        pose: view.pose,
        center,
        world_from_camera,
        vertical_edges: world.vertical_edges().to_vec(),
    };
    Ok(Rendering { image, truth })
}

/// Renders the levelled equirectangular panorama around a place: `2 height_px` by `height_px` pixels, the zenith in the top
/// row, the robot's front in the middle column, its left to the left.
///
/// # Errors
/// As [`render`].
pub fn render_panorama(
    world: &World,
    pose: RobotPose,
    camera_height_m: f64,
    height_px: usize,
    options: &RenderOptions,
) -> Result<Rendering> {
    if !(1..=LARGEST_SIDE_PX / 2).contains(&height_px) {
        return Err(Error::argument("height", height_px, format!("pixels in [1, {}]", LARGEST_SIDE_PX / 2)));
    }
    let step = std::f64::consts::PI / height_px as f64;
    let lens = |x: f64, y: f64| {
        let (azimuth, elevation) = (step * (height_px as f64 - 0.5 - x), step * (0.5 * (height_px as f64 - 1.0) - y));
        let (s, c) = elevation.sin_cos();
        Some(Vector3::new(c * azimuth.cos(), c * azimuth.sin(), s))
    };
    let view = View { camera_height_m, ..View::new(&lens, 2 * height_px, height_px, pose) };
    render(world, &view, &RenderOptions { vignetting: 0.0, ..options.clone() })
}

/// The angle between a pixel's ray and its neighbour's, radians; 0 at the rim, where there is no neighbour.
fn pixel_angle(view: &View<'_>, x: f64, y: f64) -> f64 {
    match (view.lens.bearing(x, y), view.lens.bearing(x + 1.0, y)) {
        (Some(a), Some(b)) => angle_between(&a, &b),
        _ => 0.0,
    }
}
