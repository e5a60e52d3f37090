//! How many instructions an image, a pair or a step takes: the same number on a busy machine as on a quiet one, held to a limit.
//!
//! Valgrind runs this very program (it knows vectors of 256 bits, not of 512). Limits are rewritten by hand, beside the change
//! that earns or costs them.

#![allow(clippy::unwrap_used, clippy::panic)]

mod scene;

use std::collections::BTreeMap;
use std::hint::black_box;
use std::process::Command;

use nalgebra::{Matrix3, Vector3};
use scene::{Image, cube, fisheye, round, stripes};
use tiltvp_core::corner::{
    CornerDetector, CornerPoseEstimator, DetectorOptions, EstimatorOptions, Frame, FrameKnowledge,
};
use tiltvp_core::geometry::{RigidMotion, Tilt};
use tiltvp_core::image::ImageView;
use tiltvp_core::lines::{LineExtractor, LineOptions, LineScratch, Lines};
use tiltvp_core::selfcalib::{SelfCalibrator, SelfCalibratorOptions, WheelMotion};
use tiltvp_core::tilt::{METHODS, Scratch, TiltEstimate, TiltEstimator, TiltOptions};

/// Most instructions in the profile of the tests (with its checks of overflows; optimised builds take fewer), in thousands, by
/// the names that valgrind shows: a twentieth to a tenth more than when they were last looked at.
const LIMITS: [(&str, u64); 11] = [
    // The tilt of one image of 240 x 240 pixels, of stripes that go on over the vertical: some are left out as lines overhead.
    ("refined_image", 3850),
    ("sampled_image", 1115),
    ("trimmed_image", 1050),
    ("consensus_image", 600),
    ("segments_image", 4100),
    // Its lines, and their descriptors.
    ("extracted_lines", 2660),
    ("described_lines", 30_800),
    // Two images of 320 x 180 pixels to the corner of the coloured cube in each.
    ("segmented_pair", 4740),
    // The same in grey, by straight edges, to the poses before both.
    ("general_pair", 120_000),
    // Ten steps of the self-calibration amid a drive, with 10 and with 100 landmarks.
    ("steps_among_10", 19_000),
    ("steps_among_100", 345_000),
];

type Measured = fn(&TiltEstimator, &ImageView<'_>, &mut Scratch) -> Option<TiltEstimate>;

/// One image by one method, under a name of its own.
macro_rules! measured {
    ($($name:ident)*) => {
        $(
            #[inline(never)]
            fn $name(estimator: &TiltEstimator, image: &ImageView<'_>, scratch: &mut Scratch) -> Option<TiltEstimate> {
                // Functions of the same code would be made one.
                black_box(stringify!($name));
                black_box(estimator.estimate(image, scratch).ok())
            }
        )*
    };
}

measured!(refined_image sampled_image trimmed_image consensus_image segments_image);

/// What valgrind looks at: everything once, after a first time that grows its memory.
#[test]
#[ignore = "run under valgrind by the other test"]
fn measured_once() {
    let camera = fisheye(240);
    let tilt = Tilt::from_alpha_beta(0.05, 0.7);
    let image: Image = stripes(&camera, &Matrix3::identity(), &tilt, 23, 2.0, 1);
    let functions: [(&str, Measured); METHODS.len()] = [
        ("refined", refined_image),
        ("image-space-ransac", sampled_image),
        ("image-space-reject-refit", trimmed_image),
        ("vector-consensus", consensus_image),
        ("segments", segments_image),
    ];
    for (method, function) in functions {
        let options = TiltOptions::for_method(method).unwrap();
        let estimator = TiltEstimator::new(camera.clone(), Matrix3::identity(), options).unwrap();
        let mut scratch = estimator.scratch();
        estimator.estimate(&image.view(), &mut scratch).unwrap();
        assert!(function(&estimator, &image.view(), &mut scratch).unwrap().tilt.is_some());
    }

    let options = LineOptions::for_method("great-circle").unwrap();
    let extractor = LineExtractor::new(camera, Matrix3::identity(), options).unwrap();
    let (mut scratch, mut lines, mut values) = (extractor.scratch(), Lines::default(), Vec::new());
    extractor.extract(&image.view(), Some(&tilt), None, &mut scratch, &mut lines).unwrap();
    extractor.describe(&image.view(), &lines, &mut scratch, &mut values).unwrap();
    extracted_lines(&extractor, &image.view(), &tilt, &mut scratch, &mut lines);
    described_lines(&extractor, &image.view(), &lines, &mut scratch, &mut values);
    assert!(lines.lines.len() > 10 && values.len() == 192 * lines.lines.len(), "{} lines", lines.lines.len());

    let detector =
        CornerDetector::new(cube::pinhole(), DetectorOptions::for_method("coloured").unwrap(), None).unwrap();
    let pair = [0.0, 0.12].map(cube::cube);
    assert!(detector.detect_coloured(&cube::view(&pair[1]), None, &mut detector.scratch()).unwrap().is_some());
    assert_eq!(segmented_pair(&detector, &pair), 2);

    let grey = pair.map(|bytes| bytes.chunks(3).map(|bgr| bgr[1] / 2 + bgr[2] / 2).collect());
    let side = || CornerDetector::new(cube::pinhole(), DetectorOptions::for_method("general").unwrap(), None).unwrap();
    let left_from_right =
        RigidMotion::new("left_from_right", Matrix3::identity(), Vector3::new(0.12, 0.0, 0.0)).unwrap();
    let right = Some((side(), left_from_right));
    let mut estimator = CornerPoseEstimator::new(side(), right, EstimatorOptions::default()).unwrap();
    general_pair(&mut estimator, &grey);
    // What follows is to be looked for everywhere again.
    estimator.reset();
    assert!(general_pair(&mut estimator, &grey));

    for (landmarks, function) in [(10, steps_among_10 as Steps), (100, steps_among_100)] {
        let drive = round::drive(landmarks, 60);
        let names: Vec<u64> = (0..landmarks as u64).collect();
        let options = SelfCalibratorOptions { wheel_base_m: round::WHEEL_BASE_M, ..SelfCalibratorOptions::default() };
        let mut calibrator = SelfCalibrator::new(options).unwrap();
        let (before, last) = drive.split_at(drive.len() - 10);
        for (motion, bearings) in before {
            calibrator.step(motion, &names, bearings).unwrap();
        }
        assert!(function(&mut calibrator, last, &names) > 9 * landmarks);
    }
}

#[inline(never)]
fn extracted_lines(
    extractor: &LineExtractor,
    image: &ImageView<'_>,
    tilt: &Tilt,
    scratch: &mut LineScratch,
    out: &mut Lines,
) {
    extractor.extract(black_box(image), Some(tilt), None, scratch, out).unwrap();
}

#[inline(never)]
fn described_lines(
    extractor: &LineExtractor,
    image: &ImageView<'_>,
    lines: &Lines,
    scratch: &mut LineScratch,
    out: &mut Vec<f32>,
) {
    extractor.describe(black_box(image), lines, scratch, out).unwrap();
}

/// How many corners are found.
#[inline(never)]
fn segmented_pair(detector: &CornerDetector, pair: &[Vec<u8>; 2]) -> usize {
    let mut scratch = detector.scratch();
    let found = |bytes: &Vec<u8>| detector.detect_coloured(&cube::view(black_box(bytes)), None, &mut scratch).unwrap();
    pair.iter().filter_map(found).count()
}

/// Whether there is a pose.
#[inline(never)]
fn general_pair(estimator: &mut CornerPoseEstimator, pair: &[Vec<u8>; 2]) -> bool {
    let [left, right] =
        pair.each_ref().map(|grey| Frame::Gray(ImageView::new(black_box(grey), 320, 180, 320).unwrap()));
    estimator.observe(&left, Some(&right), &FrameKnowledge::default()).unwrap().pose().is_some()
}

type Steps = fn(&mut SelfCalibrator, &[(WheelMotion, Vec<f64>)], &[u64]) -> usize;

/// Steps, under a name of their own; how many bearings they used.
macro_rules! steps {
    ($($name:ident)*) => {
        $(
            #[inline(never)]
            fn $name(calibrator: &mut SelfCalibrator, drive: &[(WheelMotion, Vec<f64>)], names: &[u64]) -> usize {
                // Functions of the same code would be made one.
                black_box(stringify!($name));
                drive.iter().map(|(motion, bearings)| calibrator.step(motion, names, bearings).unwrap().used).sum()
            }
        )*
    };
}

steps!(steps_among_10 steps_among_100);

/// Inclusive cost by callee, of the first call of each.
fn costs(profile: &str) -> BTreeMap<String, u64> {
    let mut costs = BTreeMap::new();
    let mut lines = profile.lines();
    let mut callee = "";
    while let Some(line) = lines.next() {
        if let Some(name) = line.strip_prefix("cfn=") {
            callee = name;
        } else if line.starts_with("calls=") {
            let cost = lines.next().and_then(|line| line.split(' ').nth(1)).and_then(|cost| cost.parse().ok());
            costs.entry(callee.to_owned()).or_insert(cost.unwrap_or(0));
        }
    }
    costs
}

#[test]
fn nothing_takes_more_instructions_than_it_may() {
    let out = std::env::temp_dir().join(format!("tiltvp-instructions-{}", std::process::id()));
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--compress-strings=no", "--compress-pos=no"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "measured_once", "--ignored", "--test-threads=1"])
        .output()
        .unwrap_or_else(|error| panic!("this test needs valgrind (`apt-get install valgrind`): {error}"));
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let profile = std::fs::read_to_string(&out).unwrap();
    std::fs::remove_file(&out).unwrap();
    let costs = costs(&profile);
    let mut above = Vec::new();
    for (name, limit) in LIMITS {
        // Names end with a hash in front of which is the name.
        let cost = costs.iter().find(|(callee, _)| callee.ends_with(name) || callee.contains(&format!("{name}::")));
        let cost = cost.map_or_else(|| panic!("{name} is not in the profile"), |(_, cost)| *cost / 1000);
        println!("{name}: {cost} thousand instructions, at most {limit}");
        if cost > limit {
            above.push(format!("{name} takes {cost} thousand instructions, more than {limit}"));
        }
    }
    assert!(above.is_empty(), "{}", above.join("; "));
}
