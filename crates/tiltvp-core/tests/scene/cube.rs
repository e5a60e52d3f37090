//! A cube with a red, a green and a blue face before a pinhole camera, from a formula.

use nalgebra::{Rotation3, Vector3};
use tiltvp_core::camera::{Camera, Model, Pinhole};
use tiltvp_core::image::ColorView;

/// Metres to a side.
const SIDE_M: f64 = 0.3;

/// Rays per pixel and side.
const RAYS: usize = 2;

/// Blue, green and red of the upper, the left and the right face, and of the wall behind.
const COLOURS: [[f64; 3]; 4] = [[40.0, 40.0, 190.0], [34.0, 128.0, 34.0], [133.0, 35.0, 28.0], [150.0, 152.0, 149.0]];

/// A camera of 320 x 180 pixels.
pub(crate) fn pinhole() -> Camera {
    Camera::new(320, 180, Model::Pinhole(Pinhole::new([175.5; 2], [159.5, 89.5], &[]).unwrap())).unwrap()
}

/// Blue, green and red bytes of what [`pinhole`] sees from so far to the right of a place 0.8 m before the cube's corner.
pub(crate) fn cube(right_m: f64) -> Vec<u8> {
    let camera = pinhole();
    let turn =
        Rotation3::from_axis_angle(&Vector3::x_axis(), 0.5) * Rotation3::from_axis_angle(&Vector3::y_axis(), -0.7);
    let corner = turn.inverse() * Vector3::new(-right_m, -0.05, 0.8);
    // The faces in the cube's own frame, which has its corner at the origin: y = 0, x = 0 and z = 0.
    let colour = |ray: Vector3<f64>| {
        let ray = turn.inverse() * ray;
        let hit = |axis: usize| {
            let depth = corner[axis] / ray[axis];
            let place = ray * depth - corner;
            let within = (0..3).all(|other| other == axis || (0.0..=SIDE_M).contains(&place[other]));
            (depth > 0.0 && within).then_some(depth)
        };
        let nearest = [1, 0, 2].map(hit).into_iter().zip(COLOURS).filter_map(|(depth, colour)| Some((depth?, colour)));
        nearest.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(COLOURS[3], |(_, colour)| colour)
    };
    let mut bytes = Vec::new();
    for v in 0..camera.height() {
        for u in 0..camera.width() {
            let mut sum = [0.0; 3];
            for part in 0..RAYS * RAYS {
                let off = |k: usize| (k as f64 + 0.5) / RAYS as f64 - 0.5;
                let (x, y) = (f64::from(u) + off(part % RAYS), f64::from(v) + off(part / RAYS));
                let found = colour(Vector3::new((x - 159.5) / 175.5, (y - 89.5) / 175.5, 1.0));
                sum.iter_mut().zip(found).for_each(|(sum, level)| *sum += level);
            }
            bytes.extend(sum.map(|sum| (sum / (RAYS * RAYS) as f64).round() as u8));
        }
    }
    bytes
}

/// The bytes as an image.
pub(crate) fn view(bytes: &[u8]) -> ColorView<'_> {
    ColorView::new(bytes, 320, 180, 3 * 320).unwrap()
}

/// The bytes of the wall alone.
pub(crate) fn wall() -> Vec<u8> {
    COLOURS[3].map(|level| level as u8).repeat(320 * 180)
}

/// Where [`pinhole`] sees a place.
pub(crate) fn project(place_m: Vector3<f64>) -> nalgebra::Vector2<f64> {
    pinhole().project(&place_m).unwrap()
}
