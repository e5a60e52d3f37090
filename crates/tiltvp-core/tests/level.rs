//! Level images: how exact their maps are over all lenses, and what becomes of levels.

#![allow(clippy::expect_used)]

use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use tiltvp_core::camera::{Camera, Equirectangular, Model, Pinhole};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::testing::zoo;
use tiltvp_core::tilt::{Leveller, MAP_ERROR_PX};

fn mounting() -> Matrix3<f64> {
    *Rotation3::from_euler_angles(0.02, -0.03, 0.4).matrix()
}

fn panorama(width: u32) -> Camera {
    let lens = Equirectangular::new(width, width / 2).expect("a panorama");
    Camera::new(width, width / 2, lens.into()).expect("a camera")
}

/// From one place to another in pixels, of a panorama on the sphere.
fn distance(camera: &Camera, a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    if !matches!(camera.model(), Model::Equirectangular(_)) {
        return (a - b).norm();
    }
    let (a, b) = (camera.unproject(a).expect("the whole sphere"), camera.unproject(b).expect("the whole sphere"));
    a.cross(&b).norm().atan2(a.dot(&b)) * f64::from(camera.width()) / std::f64::consts::TAU
}

/// Whether a place is in the image or within a pixel of it.
fn is_near(camera: &Camera, place: &Vector2<f64>) -> bool {
    let within = |at: f64, side: u32| (-1.0..=f64::from(side)).contains(&at);
    within(place.x, camera.width()) && within(place.y, camera.height())
}

/// Of how many pixels of a map one is compared with the exact place.
const LOOKED_AT: usize = 7;

/// The largest error of a map, and which part of the pixels that are seen, or are not, it has otherwise.
fn errors(camera: &Camera, shown: &Camera, tilt: &Tilt) -> (f64, f64) {
    let leveller = Leveller::new(camera.clone(), &mounting(), shown.clone(), &mounting()).expect("rotations");
    let map = leveller.map(tilt);
    let rotation = mounting().transpose() * tilt.leaning_from_upright() * mounting();
    let (mut largest, mut other): (f64, usize) = (0.0, 0);
    // Widths are not multiples of 7: all columns and rows of cells have their turn.
    for (at, place) in map.iter().enumerate().step_by(LOOKED_AT) {
        let pixel = Vector2::new((at % leveller.width()) as f64, (at / leveller.width()) as f64);
        let exact = shown.unproject(&pixel).and_then(|ray| camera.project(&(rotation * ray)));
        match exact {
            // What is far outside has no levels to show.
            Some(exact) if !is_near(camera, &exact) => {}
            Some(exact) if place[0].is_finite() => {
                let place = Vector2::new(f64::from(place[0]), f64::from(place[1]));
                largest = largest.max(distance(camera, &place, &exact));
            }
            None if place[0].is_nan() => {}
            _ => other += 1,
        }
    }
    (largest, (LOOKED_AT * other) as f64 / map.len() as f64)
}

#[test]
fn maps_are_as_exact_as_they_say() {
    for (name, camera) in zoo() {
        for (alpha, beta) in [(0.0, 0.0), (0.1, 0.7), (0.5, -2.0)] {
            let (largest, other) = errors(&camera, &camera, &Tilt::from_alpha_beta(alpha, beta));
            assert!(largest <= MAP_ERROR_PX, "{name} leaning {alpha}: {largest} px");
            // Rays on the rim itself are kept with 24 bits.
            assert!(other < 1e-4, "{name} leaning {alpha}: {other}");
        }
    }
}

#[test]
fn panoramas_are_exact_at_seams_and_poles_too() {
    let (camera, ahead) = (panorama(1024), Pinhole::new([200.0, 200.0], [319.5, 239.5], &[]).expect("a lens"));
    let ahead = Camera::new(640, 480, ahead.into()).expect("a camera");
    for (alpha, beta) in [(0.1, 0.7), (0.5, -2.0), (1.5, 3.0)] {
        for shown in [&camera, &ahead] {
            let (largest, other) = errors(&camera, shown, &Tilt::from_alpha_beta(alpha, beta));
            assert!(largest <= MAP_ERROR_PX && other == 0.0, "leaning {alpha}: {largest} px, {other}");
        }
    }
}

#[test]
fn a_level_panorama_has_all_of_it_and_no_seam() {
    let camera = panorama(512);
    let leveller = Leveller::new(camera.clone(), &mounting(), camera.clone(), &mounting()).expect("rotations");
    let tilt = Tilt::from_alpha_beta(0.5, 1.0);
    for channels in [1, 3] {
        let level = leveller.level(&vec![200; 512 * 256 * channels], channels, &tilt).expect("an image");
        assert!(level.len() == 512 * 256 * channels && level.iter().all(|level| *level == 200));
    }
    // Levels that go with the direction alone: they are as smooth at the seams and poles as anywhere.
    let field = |ray: &Vector3<f64>| 127.0 + 60.0 * ray.x + 50.0 * ray.y - 40.0 * ray.z;
    let image: Vec<u8> = (0..512 * 256)
        .map(|k| field(&camera.unproject(&Vector2::new(f64::from(k % 512), f64::from(k / 512))).expect("a ray")) as u8)
        .collect();
    let rotation = mounting().transpose() * tilt.leaning_from_upright() * mounting();
    let level = leveller.level(&image, 1, &tilt).expect("an image");
    for (k, got) in level.iter().enumerate() {
        let ray = camera.unproject(&Vector2::new((k % 512) as f64, (k / 512) as f64)).expect("a ray");
        // The levels were cut off to whole ones, and are rounded again.
        let expected = field(&(rotation * ray)) - 0.5;
        assert!((f64::from(*got) - expected).abs() < 1.6, "{k}: {got} {expected}");
    }
}

#[test]
fn without_a_lean_every_level_stays() {
    for (name, camera) in zoo().into_iter().chain([("panorama", panorama(300))]) {
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let leveller = Leveller::new(camera.clone(), &mounting(), camera.clone(), &mounting()).expect("rotations");
        let upright = Tilt::from_alpha_beta(0.0, 0.0);
        for channels in [1, 3] {
            let image: Vec<u8> = (0..width * height * channels).map(|k| (k % 251) as u8).collect();
            let level = leveller.level(&image, channels, &upright).expect("an image");
            let differ = (0..level.len()).filter(|k| level[*k] != image[*k] && level[*k] != 0).count();
            assert_eq!(differ, 0, "{name}");
        }
    }
}

#[test]
fn wrong_questions_are_refused() {
    let camera = panorama(64);
    let identity = Matrix3::identity();
    assert!(Leveller::new(camera.clone(), &(2.0 * identity), camera.clone(), &identity).is_err());
    assert!(Leveller::from_rays(camera.clone(), &identity, 3, vec![[0.0; 3]; 4]).is_err());
    let leveller = Leveller::from_rays(camera, &identity, 2, vec![[0.0, 0.0, 1.0]; 4]).expect("rays");
    let upright = Tilt::from_alpha_beta(0.0, 0.0);
    assert!(leveller.level(&[0; 64 * 32 - 1], 1, &upright).is_err());
    assert!(leveller.level(&[0; 64 * 32 * 2], 2, &upright).is_err());
    assert_eq!(leveller.level(&[9; 64 * 32], 1, &upright).expect("an image"), [9; 4]);
}
