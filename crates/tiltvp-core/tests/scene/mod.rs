//! Images made from formulas: worlds of vertical stripes at infinity seen through any camera, and images of nothing.

#![allow(dead_code)]

pub(crate) mod cube;
pub(crate) mod round;

use nalgebra::{Matrix3, Vector2, Vector3};
use tiltvp_core::camera::{Camera, Equidistant, Model, Parameter};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::image::ImageView;

/// A grey image in row order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Image {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<u8>,
}

impl Image {
    /// An image of the camera's size, pixel by pixel.
    pub(crate) fn of(camera: &Camera, mut level: impl FnMut(usize, usize) -> f64) -> Self {
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let data = (0..width * height).map(|i| level(i % width, i / width).round().clamp(0.0, 255.0) as u8).collect();
        Self { width, height, data }
    }

    pub(crate) fn view(&self) -> ImageView<'_> {
        ImageView::new(&self.data, self.width, self.height, self.width).unwrap()
    }
}

/// A well mixed 64-bit number (Steele, Lea and Flood 2014).
pub(crate) fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1) for each seed and index.
pub(crate) fn random(seed: u64, index: u64) -> f64 {
    (mix(mix(seed) ^ index) >> 11) as f64 / (1u64 << 53) as f64
}

/// A 185-degree equidistant fisheye whose whole circle is in the image.
pub(crate) fn fisheye(side: u32) -> Camera {
    let middle = 0.5 * f64::from(side) - 0.5;
    let lens = Equidistant::new(0.46 * f64::from(side) / 92.5f64.to_radians(), middle, middle).unwrap();
    Camera::new(side, side, Model::Equidistant(lens)).unwrap().with_max_theta_rad(92.5f64.to_radians()).unwrap()
}

/// White noise over all grey levels.
pub(crate) fn noise(camera: &Camera, seed: u64) -> Image {
    let width = u64::from(camera.width());
    Image::of(camera, |u, v| 256.0 * random(seed, v as u64 * width + u as u64) - 0.5)
}

/// One grey level.
pub(crate) fn constant(camera: &Camera, level: f64) -> Image {
    Image::of(camera, |_, _| level)
}

/// A world of `count` vertical stripes at infinity, of random widths and grey levels, with noise of `sigma` grey levels,
/// seen by a leaning robot; what the lens does not see is black.
pub(crate) fn stripes(
    camera: &Camera,
    robot_from_camera: &Matrix3<f64>,
    tilt: &Tilt,
    count: usize,
    sigma: f64,
    seed: u64,
) -> Image {
    let world_from_camera = tilt.leaning_from_upright().transpose() * robot_from_camera;
    let level = |stripe: usize| 60.0 + 140.0 * random(seed, stripe as u64);
    let edges: Vec<f64> = (0..count)
        .map(|i| (i as f64 + 0.8 * random(seed + 1, i as u64)) / count as f64 * std::f64::consts::TAU)
        .collect();
    let radiance = |bearing: &Vector3<f64>, blur_rad: f64| {
        let azimuth = bearing.y.atan2(bearing.x).rem_euclid(std::f64::consts::TAU);
        let next = edges.partition_point(|edge| *edge <= azimuth);
        let (left, right) = ((next + count - 1) % count, next % count);
        let apart = |edge: f64| {
            let turn = (azimuth - edge).abs();
            turn.min(std::f64::consts::TAU - turn) * bearing.xy().norm() / blur_rad
        };
        // Half of the step on either side of an edge, so that it is soft by about a pixel and exactly where it should be.
        let (own, l, r) = (level(left), level((left + count - 1) % count), level(right));
        let share = |distance: f64| 0.5 * (1.0 - distance.min(1.0));
        own + share(apart(edges[left])) * (l - own) + share(apart(edges[right])) * (r - own)
    };
    Image::of(camera, |u, v| {
        let pixel = Vector2::new(u as f64, v as f64);
        let Some((bearing, jacobian)) = camera.unproject_jacobian(&pixel) else { return 0.0 };
        let place = (v * camera.width() as usize + u) as u64;
        let gauss = (0..4).map(|k| random(seed + 2 + k, place) - 0.5).sum::<f64>() * 3f64.sqrt();
        radiance(&(world_from_camera * bearing), jacobian.norm()) + sigma * gauss
    })
}

/// The same lens over an image of at most `side` pixels a side: what is in pixels shrinks with it.
pub(crate) fn shrunk(camera: &Camera, side: u32) -> Camera {
    let factor = f64::from(side) / f64::from(camera.width().max(camera.height()));
    let size = |side: u32| (f64::from(side) * factor).round() as u32;
    let (width, height) = (size(camera.width()), size(camera.height()));
    let name = camera.model().name();
    let mut parameters: Vec<_> =
        camera.model().parameters().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    for (key, value) in &mut parameters {
        match (key.as_str(), value) {
            ("cx" | "cy" | "fx" | "fy" | "focal_px" | "skew", Parameter::Scalar(x)) => *x *= factor,
            ("k1" | "k2" | "k3" | "k4", Parameter::Scalar(x)) if name == "radial_polynomial" => *x *= factor,
            ("polynomial", Parameter::List(list)) => {
                for (i, a) in list.iter_mut().enumerate() {
                    *a *= factor.powi(1 - i as i32);
                }
            }
            ("inverse_polynomial", Parameter::List(list)) => list.iter_mut().for_each(|a| *a *= factor),
            _ => {}
        }
    }
    let model = Model::from_parameters(name, width, height, &parameters).unwrap();
    let small = Camera::new(width, height, model).unwrap();
    let small = small.with_max_theta_rad(camera.max_theta_rad()).unwrap();
    if camera.is_mirrored() { small.mirrored() } else { small }
}
