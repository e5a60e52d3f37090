//! Simulated drives among posts, whose truth is known, and what is made of them.

use nalgebra::{Matrix3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tiltvp_core::filter::{ConsistencyBand, squared_mahalanobis};
use tiltvp_core::geometry::wrap_angle;
use tiltvp_core::selfcalib::{
    CalibrationMethod, Cause, LogBearing, LogCalibration, LogOptions, Mounting, MountingEstimate, SelfCalibrator,
    SelfCalibratorOptions, Suspect, WheelMotion, calibrate_log,
};

const TRUTH: Mounting = Mounting { x_m: 0.25, y_m: -0.1, yaw_rad: 0.4 };
pub(crate) const BASE_M: f64 = 0.4;
pub(crate) const SIGMA_RAD: f64 = 0.005;
pub(crate) const K_M: f64 = 1e-5;
pub(crate) const POSTS: usize = 8;
pub(crate) const STEPS: usize = 150;
pub(crate) const STEP_S: f64 = 0.2;
pub(crate) const DRIVES: u32 = 20;

/// How the robot turns from step to step.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Turns {
    Winding,
    Abrupt,
}

/// What is not as it is said to be, and how the robot drives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Errors {
    pub(crate) turns: Turns,
    /// How much of the error of a post's bearing stays from step to step.
    pub(crate) kept: f64,
    /// By how much the right wheel runs farther than it reads, and the left one less, as a logarithm.
    pub(crate) imbalance: f64,
    /// The time by which bearings are later than the odometry.
    pub(crate) late_s: f64,
    /// How far the camera is pushed forward halfway.
    pub(crate) bump_m: f64,
    /// By how much farther both wheels run than the robot goes in the third quarter of the drive, as on a carpet.
    pub(crate) carpet: f64,
    /// How far the image centre is off, forward and left, in units of the radius at which the posts are seen.
    pub(crate) centre: [f64; 2],
    /// By how much the camera turns all along the drive, so that it is where it should be at the end.
    pub(crate) creep_rad: f64,
    /// How much later than in the middle of the image posts are seen forward and left in the camera, seconds.
    pub(crate) shutter_s: [f64; 2],
}

pub(crate) const NONE: Errors = Errors {
    turns: Turns::Winding,
    kept: 0.0,
    imbalance: 0.0,
    late_s: 0.0,
    bump_m: 0.0,
    carpet: 0.0,
    centre: [0.0; 2],
    creep_rad: 0.0,
    shutter_s: [0.0; 2],
};

/// What is read on a drive.
pub(crate) struct Drive {
    pub(crate) readings: Vec<WheelMotion>,
    pub(crate) bearings: Vec<LogBearing>,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (a, b): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// Left and right turns by turns, among posts to all sides.
pub(crate) fn drive(seed: u32, errors: Errors) -> Drive {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.into());
    let posts: Vec<Vector2<f64>> = (0..POSTS)
        .map(|post| {
            let angle = std::f64::consts::TAU * (post as f64 + rng.random::<f64>()) / POSTS as f64;
            Vector2::new(angle.cos(), angle.sin()) * (2.0 + 3.0 * rng.random::<f64>())
        })
        .collect();
    let (mut place, mut heading, mut off) = (Vector2::zeros(), 0.0f64, [0.0; POSTS]);
    let mut drive = Drive { readings: Vec::new(), bearings: Vec::new() };
    let turn_in = |step: usize| match errors.turns {
        Turns::Winding => 0.12 * (step as f64 / 12.0).sin() + 0.03,
        Turns::Abrupt => [0.0, 0.15, 0.0, -0.1][step / 9 % 4],
    };
    for step in 0..STEPS {
        let (distance, turn) = (0.05, turn_in(step));
        let moved = WheelMotion::from_motion(distance, turn, BASE_M);
        let on_carpet = if (STEPS / 2..STEPS * 3 / 4).contains(&step) { 1.0 + errors.carpet } else { 1.0 };
        let mut read =
            |true_m: f64, run: f64| (true_m * on_carpet + (K_M * true_m.abs()).sqrt() * normal(&mut rng)) * run;
        drive.readings.push(WheelMotion {
            left_m: read(moved.left_m, errors.imbalance.exp()),
            right_m: read(moved.right_m, (-errors.imbalance).exp()),
        });
        let middle = heading + 0.5 * turn;
        place += Vector2::new(middle.cos(), middle.sin()) * distance;
        heading += turn;
        let pushed = if step >= STEPS / 2 { errors.bump_m } else { 0.0 };
        // Where a post is seen when bearings are taken that are said to be of now.
        let seen_at = |late_s: f64, post: Vector2<f64>| {
            let then = late_s / STEP_S;
            let turn = if then > 0.0 { turn_in(step + 1) } else { turn };
            let middle = heading + 0.5 * turn * then;
            let place = place + Vector2::new(middle.cos(), middle.sin()) * (distance * then);
            let heading = heading + turn * then;
            let (sin, cos) = heading.sin_cos();
            let (x, y) = (TRUTH.x_m + pushed, TRUTH.y_m);
            let ray = post - place - Vector2::new(cos * x - sin * y, sin * x + cos * y);
            (ray.y.atan2(ray.x) - heading - TRUTH.yaw_rad).sin_cos()
        };
        for (post, off) in off.iter_mut().enumerate() {
            *off = errors.kept * *off + (1.0 - errors.kept * errors.kept).sqrt() * SIGMA_RAD * normal(&mut rng);
            let (sin, cos) = seen_at(errors.late_s, posts[post]);
            let late_s = errors.late_s + errors.shutter_s[0] * cos + errors.shutter_s[1] * sin;
            let (sin, cos) = seen_at(late_s, posts[post]);
            let seen = (sin - errors.centre[1]).atan2(cos - errors.centre[0]);
            let yet_to_turn = errors.creep_rad * (1.0 - step as f64 / (STEPS - 1) as f64);
            let bearing_rad = wrap_angle(seen + *off + yet_to_turn);
            drive.bearings.push(LogBearing { step, landmark: post as u64, bearing_rad });
        }
    }
    drive
}

fn filter(method: CalibrationMethod) -> SelfCalibratorOptions {
    SelfCalibratorOptions {
        method,
        wheel_base_m: BASE_M,
        bearing_sigma_rad: SIGMA_RAD,
        odometry_k_m: K_M,
        start: Mounting { x_m: 0.15, y_m: 0.0, yaw_rad: 0.2 },
        start_covariance: Matrix3::from_diagonal(&Vector3::new(0.02, 0.02, 0.09)),
        ..SelfCalibratorOptions::default()
    }
}

pub(crate) fn options() -> LogOptions {
    LogOptions { filter: filter(CalibrationMethod::Default), ..LogOptions::default() }
}

pub(crate) fn whole(drive: &Drive, options: &LogOptions) -> LogCalibration {
    let times: Vec<f64> = (0..STEPS).map(|step| STEP_S * step as f64).collect();
    calibrate_log(options, &drive.readings, Some(&times), &drive.bearings).unwrap()
}

pub(crate) fn followed(drive: &Drive, method: CalibrationMethod) -> MountingEstimate {
    let mut calibrator = SelfCalibrator::new(filter(method)).unwrap();
    let posts: Vec<u64> = (0..POSTS as u64).collect();
    for (reading, seen) in drive.readings.iter().zip(drive.bearings.chunks(POSTS)) {
        let bearings: Vec<f64> = seen.iter().map(|bearing| bearing.bearing_rad).collect();
        calibrator.step(reading, &posts, &bearings).unwrap();
    }
    calibrator.examine();
    calibrator.estimate()
}

pub(crate) fn off(mounting: &Mounting) -> Vector3<f64> {
    let off = mounting.vector() - TRUTH.vector();
    Vector3::new(off.x, off.y, wrap_angle(off.z))
}

pub(crate) fn nees(estimate: &MountingEstimate) -> f64 {
    squared_mahalanobis(&off(&estimate.mounting), &estimate.covariance_xy_yaw).unwrap()
}

pub(crate) fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// Of so many drives; one test in 10,000 leaves it by chance.
pub(crate) fn band() -> ConsistencyBand {
    ConsistencyBand::of_mean(0.9999, 3, DRIVES).unwrap()
}

/// Drives as told are relied upon, but for what is named by chance: image centre and shutter beyond what 99 % are within, a creep beyond what
/// 99.7 % are. More than two of twenty are in one case of a hundred.
pub(crate) fn assert_relied_upon(found: &[LogCalibration]) {
    let by_chance = |suspect: Suspect| matches!(suspect.cause, Cause::Centre | Cause::Shutter | Cause::Creep);
    let doubted: Vec<_> = found.iter().filter(|found| !found.reliable()).collect();
    assert!(doubted.len() <= 2, "{doubted:?}");
    assert!(doubted.iter().all(|found| found.estimate.suspect.is_some_and(by_chance)), "{doubted:?}");
}
