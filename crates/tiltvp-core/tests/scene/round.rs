//! A drive in a circle among posts, without noise but for what a table of random adds.

use nalgebra::Vector2;
use tiltvp_core::selfcalib::WheelMotion;

use super::random;

/// Metres between the wheels.
pub(crate) const WHEEL_BASE_M: f64 = 0.4;

/// For each step what the wheels report, and the bearing of each of `posts` posts, radians.
pub(crate) fn drive(posts: usize, steps: usize) -> Vec<(WheelMotion, Vec<f64>)> {
    let place = |post: usize| {
        let (distance, angle) = (2.0 + 3.0 * random(1, post as u64), std::f64::consts::TAU * random(2, post as u64));
        Vector2::new(angle.cos(), angle.sin()) * distance
    };
    let (distance, turn) = (0.04, 0.04);
    let step = |step: usize| {
        let heading = turn * (step + 1) as f64;
        let robot = Vector2::new(heading.sin(), 1.0 - heading.cos()) * (distance / turn);
        let camera = robot + Vector2::new(heading.cos(), heading.sin()) * 0.25;
        let bearings = (0..posts).map(|post| {
            let ray = place(post) - camera;
            let noise = 0.01 * (random(3, (step * posts + post) as u64) - 0.5);
            tiltvp_core::geometry::wrap_angle(ray.y.atan2(ray.x) - heading + noise)
        });
        (WheelMotion::from_motion(distance, turn, WHEEL_BASE_M), bearings.collect())
    };
    (0..steps).map(step).collect()
}
