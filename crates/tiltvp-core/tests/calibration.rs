//! The mounting from simulated drives among posts, whose truth is known: by both filters and from whole logs.

#![allow(clippy::unwrap_used)]

use nalgebra::{Matrix3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tiltvp_core::filter::{ConsistencyBand, squared_mahalanobis};
use tiltvp_core::geometry::wrap_angle;
use tiltvp_core::selfcalib::{
    CalibrationMethod, Cause, LogBearing, LogCalibration, LogOptions, Misreading, Mounting, MountingEstimate,
    SelfCalibrator, SelfCalibratorOptions, WheelMotion, calibrate_log,
};

const TRUTH: Mounting = Mounting { x_m: 0.25, y_m: -0.1, yaw_rad: 0.4 };
const BASE_M: f64 = 0.4;
const SIGMA_RAD: f64 = 0.005;
const K_M: f64 = 1e-5;
const POSTS: usize = 8;
const STEPS: usize = 150;
const STEP_S: f64 = 0.2;
const DRIVES: u32 = 20;

/// How the robot turns from step to step.
#[derive(Debug, Clone, Copy)]
enum Turns {
    Winding,
    Abrupt,
}

/// What is not as it is said to be, and how the robot drives.
#[derive(Debug, Clone, Copy)]
struct Errors {
    turns: Turns,
    /// How much of the error of a post's bearing stays from step to step.
    kept: f64,
    /// By how much the right wheel runs farther than it reads, and the left one less, as a logarithm.
    imbalance: f64,
    /// The time by which bearings are later than the odometry.
    late_s: f64,
    /// How far the camera is pushed forward halfway.
    bump_m: f64,
    /// By how much farther both wheels run than the robot goes in the third quarter of the drive, as on a carpet.
    carpet: f64,
    /// How far the image centre is off, forward and left, in units of the radius at which the posts are seen.
    centre: [f64; 2],
}

const NONE: Errors = Errors {
    turns: Turns::Winding,
    kept: 0.0,
    imbalance: 0.0,
    late_s: 0.0,
    bump_m: 0.0,
    carpet: 0.0,
    centre: [0.0; 2],
};

/// What is read on a drive.
struct Drive {
    readings: Vec<WheelMotion>,
    bearings: Vec<LogBearing>,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (a, b): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// Left and right turns by turns, among posts to all sides.
fn drive(seed: u32, errors: Errors) -> Drive {
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
        // Where the robot is when the bearings are taken that are said to be of now.
        let then = errors.late_s / STEP_S;
        let turn = if then > 0.0 { turn_in(step + 1) } else { turn };
        let middle = heading + 0.5 * turn * then;
        let (place, heading) =
            (place + Vector2::new(middle.cos(), middle.sin()) * (distance * then), heading + turn * then);
        let pushed = if step >= STEPS / 2 { errors.bump_m } else { 0.0 };
        let (sin, cos) = heading.sin_cos();
        let (x, y) = (TRUTH.x_m + pushed, TRUTH.y_m);
        let camera = place + Vector2::new(cos * x - sin * y, sin * x + cos * y);
        for (post, off) in off.iter_mut().enumerate() {
            *off = errors.kept * *off + (1.0 - errors.kept * errors.kept).sqrt() * SIGMA_RAD * normal(&mut rng);
            let ray = posts[post] - camera;
            let (sin, cos) = (ray.y.atan2(ray.x) - heading - TRUTH.yaw_rad).sin_cos();
            let bearing_rad = wrap_angle((sin - errors.centre[1]).atan2(cos - errors.centre[0]) + *off);
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

fn options() -> LogOptions {
    LogOptions { filter: filter(CalibrationMethod::Default), ..LogOptions::default() }
}

fn whole(drive: &Drive, options: &LogOptions) -> LogCalibration {
    let times: Vec<f64> = (0..STEPS).map(|step| STEP_S * step as f64).collect();
    calibrate_log(options, &drive.readings, Some(&times), &drive.bearings).unwrap()
}

fn followed(drive: &Drive, method: CalibrationMethod) -> MountingEstimate {
    let mut calibrator = SelfCalibrator::new(filter(method)).unwrap();
    let posts: Vec<u64> = (0..POSTS as u64).collect();
    for (reading, seen) in drive.readings.iter().zip(drive.bearings.chunks(POSTS)) {
        let bearings: Vec<f64> = seen.iter().map(|bearing| bearing.bearing_rad).collect();
        calibrator.step(reading, &posts, &bearings).unwrap();
    }
    calibrator.examine();
    calibrator.estimate()
}

fn off(mounting: &Mounting) -> Vector3<f64> {
    let off = mounting.vector() - TRUTH.vector();
    Vector3::new(off.x, off.y, wrap_angle(off.z))
}

fn nees(estimate: &MountingEstimate) -> f64 {
    squared_mahalanobis(&off(&estimate.mounting), &estimate.covariance_xy_yaw).unwrap()
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// Of so many drives; one test in 10,000 leaves it by chance.
fn band() -> ConsistencyBand {
    ConsistencyBand::of_mean(0.9999, 3, DRIVES).unwrap()
}

#[test]
fn logs_that_make_no_sense_are_refused() {
    let good = drive(0, NONE);
    let delay = LogOptions { estimate_time_offset: true, ..options() };
    let told = |options: &LogOptions, times: Option<&[f64]>, change: &dyn Fn(&mut Drive)| {
        let mut drive = Drive { readings: good.readings.clone(), bearings: good.bearings.clone() };
        change(&mut drive);
        calibrate_log(options, &drive.readings, times, &drive.bearings).unwrap_err().to_string()
    };
    let times: Vec<f64> = (0..STEPS).map(|step| STEP_S * step as f64).collect();
    let back: Vec<f64> = times.iter().rev().copied().collect();
    for (said, expected) in [
        (told(&delay, None, &|_| ()), "the time of each step"),
        (told(&options(), Some(&times[1..]), &|_| ()), "one for each of 150 steps"),
        (told(&options(), Some(&back), &|_| ()), "growing times"),
        (told(&options(), None, &|drive| drive.readings[3].left_m = f64::NAN), "at step 3"),
        (told(&options(), None, &|drive| drive.bearings[5].bearing_rad = f64::INFINITY), "in row 5"),
        (told(&options(), None, &|drive| drive.bearings[5].step = STEPS), "steps below 150"),
        (told(&options(), None, &|drive| drive.bearings.truncate(POSTS)), "no landmark seen twice"),
    ] {
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn whole_logs_are_as_good_as_they_say() {
    let found: Vec<LogCalibration> = (0..DRIVES).map(|seed| whole(&drive(seed, NONE), &options())).collect();
    let nees = mean(found.iter().map(|found| nees(&found.estimate)));
    assert!(band().holds(nees), "{nees}");
    for found in &found {
        assert!(found.reliable() && found.converged && found.outliers < 4, "{found}");
        assert_eq!(found.bearings, STEPS * POSTS);
        assert!((found.residual_rms - 1.0).abs() < 0.1, "{}", found.residual_rms);
        assert!(off(&found.estimate.mounting).xy().norm() < 0.01 && off(&found.estimate.mounting).z.abs() < 0.01);
        assert_eq!((found.bearing_sigma_rad, found.odometry_k_m), (SIGMA_RAD, K_M));
    }
}

#[test]
fn both_filters_end_near_the_truth_and_ours_knows_how_near() {
    for method in [CalibrationMethod::Default, CalibrationMethod::Paper] {
        let found: Vec<MountingEstimate> = (0..DRIVES).map(|seed| followed(&drive(seed, NONE), method)).collect();
        // The paper's is far surer than it may be, from drive to drive by very different amounts.
        let nees = mean(found.iter().map(nees));
        assert!(method == CalibrationMethod::Paper || band().holds(nees), "{nees}");
        let near = |found: &&MountingEstimate| {
            let off = off(&found.mounting);
            off.xy().norm() < 0.05 && off.z.abs() < 0.05
        };
        let near = found.iter().filter(near).count();
        assert!(near >= if method == CalibrationMethod::Default { 20 } else { 15 }, "{method:?}: {near}");
    }
}

/// Edges of real things err alike from image to image. Where nine tenths of an error stay the covariance is still too narrow.
#[test]
fn errors_that_stay_make_the_covariance_wider() {
    let found = |kept: f64| -> Vec<LogCalibration> {
        (0..DRIVES).map(|seed| whole(&drive(seed, Errors { kept, ..NONE }), &options())).collect()
    };
    let volume = |found: &LogCalibration| found.estimate.covariance_xy_yaw.determinant().powf(1.0 / 3.0);
    let white = mean(found(0.0).iter().map(volume));
    for (kept, nees_max) in [(0.5, band().high), (0.7, band().high), (0.9, 7.0)] {
        let found = found(kept);
        let (wider, nees) =
            (mean(found.iter().map(volume)) / white, mean(found.iter().map(|found| nees(&found.estimate))));
        println!(
            "of errors of which {kept} stays the NEES is {nees:.2} of 3, and the covariance {wider:.1} times as large"
        );
        assert!(wider > 2.0 && (band().low..nees_max).contains(&nees), "{kept}: {wider}, {nees}");
    }
}

/// The filter follows what motions of a part of the drive share, so that residuals say little of it.
#[test]
fn a_carpet_makes_the_covariance_wider() {
    let (nees, wider) = on_carpet("filter", |drive| followed(drive, CalibrationMethod::Default));
    assert!(nees < band().high && wider > 2.0, "{nees}, {wider}");
}

/// The whole log does without the odometry of a carpet, and says of which part.
#[test]
fn a_carpet_is_doubted_where_it_lies() {
    let (nees, wider) = on_carpet("whole log", |drive| whole(drive, &options()).estimate);
    assert!(nees < band().high && (1.0..2.0).contains(&wider), "{nees}, {wider}");
    let doubted = |carpet: f64| -> Vec<Vec<Vector2<f64>>> {
        (0..DRIVES).map(|seed| whole(&drive(seed, Errors { carpet, ..NONE }), &options()).doubted).collect()
    };
    // A part is doubted by chance once in a hundred times.
    assert!(doubted(0.0).iter().filter(|parts| !parts.is_empty()).count() <= 3);
    // The carpet lies from a half to three quarters of the drive.
    for parts in doubted(0.05) {
        let there = |part: &Vector2<f64>| (part - Vector2::new(0.5, 0.75)).amax() < 0.01;
        assert!(parts.iter().any(there), "{parts:?}");
    }
}

/// The NEES of the mounting where wheels run 5 % too far on a carpet, and how much larger its covariance is than without.
fn on_carpet(way: &str, found: impl Fn(&Drive) -> MountingEstimate) -> (f64, f64) {
    let volume = |found: &MountingEstimate| found.covariance_xy_yaw.determinant().powf(1.0 / 3.0);
    let of = |carpet: f64| -> Vec<MountingEstimate> {
        (0..DRIVES).map(|seed| found(&drive(seed, Errors { carpet, ..NONE }))).collect()
    };
    let (even, carpet) = (of(0.0), of(0.05));
    let nees = mean(carpet.iter().map(nees));
    let wider = mean(carpet.iter().map(volume)) / mean(even.iter().map(volume));
    println!(
        "{way}: a carpet on which wheels run 5 % too far: NEES {nees:.2} of 3, covariances {wider:.1} times as large"
    );
    (nees, wider)
}

/// So do the deviations of wheels and a delay that are estimated, each of which the carpet moves too.
#[test]
fn a_carpet_makes_deviations_of_wheels_and_delay_wider() {
    let options = LogOptions { estimate_odometry: true, estimate_time_offset: true, ..options() };
    let found: Vec<LogCalibration> =
        (0..DRIVES).map(|seed| whole(&drive(seed, Errors { carpet: 0.05, ..NONE }), &options)).collect();
    let squares = [
        mean(found.iter().map(|found| (found.time_offset_s / found.time_offset_sigma_s).powi(2))),
        mean(found.iter().map(|found| (found.wheels.imbalance / found.wheels_sigma[0]).powi(2))),
        mean(found.iter().map(|found| ((found.wheels.base_m - BASE_M) / found.wheels_sigma[1]).powi(2))),
    ];
    println!("mean squared errors of delay, imbalance and wheel base in stated sigmas on a carpet: {squares:.2?}");
    assert!(squares.iter().all(|square| *square < 4.0), "{squares:?}");
}

/// Leaving out posts in turn tells how wide it is.
#[test]
fn a_jackknife_over_the_landmarks_widens_what_errors_that_stay_leave_too_narrow() {
    let jackknife = LogOptions { jackknife_parts: POSTS as u32, ..options() };
    for kept in [0.9, 0.97] {
        let drives: Vec<Drive> = (0..DRIVES).map(|seed| drive(seed, Errors { kept, ..NONE })).collect();
        let [plain, wide] = [options(), jackknife]
            .map(|options| -> Vec<LogCalibration> { drives.iter().map(|drive| whole(drive, &options)).collect() });
        let [narrow, nees] = [&plain, &wide].map(|found| mean(found.iter().map(|found| nees(&found.estimate))));
        println!("of errors of which {kept} stays the NEES is {narrow:.2} of 3, with a jackknife {nees:.2}");
        assert!(nees < 0.8 * narrow, "{kept}: {narrow}, {nees}");
        for (plain, wide) in plain.iter().zip(&wide) {
            assert_eq!(plain.estimate.mounting, wide.estimate.mounting);
            let more = wide.estimate.covariance_xy_yaw - plain.estimate.covariance_xy_yaw;
            assert!(more.symmetric_eigenvalues().min() > -1e-12, "{more}");
        }
    }
}

#[test]
fn wheels_and_a_delay_are_found_with_the_mounting() {
    let mut options = LogOptions { estimate_odometry: true, estimate_time_offset: true, ..options() };
    options.filter.wheel_base_m = 0.97 * BASE_M;
    let alone = ConsistencyBand::of_mean(0.9999, 1, DRIVES).unwrap();
    for (turns, late_s) in
        [(Turns::Winding, 0.05), (Turns::Winding, -0.05), (Turns::Abrupt, 0.05), (Turns::Abrupt, -0.15)]
    {
        let errors = Errors { turns, imbalance: 0.01, late_s, ..NONE };
        let found: Vec<LogCalibration> = (0..DRIVES).map(|seed| whole(&drive(seed, errors), &options)).collect();
        let mean = |of: &dyn Fn(&LogCalibration) -> f64| mean(found.iter().map(of));
        let squares = [
            mean(&|found| ((found.time_offset_s - late_s) / found.time_offset_sigma_s).powi(2)),
            mean(&|found| ((found.wheels.imbalance - errors.imbalance) / found.wheels_sigma[0]).powi(2)),
            mean(&|found| ((found.wheels.base_m - BASE_M) / found.wheels_sigma[1]).powi(2)),
        ];
        let nees = mean(&|found| nees(&found.estimate));
        println!(
            "{turns:?} turns, {late_s} s late: {:.4} s in the mean, stated to {:.4}; mean squared errors of delay, imbalance and wheel base \
             in stated sigmas {squares:.2?}, NEES of the mounting {nees:.2} of 3",
            mean(&|found| found.time_offset_s),
            mean(&|found| found.time_offset_sigma_s),
        );
        assert!(squares.iter().all(|square| alone.holds(*square)) && band().holds(nees), "{squares:?}, {nees}");
    }
}

/// From bearings about a centre that is off by one to eight pixels where posts are seen at a radius of 150.
#[test]
fn an_image_centre_that_is_off_is_named_and_found_with_the_mounting() {
    let options = LogOptions { estimate_centre: true, ..options() };
    let alone = ConsistencyBand::of_mean(0.9999, 1, DRIVES).unwrap();
    for centre in [[0.0067, 0.0], [-0.012, 0.016], [0.0, -0.053]] {
        let drives: Vec<Drive> = (0..DRIVES).map(|seed| drive(seed, Errors { centre, ..NONE })).collect();
        for drive in &drives {
            let told = whole(drive, &self::options());
            // Eight pixels look like a bump as well.
            let named = |cause| cause == Cause::Centre || (cause == Cause::Bump && centre[1] < -0.05);
            assert!(told.estimate.suspect.is_some_and(|suspect| named(suspect.cause)), "{told}");
            let followed = followed(drive, CalibrationMethod::Default);
            assert!(!followed.reliable(), "{followed}");
        }
        let found: Vec<LogCalibration> = drives.iter().map(|drive| whole(drive, &options)).collect();
        let square = |found: &LogCalibration, k: usize| {
            ((found.centre_off_rad[k] - centre[k]) / found.centre_off_sigma_rad[k]).powi(2)
        };
        let squares = [0, 1].map(|k| mean(found.iter().map(|found| square(found, k))));
        let nees = mean(found.iter().map(|found| nees(&found.estimate)));
        println!(
            "a centre off by {centre:?}: mean squared errors in stated sigmas {squares:.2?}, NEES of the mounting {nees:.2} of 3"
        );
        assert!(squares.iter().all(|square| alone.holds(*square)) && band().holds(nees), "{squares:?}, {nees}");
        assert!(found.iter().all(LogCalibration::reliable));
    }
}

/// Early and late bearings of a robot whose turns begin at once are told by the solution that takes them to be on time.
#[test]
fn a_delay_that_nobody_asked_for_is_named() {
    for late_s in [-0.15, 0.15] {
        for seed in 0..4 {
            let found = whole(&drive(seed, Errors { turns: Turns::Abrupt, late_s, ..NONE }), &options());
            let suspect = found.estimate.suspect.unwrap();
            assert!(matches!(suspect.cause, Cause::TimeOffset) && !found.reliable(), "{found}");
            assert!(suspect.value.signum() == f64::signum(late_s), "{found}");
        }
    }
}

#[test]
fn a_log_that_was_misread_and_a_camera_that_was_pushed_are_told() {
    for seed in 0..4 {
        let mut swapped = drive(seed, NONE);
        swapped.readings.iter_mut().for_each(|read| std::mem::swap(&mut read.left_m, &mut read.right_m));
        let found = whole(&swapped, &options());
        assert!(matches!(found.misreading, Some(Misreading::Reflected)) && !found.reliable(), "{found}");
        let pushed = followed(&drive(seed, Errors { bump_m: 0.1, ..NONE }), CalibrationMethod::Default);
        assert!(pushed.alarm && !pushed.reliable(), "{pushed}");
    }
}
