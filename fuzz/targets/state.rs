//! The bytes of a pickled `SelfCalibrator`, damaged: refused, or a calibrator that takes steps.

#![no_main]

use std::sync::LazyLock;

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use tiltvp_core::selfcalib::{SelfCalibrator, SelfCalibratorOptions, WheelMotion};

#[derive(Debug, Arbitrary)]
struct Input {
    after: u8,
    edits: Vec<(u16, u8)>,
    cut: Option<u16>,
    steps: Vec<(f32, f32, Vec<(u8, f32)>)>,
}

/// States of a drive past three things, after each of its steps.
static STATES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let options = SelfCalibratorOptions { wheel_base_m: 0.4, ..SelfCalibratorOptions::default() };
    let Ok(mut one) = SelfCalibrator::new(options) else { return Vec::new() };
    let mut states = Vec::new();
    for k in 0..24u32 {
        states.extend(postcard::to_stdvec(&one).ok());
        let turn = if k % 3 == 0 { 0.02 } else { 0.0 };
        let motion = WheelMotion { left_m: 0.05 - turn, right_m: 0.05 + turn };
        let bearings: Vec<f64> = (0..3).map(|i| 0.9 * f64::from(i) + 0.01 * f64::from(k)).collect();
        if one.step(&motion, &[0, 1, 2], &bearings).is_err() {
            break;
        }
    }
    states
});

fuzz_target!(|input: Input| {
    let mut bytes = STATES[usize::from(input.after) % STATES.len()].clone();
    for (place, value) in &input.edits {
        let count = bytes.len();
        bytes[usize::from(*place) % count] = *value;
    }
    if let Some(cut) = input.cut {
        bytes.truncate(usize::from(cut));
    }
    let read = postcard::from_bytes::<SelfCalibrator>(&bytes).ok();
    let Some(mut one) = read.filter(SelfCalibrator::is_well_formed) else { return };
    let _ = one.estimate();
    for (left, right, seen) in input.steps.iter().take(6) {
        let motion = WheelMotion { left_m: f64::from(*left), right_m: f64::from(*right) };
        let (landmarks, bearings): (Vec<u64>, Vec<f64>) =
            seen.iter().take(8).map(|(landmark, bearing)| (u64::from(*landmark), f64::from(*bearing))).unzip();
        let _ = one.step(&motion, &landmarks, &bearings);
        let _ = one.estimate();
    }
});
