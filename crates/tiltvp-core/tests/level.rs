//! Level images: how exact their maps are over all lenses.

#![allow(clippy::expect_used)]

use std::sync::Arc;

use nalgebra::{Matrix3, Rotation3, Vector2};
use tiltvp_core::camera::{Camera, Equidistant, Equirectangular, Model, Pinhole};
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
    // Right of the last column is the first one.
    let first = |place: &Vector2<f64>| {
        let width = f64::from(camera.width());
        Vector2::new((place.x + 0.5).rem_euclid(width) - 0.5, place.y)
    };
    let (a, b) = (&first(a), &first(b));
    let (a, b) = (camera.unproject(a).expect("the whole sphere"), camera.unproject(b).expect("the whole sphere"));
    a.cross(&b).norm().atan2(a.dot(&b)) * f64::from(camera.width()) / std::f64::consts::TAU
}

/// Whether a place is in the image, or beyond its edge by less than the half pixel that still counts as in it.
fn is_inside(camera: &Camera, place: &Vector2<f64>) -> bool {
    let within = |at: f64, side: u32| (0.0..=f64::from(side) - 1.0).contains(&at);
    within(place.x, camera.width()) && within(place.y, camera.height())
}

/// The whole map of a tilt, NaN where nothing is seen.
fn map(leveller: Leveller, tilt: &Tilt) -> Vec<[f32; 2]> {
    let (width, height) = (leveller.width(), leveller.height());
    let map = Arc::new(leveller).map(tilt);
    let (mut columns, mut rows) = (vec![f32::NAN; width * height], vec![f32::NAN; width * height]);
    let length = width * map.strip_rows();
    for (number, (columns, rows)) in columns.chunks_mut(length).zip(rows.chunks_mut(length)).enumerate() {
        map.write_strip(number, [columns, rows], f32::NAN).expect("as many numbers as pixels");
    }
    columns.into_iter().zip(rows).map(|(column, row)| [column, row]).collect()
}

/// Of how many pixels of a map one is compared with the exact place.
const LOOKED_AT: usize = 7;

/// The largest error of a map, and which part of the pixels that are seen, or are not, it has otherwise.
fn errors(camera: &Camera, shown: &Camera, tilt: &Tilt) -> (f64, f64) {
    let leveller = Leveller::new(camera.clone(), &mounting(), shown.clone(), &mounting()).expect("rotations");
    let map = map(leveller, tilt);
    let rotation = mounting().transpose() * tilt.leaning_from_upright() * mounting();
    let (mut largest, mut other): (f64, usize) = (0.0, 0);
    // Widths are not multiples of 7: all columns and rows of cells have their turn.
    for (at, place) in map.iter().enumerate().step_by(LOOKED_AT) {
        let width = shown.width() as usize;
        let pixel = Vector2::new((at % width) as f64, (at / width) as f64);
        let exact = shown.unproject(&pixel).and_then(|ray| camera.project(&(rotation * ray)));
        match exact {
            // At the border places are brought into the image, and outside there are none.
            Some(exact) if !is_inside(camera, &exact) => {}
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
        for (alpha, beta) in [(0.02, 1.0), (0.07, -0.3), (0.1, 0.7), (0.5, -2.0)] {
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
fn places_are_in_the_image_and_half_a_pixel_beyond_its_edge_still_counts() {
    let camera = panorama(512);
    let ahead = Pinhole::new([100.0, 100.0], [31.5, 23.5], &[]).expect("a lens");
    let pinhole = Camera::new(64, 48, ahead.into()).expect("a camera");
    let tilt = Tilt::from_alpha_beta(0.5, 1.0);
    for (camera, last, seen) in [(&camera, [512.0, 255.0], 64 * 48), (&pinhole, [63.0, 47.0], 1)] {
        let leveller = Leveller::new(camera.clone(), &mounting(), pinhole.clone(), &mounting()).expect("rotations");
        let map = map(leveller, &tilt);
        let places: Vec<_> = map.iter().filter(|place| place[0].is_finite()).collect();
        assert!(places.len() >= seen, "{} of {seen}", places.len());
        assert!(places.iter().all(|place| (0..2).all(|axis| (0.0..=last[axis]).contains(&place[axis]))));
    }
    // Of the pixels that a turn about the axis by a hundredth takes out of the image those that leave it by half a pixel stay.
    let turned = *Rotation3::from_euler_angles(0.0, 0.0, 0.01).matrix();
    let leveller = Leveller::new(pinhole.clone(), &turned, pinhole, &Matrix3::identity()).expect("rotations");
    let map = map(leveller, &Tilt::from_alpha_beta(0.0, 0.0));
    assert!(map.iter().all(|place| place[0].is_finite()), "corners move by 0.3 pixels");
    assert!(map[0].contains(&0.0) && map[64 * 48 - 1].iter().zip([63.0, 47.0]).any(|(at, last)| *at == last));
}

#[test]
fn what_is_seen_between_the_corners_of_cells_is_shown() {
    // A circle of two or six pixels' radius, that leans take to different places of the level image.
    let lens = || Equidistant::new(40.0, 31.5, 31.5).expect("a lens");
    let shown = Camera::new(64, 64, lens().into()).expect("a camera");
    for (k, radius_rad) in (0..40).flat_map(|k| [(k, 0.05), (k, 0.15)]) {
        let camera = shown.clone().with_max_theta_rad(radius_rad).expect("a field of view");
        let (alpha, beta) = (0.012 * f64::from(k), 0.7 * f64::from(k));
        let tilt = Tilt::from_alpha_beta(alpha, beta);
        let identity = Matrix3::identity();
        let leveller = Leveller::new(camera.clone(), &identity, shown.clone(), &identity).expect("rotations");
        let found = map(leveller, &tilt).iter().filter(|place| place[0].is_finite()).count();
        let pixels = (0..64 * 64).map(|at| Vector2::new(f64::from(at % 64), f64::from(at / 64)));
        let rays = pixels.filter_map(|pixel| shown.unproject(&pixel));
        let seen = rays.filter(|ray| camera.project(&(tilt.leaning_from_upright() * ray)).is_some()).count();
        assert!(seen > 9 && found == seen, "leaning {alpha}: {found} of {seen}");
    }
}

#[test]
fn without_a_lean_every_pixel_stays() {
    for (name, camera) in zoo().into_iter().chain([("panorama", panorama(300))]) {
        let leveller = Leveller::new(camera.clone(), &mounting(), camera.clone(), &mounting()).expect("rotations");
        let width = leveller.width();
        let map = map(leveller, &Tilt::from_alpha_beta(0.0, 0.0));
        for (at, place) in map.iter().enumerate().filter(|(_, place)| place[0].is_finite()) {
            let pixel = Vector2::new((at % width) as f64, (at / width) as f64);
            let away = distance(&camera, &pixel, &Vector2::from(place.map(f64::from)));
            assert!(away < 1e-2, "{name}: {pixel} {place:?}");
        }
    }
}

#[test]
fn wrong_questions_are_refused() {
    let camera = panorama(64);
    let identity = Matrix3::identity();
    assert!(Leveller::new(camera.clone(), &(2.0 * identity), camera.clone(), &identity).is_err());
    assert!(Leveller::from_rays(camera.clone(), &identity, 3, &[[0.0; 3]; 4]).is_err());
    for ray in [[0.0; 3], [0.0, 0.0, 1.1], [f32::INFINITY, 0.0, 0.0], [0.0, f32::NAN, 1.0]] {
        let refused = Leveller::from_rays(camera.clone(), &identity, 2, &[ray; 4]).expect_err("no unit vector");
        assert!(refused.to_string().starts_with("rays: got ["), "{refused}");
    }
    let leveller = Leveller::from_rays(camera, &identity, 2, &[[0.0, 0.0, 1.0]; 4]).expect("rays");
    assert_eq!(map(leveller, &Tilt::from_alpha_beta(0.0, 0.0)).len(), 4);
}

#[test]
fn strips_of_another_size_are_refused() {
    let camera = panorama(64);
    let leveller = Leveller::new(camera.clone(), &mounting(), camera, &mounting()).expect("rotations");
    let map = Arc::new(leveller).map(&Tilt::UPRIGHT);
    let pixels = map.width() * map.strip_rows().min(map.height());
    for (number, sizes) in [(0, [pixels, pixels - 1]), (0, [pixels + 1; 2]), (1, [pixels; 2]), (usize::MAX, [1; 2])] {
        let [mut columns, mut rows] = sizes.map(|size| vec![7.0; size]);
        let refused = map.write_strip(number, [&mut columns, &mut rows], f32::NAN).expect_err("another size");
        assert!(refused.to_string().starts_with("places: got "), "{refused}");
        assert!(columns.iter().chain(&rows).all(|number| *number == 7.0));
    }
}
