//! Tables of pixels, which ask the lens at few of them, are those of the lens at each, for every lens of the zoo.

#![allow(clippy::unwrap_used)]

use nalgebra::{Matrix3, Matrix3x2, Rotation3, Vector2, Vector3};
use tiltvp_core::camera::Camera;
use tiltvp_core::edges::{EdgeOptions, LiftTable, NormalKind, Region};
use tiltvp_core::testing;

/// Sines of elevations within this of a limit may be on either side of it.
const SINE: f64 = 2e-6;

fn at((u, v): (usize, usize)) -> Vector2<f64> {
    Vector2::new(u as f64, v as f64)
}

/// A robot's camera that is turned somehow, and edges of all elevations, which are looked for without a margin.
fn setting() -> (Matrix3<f64>, EdgeOptions) {
    let options = EdgeOptions {
        elevation_min_rad: -0.4,
        elevation_max_rad: 1.1,
        smoothing_px: 0.0,
        margin_px: 0.0,
        ..EdgeOptions::default()
    };
    (Rotation3::from_euler_angles(0.3, -0.2, 1.1).into_inner(), options)
}

#[test]
fn regions_have_the_pixels_of_the_band_about_which_the_world_is_seen() {
    let (rotation, options) = setting();
    let band = options.elevation_min_rad.sin()..=options.elevation_max_rad.sin();
    for (name, camera) in testing::zoo() {
        let Ok(region) = Region::new(&camera, &rotation, &options, None) else { panic!("{name}") };
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let seen: Vec<_> = (0..width * height).map(|i| camera.unproject(&at((i % width, i / width)))).collect();
        let mut inside = vec![false; seen.len()];
        region.places().for_each(|(u, v)| inside[v * width + u] = true);
        for (i, bearing) in seen.iter().enumerate() {
            let (u, v) = (i % width, i / width);
            let is_whole = (1..width - 1).contains(&u) && (1..height - 1).contains(&v);
            let is_whole = is_whole && (v - 1..=v + 1).all(|v| (u - 1..=u + 1).all(|u| seen[v * width + u].is_some()));
            let sine = bearing.map_or(f64::NAN, |bearing: Vector3<f64>| (rotation * bearing).z);
            if [band.start(), band.end()].iter().all(|limit| (sine - *limit).abs() > SINE) || !is_whole {
                assert_eq!(inside[i], is_whole && band.contains(&sine), "{name} at {u}, {v}");
            }
        }
    }
}

#[test]
fn normals_are_those_of_the_lens() {
    let (rotation, options) = setting();
    for (name, camera) in testing::zoo() {
        let region = Region::new(&camera, &rotation, &options, None).unwrap();
        for kind in [NormalKind::Gradient, NormalKind::Tangent] {
            let table = LiftTable::new(&camera, &rotation, &region, kind);
            let exact: Vec<_> = region.places().map(|place| map(&camera, &rotation, kind, place)).collect();
            let unit = exact.iter().map(Matrix3x2::amax).fold(0.0, f64::max) / f64::from(i16::MAX);
            for (slot, map) in exact.iter().enumerate() {
                for gradient in [Vector2::x(), Vector2::y()] {
                    let told = table.normal(slot, gradient.x as f32, gradient.y as f32).unwrap();
                    let normal = map * gradient;
                    let off = Vector3::from(told).cast::<f64>().cross(&normal).norm();
                    // Each of three entries is off by half a unit and what is left of it by the lens.
                    assert!(off <= 1.5 * unit, "{name}, {kind:?}, {slot}: {off} of {unit}");
                }
            }
        }
    }
}

/// From a gradient to the normal of its great circle.
fn map(camera: &Camera, rotation: &Matrix3<f64>, kind: NormalKind, place: (usize, usize)) -> Matrix3x2<f64> {
    let (_, back) = camera.unproject_jacobian(&at(place)).unwrap();
    rotation
        * match kind {
            NormalKind::Gradient => back,
            NormalKind::Tangent => back * (back.transpose() * back).try_inverse().unwrap(),
        }
}
