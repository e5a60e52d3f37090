//! Every lens of the zoo over a batch of pixels, there and back.

#![allow(clippy::unwrap_used)]

use divan::{Bencher, black_box, counter::ItemsCount};
use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};
use tiltvp_core::camera::Camera;
use tiltvp_core::testing::zoo;

fn main() {
    divan::main();
}

const COUNT: usize = 10_000;

fn names() -> Vec<&'static str> {
    zoo().into_iter().map(|(name, _)| name).collect()
}

fn camera(name: &str) -> Camera {
    zoo().into_iter().find(|(own, _)| *own == name).unwrap().1
}

/// Pixels spread evenly over the image (a Kronecker sequence), and the bearings that they see.
fn batch(camera: &Camera) -> (Vec<Vector2<f64>>, Vec<Vector3<f64>>) {
    let (width, height) = (f64::from(camera.width()), f64::from(camera.height()));
    (0..)
        .map(|i| {
            Vector2::new(
                (f64::from(i) * 0.754_877_666).fract() * width,
                (f64::from(i) * 0.569_840_291).fract() * height,
            )
        })
        .filter_map(|pixel| camera.unproject(&pixel).map(|bearing| (pixel, bearing)))
        .take(COUNT)
        .unzip()
}

#[divan::bench(args = names())]
fn project(bencher: Bencher, name: &str) {
    let camera = camera(name);
    let (mut pixels, bearings) = batch(&camera);
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| camera.project_all(black_box(&bearings), &mut pixels));
}

#[divan::bench(args = names())]
fn unproject(bencher: Bencher, name: &str) {
    let camera = camera(name);
    let (pixels, mut bearings) = batch(&camera);
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| camera.unproject_all(black_box(&pixels), &mut bearings));
}

#[divan::bench(args = names())]
fn project_jacobian(bencher: Bencher, name: &str) {
    let camera = camera(name);
    let (mut pixels, bearings) = batch(&camera);
    let mut jacobians = vec![Matrix2x3::zeros(); COUNT];
    bencher
        .counter(ItemsCount::new(COUNT))
        .bench_local(|| camera.project_jacobian_all(black_box(&bearings), &mut pixels, &mut jacobians));
}

#[divan::bench(args = names())]
fn unproject_jacobian(bencher: Bencher, name: &str) {
    let camera = camera(name);
    let (pixels, mut bearings) = batch(&camera);
    let mut jacobians = vec![Matrix3x2::zeros(); COUNT];
    bencher
        .counter(ItemsCount::new(COUNT))
        .bench_local(|| camera.unproject_jacobian_all(black_box(&pixels), &mut bearings, &mut jacobians));
}

/// One at a time: the price of looking the model up for each ray.
#[divan::bench(args = names())]
fn project_singly(bencher: Bencher, name: &str) {
    let camera = camera(name);
    let (_, bearings) = batch(&camera);
    bencher
        .counter(ItemsCount::new(COUNT))
        .bench_local(|| bearings.iter().filter(|bearing| camera.project(black_box(bearing)).is_some()).count());
}
