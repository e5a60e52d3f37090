//! Vertical lines: true bearings for any camera and lean, and the laws of descriptors, matches and tracks.

#![allow(clippy::unwrap_used)]

mod scene;

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Rotation3};
use scene::{Image, constant, fisheye, noise, random, stripes};
use tiltvp_core::camera::{Camera, Model, Unified};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::lines::{
    Line, LineExtractor, LineOptions, Lines, MatchOptions, MatchScratch, descriptor_distances, match_descriptors,
};

/// A hyperbolic mirror that is seen from 30 degrees above the horizon to the camera below.
fn mirror() -> Camera {
    let (xi, theta) = (0.95, 120f64.to_radians());
    let focal = 190.0 / (theta.sin() / (theta.cos() + xi));
    let lens = Unified::new(xi, [focal; 2], [201.3, 198.6], [0.0; 5], 0.0).unwrap();
    let camera = Camera::new(400, 400, Model::Unified(lens)).unwrap();
    camera.with_max_theta_rad(121f64.to_radians()).unwrap().mirrored()
}

/// The azimuths of the edges of the world of [`stripes`].
fn edges(count: usize, seed: u64) -> Vec<f64> {
    (0..count).map(|i| (i as f64 + 0.8 * random(seed + 1, i as u64)) / count as f64 * TAU).collect()
}

fn apart(a: f64, b: f64) -> f64 {
    let turn = (a - b).rem_euclid(TAU);
    turn.min(TAU - turn)
}

fn extract(extractor: &LineExtractor, image: &Image, tilt: Option<&Tilt>) -> Lines {
    let mut lines = Lines::default();
    extractor.extract(&image.view(), tilt, None, &mut extractor.scratch(), &mut lines).unwrap();
    lines
}

fn describe(extractor: &LineExtractor, image: &Image, lines: &Lines) -> Vec<f32> {
    let mut values = Vec::new();
    extractor.describe(&image.view(), lines, &mut extractor.scratch(), &mut values).unwrap();
    values
}

fn default_extractor(camera: Camera, turn: Matrix3<f64>) -> LineExtractor {
    LineExtractor::new(camera, turn, LineOptions::for_method("great-circle").unwrap()).unwrap()
}

/// Errors of the bearings in radians and in standard deviations; every edge of enough contrast must be there, nothing else.
fn errors(lines: &Lines, count: usize, seed: u64) -> Vec<(f64, f64)> {
    let truth = edges(count, seed);
    for (i, edge) in truth.iter().enumerate() {
        let level = |stripe: usize| 60.0 + 140.0 * random(seed, stripe as u64);
        let contrast = (level(i) - level((i + count - 1) % count)).abs();
        let found = lines.lines.iter().any(|line| apart(line.bearing_rad, *edge) < 0.01);
        assert!(found || contrast < 30.0, "the edge at {edge} of contrast {contrast} was not found");
    }
    let nearest = |line: &Line| truth.iter().map(|edge| apart(line.bearing_rad, *edge)).fold(PI, f64::min);
    lines.lines.iter().map(|line| (nearest(line), nearest(line) / line.sigma_rad)).collect()
}

#[test]
fn bearings_are_true_for_any_camera_mounting_and_lean() {
    let sideways = *Rotation3::from_euler_angles(0.5, -0.4, 1.0).matrix();
    for (name, camera, turn) in [
        ("up", fisheye(400), Matrix3::identity()),
        ("mirror", mirror(), Matrix3::identity()),
        ("sideways", fisheye(400), sideways),
    ] {
        let extractor = default_extractor(camera.clone(), turn);
        let (mut all, mut squares) = (Vec::new(), 0.0);
        for seed in 0..6 {
            let tilt = Tilt::from_alpha_beta(0.03 * (seed % 4) as f64, 1.3 * seed as f64);
            let image = stripes(&camera, &turn, &tilt, 17, 2.0, 40 + seed);
            let found = errors(&extract(&extractor, &image, Some(&tilt)), 17, 40 + seed);
            squares += found.iter().map(|(_, ratio)| ratio * ratio).sum::<f64>();
            all.extend(found.iter().map(|(error, _)| *error));
        }
        let rms = (all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64).sqrt();
        let nees = squares / all.len() as f64;
        println!("{name}: {} lines, rms {:.4} deg, NEES {nees:.2}", all.len(), rms.to_degrees());
        assert!(all.len() > 70 && rms < 0.05f64.to_radians(), "{name}: {} lines, rms {rms}", all.len());
        // The floor of the standard deviations is for rooms, whose edges are no perfect steps.
        assert!((0.01..1.0).contains(&nees), "{name}: NEES {nees}");
    }
}

#[test]
fn a_turn_of_the_camera_turns_the_bearings_and_leaves_descriptors() {
    let camera = fisheye(400);
    let quarter = *Rotation3::from_euler_angles(0.0, 0.0, PI / 2.0).matrix();
    let image = stripes(&camera, &Matrix3::identity(), &Tilt::UPRIGHT, 12, 2.0, 5);
    // The world a quarter turn on: the image turned by a quarter.
    let turned = Image::of(&camera, |u, v| f64::from(image.data[(399 - u) * 400 + v]));
    for method in ["great-circle", "radial"] {
        let options = LineOptions::for_method(method).unwrap();
        let extractor = LineExtractor::new(camera.clone(), Matrix3::identity(), options).unwrap();
        let (a, b) = (extract(&extractor, &image, None), extract(&extractor, &turned, None));
        assert!(a.lines.len() > 3 && a.lines.len() == b.lines.len(), "{method}: {} {}", a.lines.len(), b.lines.len());
        let (da, db) = (describe(&extractor, &image, &a), describe(&extractor, &turned, &b));
        for (i, line) in a.lines.iter().enumerate() {
            let j = b.lines.iter().position(|other| apart(other.bearing_rad, line.bearing_rad + PI / 2.0) < 0.002);
            let j = j.unwrap_or_else(|| panic!("{method}: no line at {} + pi/2", line.bearing_rad));
            let mut distance = Vec::new();
            let row = |values: &[f32], k: usize| values[k * 192..(k + 1) * 192].to_vec();
            descriptor_distances(&row(&da, i), &row(&db, j), 192, &mut distance).unwrap();
            assert!(distance[0] < 0.2, "{method}: {}", distance[0]);
        }
    }
    let mounted = default_extractor(camera.clone(), quarter);
    let plain = extract(&default_extractor(camera, Matrix3::identity()), &image, None);
    let mounted = extract(&mounted, &image, None);
    assert_eq!(plain.lines.len(), mounted.lines.len());
    for line in &plain.lines {
        assert!(mounted.lines.iter().any(|other| apart(other.bearing_rad, line.bearing_rad + PI / 2.0) < 1e-4));
    }
}

/// The invariances that the paper claims: gain and offset of the light, and a lean that is known.
#[test]
fn descriptors_do_not_mind_gain_offset_and_lean() {
    let camera = mirror();
    let extractor = default_extractor(camera.clone(), Matrix3::identity());
    let see = |tilt: &Tilt| stripes(&camera, &Matrix3::identity(), tilt, 12, 0.0, 5);
    let upright = see(&Tilt::UPRIGHT);
    let lines = extract(&extractor, &upright, None);
    let values = describe(&extractor, &upright, &lines);
    assert!(lines.lines.len() > 5);
    let dimmed = Image::of(&camera, |u, v| 0.5 * f64::from(upright.data[v * 400 + u]) + 40.0);
    let dim = describe(&extractor, &dimmed, &lines);
    let tilt = Tilt::from_alpha_beta(0.08, 0.7);
    let leaning = see(&tilt);
    let mut tilted = lines.clone();
    tilted.frame.normal = tilt.normal();
    let lean = describe(&extractor, &leaning, &tilted);
    let mut between = Vec::new();
    descriptor_distances(&values, &values, 192, &mut between).unwrap();
    let n = lines.lines.len();
    let typical = between.iter().sum::<f64>() / (n * n - n) as f64;
    for (name, other) in [("dimmed", &dim), ("leaning", &lean)] {
        let mut distances = Vec::new();
        descriptor_distances(&values, other, 192, &mut distances).unwrap();
        let worst = (0..n).map(|i| distances[i * n + i]).fold(0.0, f64::max);
        assert!(worst < 0.5 * typical, "{name}: {worst}, {typical} between lines");
    }
    // Three pairs of unit length, eq. 3, none of whose values is far above the clip.
    for pair in values.chunks(64) {
        let length = pair.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!((length - 1.0).abs() < 1e-4 || length == 0.0);
    }
}

#[test]
fn matches_are_the_same_both_ways_and_follow_the_truth() {
    let camera = mirror();
    let extractor = default_extractor(camera.clone(), Matrix3::identity());
    let image = |sigma: f64| stripes(&camera, &Matrix3::identity(), &Tilt::UPRIGHT, 9, sigma, 8);
    let (first, second) = (image(0.0), image(1.0));
    let (a, b) = (extract(&extractor, &first, None), extract(&extractor, &second, None));
    let (da, db) = (describe(&extractor, &first, &a), describe(&extractor, &second, &b));
    let (mut scratch, mut there, mut back) = (MatchScratch::default(), Vec::new(), Vec::new());
    let options = MatchOptions { mean_ratio_max: 1.0, second_ratio_max: 1.0, ordered: true, ..MatchOptions::default() };
    match_descriptors(&da, &db, 192, &options, None, &mut scratch, &mut there).unwrap();
    match_descriptors(&db, &da, 192, &options, None, &mut scratch, &mut back).unwrap();
    let mut turned: Vec<(usize, usize)> = back.iter().map(|m| (m.b, m.a)).collect();
    turned.sort_unstable();
    assert_eq!(there.iter().map(|m| (m.a, m.b)).collect::<Vec<_>>(), turned);
    assert!(!there.is_empty());
    let right = there.iter().filter(|m| apart(a.lines[m.a].bearing_rad, b.lines[m.b].bearing_rad) < 0.01).count();
    assert!(right + 1 >= there.len(), "{right} of {} matches are right", there.len());
}

#[test]
fn odd_images_have_no_lines_or_any_but_no_panic() {
    for camera in [fisheye(97), mirror()] {
        for method in ["great-circle", "radial"] {
            let options = LineOptions::for_method(method).unwrap();
            let extractor = LineExtractor::new(camera.clone(), Matrix3::identity(), options).unwrap();
            assert!(extract(&extractor, &constant(&camera, 0.0), None).lines.is_empty());
            assert!(extract(&extractor, &constant(&camera, 255.0), None).lines.len() < 2);
            let image = noise(&camera, 1);
            for alpha in [0.0, 0.3, 1.5, PI] {
                let lines = extract(&extractor, &image, Some(&Tilt::from_alpha_beta(alpha, 0.4)));
                assert!(describe(&extractor, &image, &lines).iter().all(|x| x.is_finite()));
                assert!(lines.lines.iter().all(|line| line.sigma_rad > 0.0));
                assert_eq!(lines, extract(&extractor, &image, Some(&Tilt::from_alpha_beta(alpha, 0.4))));
            }
            let every: Vec<f64> = (0..36).map(|i| f64::from(i) * TAU / 36.0).collect();
            let lines = extractor.lines_at(&every, None);
            assert_eq!(describe(&extractor, &image, &lines).len(), 36 * 192);
            let mut levels = Vec::new();
            let size = extractor.patches(&image.view(), &lines, &extractor.scratch(), &mut levels).unwrap();
            assert_eq!(levels.len(), 36 * size.0 * size.1);
        }
    }
}
