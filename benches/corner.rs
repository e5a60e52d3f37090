//! Corners: the closed form with covariance, the fit of a feature, and the pose before a pair of cameras.

#![allow(clippy::unwrap_used)]

use divan::{Bencher, black_box, counter::ItemsCount};
use nalgebra::{Matrix3, Rotation3, Vector3};
use tiltvp_core::corner::{
    Alignment, CornerFeature, CornerOptions, FittedRay, IncludedAngle, View, corner_attitudes, corner_poses, resolve,
};
use tiltvp_core::geometry::RigidMotion;

/// Corners that are timed in a row, so that none stays in the caches and the branches alone.
const CORNERS: usize = 1000;

fn main() {
    divan::main();
}

/// The rays of a corner, 200 bearings each, a little off the plane of each.
fn bearings(place: usize, shift_m: f64, gamma_rad: f64) -> [Vec<Vector3<f64>>; 3] {
    let t = place as f64;
    let rotation =
        Rotation3::from_euler_angles(0.6 + 0.2 * t.sin(), 0.7 * (1.7 * t).sin(), 0.4 + 0.3 * (2.3 * t).cos());
    let vertex = Vector3::new(0.3 * (0.9 * t).sin() - shift_m, 0.2 * (1.3 * t).cos(), 1.5);
    let edges = [Vector3::x(), -Vector3::y(), Vector3::new(gamma_rad.cos(), 0.0, gamma_rad.sin())];
    edges.map(|edge| {
        let edge = rotation * edge;
        let normal = vertex.cross(&edge).normalize();
        let at = |i: usize| {
            let off = 4e-4 * (12.9898 * (i as f64 + t)).sin();
            ((vertex + edge * (0.002 * (i as f64 + 1.0))).normalize() + normal * off).normalize()
        };
        (0..200).map(at).collect()
    })
}

fn feature(rays: &[Vec<Vector3<f64>>; 3]) -> CornerFeature {
    let fit = |ray: &Vec<Vector3<f64>>| FittedRay::fit(ray, &[4e-4; 200], &ray[199]).unwrap();
    CornerFeature::from_rays([fit(&rays[0]), fit(&rays[1]), fit(&rays[2])]).unwrap()
}

fn features(shift_m: f64, gamma_rad: f64) -> Vec<CornerFeature> {
    (0..CORNERS).map(|place| feature(&bearings(place, shift_m, gamma_rad))).collect()
}

fn pair() -> RigidMotion {
    RigidMotion::new("left_from_right", Matrix3::identity(), Vector3::new(0.12, 0.0, 0.0)).unwrap()
}

/// Every attitude of a corner, both interpretations, with covariance.
#[divan::bench(args = [90.0, 110.0])]
fn closed_form_with_covariance(bencher: Bencher<'_, '_>, gamma_deg: f64) {
    let angle = IncludedAngle::exact(f64::to_radians(gamma_deg));
    let features = features(0.0, angle.gamma_rad);
    bencher.counter(ItemsCount::new(CORNERS)).bench(|| {
        features.iter().map(|feature| corner_attitudes(black_box(feature), &angle).unwrap().len()).sum::<usize>()
    });
}

/// The vertex of three fitted rays.
#[divan::bench]
fn vertex(bencher: Bencher<'_, '_>) {
    let rays: Vec<_> = features(0.0, 1.6).iter().map(|feature| *feature.rays()).collect();
    bencher
        .counter(ItemsCount::new(CORNERS))
        .bench(|| rays.iter().filter_map(|rays| CornerFeature::from_rays(black_box(*rays))).count());
}

/// Three rays of 200 bearings each, and their vertex.
#[divan::bench]
fn fit(bencher: Bencher<'_, '_>) {
    let rays = bearings(0, 0.0, 1.6);
    bencher.bench(|| feature(black_box(&rays)));
}

/// Two features resolved, the vertex triangulated, without or with the fusion of six rays.
#[divan::bench(args = [false, true])]
fn pose_from_pair(bencher: Bencher<'_, '_>, fuse: bool) {
    let options = CornerOptions { fuse, ..CornerOptions::default() };
    let gamma = options.angle.gamma_rad;
    let (left, right, motion) = (features(0.0, gamma), features(0.12, gamma), pair());
    bencher.counter(ItemsCount::new(CORNERS)).bench(|| {
        let both = left.iter().zip(&right);
        both.map(|(left, right)| corner_poses(left, right, &motion, &options).unwrap().len()).sum::<usize>()
    });
}

/// Five features of one image with parallel frames.
#[divan::bench]
fn resolve_five(bencher: Bencher<'_, '_>) {
    let gamma = std::f64::consts::FRAC_PI_2;
    let found: Vec<_> = features(0.0, gamma)[..5]
        .iter()
        .map(|feature| corner_attitudes(feature, &IncludedAngle::RIGHT).unwrap())
        .collect();
    let views: Vec<_> =
        found.iter().map(|attitudes| View { attitudes, common_from_camera: Matrix3::identity() }).collect();
    bencher.bench(|| resolve(black_box(&views), Alignment::Vertical, None, &[]).unwrap());
}
