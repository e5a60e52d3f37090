//! The self-calibration: steps of both filters amid a drive, linearisations anew included, and a whole log.

#![allow(clippy::unwrap_used)]

use divan::{Bencher, counter::ItemsCount};
use nalgebra::{Matrix3, Vector3};
use tiltvp_core::selfcalib::{
    CalibrationMethod, LogBearing, LogOptions, Mounting, SelfCalibrator, SelfCalibratorOptions, calibrate_log,
};
use tiltvp_synth::{BearingDrive, BearingDriveKind, BearingDriveOptions};

/// Steps that are timed, the last of the drive.
const STEPS: usize = 60;

fn main() {
    divan::main();
}

fn drive(landmarks: usize) -> BearingDrive {
    BearingDrive::new(&BearingDriveOptions {
        kind: BearingDriveKind::Alternating,
        landmarks,
        ..BearingDriveOptions::default()
    })
}

fn options(method: CalibrationMethod) -> SelfCalibratorOptions {
    SelfCalibratorOptions {
        method,
        wheel_base_m: 0.4,
        start: Mounting { x_m: 0.2, y_m: 0.0, yaw_rad: 0.0 },
        start_covariance: Matrix3::from_diagonal(&Vector3::new(0.04, 0.04, 0.36)),
        ..SelfCalibratorOptions::default()
    }
}

fn steps(bencher: Bencher<'_, '_>, method: CalibrationMethod, landmarks: usize) {
    let drive = drive(landmarks);
    let names: Vec<u64> = (0..landmarks as u64).collect();
    let mut calibrator = SelfCalibrator::new(options(method)).unwrap();
    let (before, timed) = drive.readings.split_at(drive.readings.len() - STEPS);
    for (reading, bearings) in before.iter().zip(&drive.bearings_rad) {
        calibrator.step(reading, &names, bearings).unwrap();
    }
    let seen = &drive.bearings_rad[before.len()..];
    bencher.counter(ItemsCount::new(STEPS)).with_inputs(|| calibrator.clone()).bench_values(|mut calibrator| {
        for (reading, bearings) in timed.iter().zip(seen) {
            calibrator.step(reading, &names, bearings).unwrap();
        }
        calibrator
    });
}

#[divan::bench(args = [10, 100])]
fn default_steps(bencher: Bencher<'_, '_>, landmarks: usize) {
    steps(bencher, CalibrationMethod::Default, landmarks);
}

#[divan::bench(args = [10, 100])]
fn paper_steps(bencher: Bencher<'_, '_>, landmarks: usize) {
    steps(bencher, CalibrationMethod::Paper, landmarks);
}

#[divan::bench]
fn whole_log(bencher: Bencher<'_, '_>) {
    let drive = drive(10);
    let mut bearings = Vec::new();
    for (step, seen) in drive.bearings_rad.iter().enumerate() {
        let row =
            |(landmark, bearing): (usize, &f64)| LogBearing { step, landmark: landmark as u64, bearing_rad: *bearing };
        bearings.extend(seen.iter().enumerate().map(row));
    }
    let options = LogOptions { filter: options(CalibrationMethod::Default), ..LogOptions::default() };
    bencher.bench(|| calibrate_log(&options, &drive.readings, None, &bearings).unwrap());
}
