//! States of filters, calibrators and trackers with anything changed: refused, or filters that go on and stay finite.

use std::sync::LazyLock;

use nalgebra::{Matrix2, Matrix6, Vector3};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::lines::{Followed, FrameMemory, LineTracker, Motion, Parallax, TrackerOptions, TrackerState};
use tiltvp_core::selfcalib::{CalibrationMethod, Mounting, SelfCalibrator, SelfCalibratorOptions, WheelMotion};
use tiltvp_core::tilt::{MountingOptions, TiltFilter, TiltFilterOptions};

use crate::bytes::Bytes;
use crate::matching::lines;

/// A tilt filter or a line tracker.
pub fn state(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    if bytes.flag() { filter(&mut bytes) } else { tracker(&mut bytes) }
}

/// What calibrators keep after some steps, as bytes.
static KEPT: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let mut kept = Vec::new();
    for method in [CalibrationMethod::Default, CalibrationMethod::Paper] {
        let start = Mounting { x_m: 0.1, y_m: 0.05, yaw_rad: 0.2 };
        let options = SelfCalibratorOptions { method, start, wheel_base_m: 0.4, ..SelfCalibratorOptions::default() };
        let mut calibrator = SelfCalibrator::new(options).expect("options");
        for k in 0..7 {
            if [0, 1, 6].contains(&k) {
                kept.push(postcard::to_stdvec(&calibrator).expect("bytes"));
            }
            let turn = f64::from(k) * 0.05;
            let motion = WheelMotion { left_m: 0.04, right_m: 0.06 };
            calibrator.step(&motion, &[1, 2, 3], &[0.1 - turn, 1.2 - turn, -2.0 - turn]).expect("a step");
        }
    }
    kept
});

/// The bytes of a calibrator, of which some are others; then steps, each of which takes a hundred times what one of the others takes.
pub fn calibrator(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let mut kept = KEPT[bytes.below(KEPT.len())].clone();
    for _ in 0..bytes.byte() % 5 {
        let place = usize::from(bytes.word()) % kept.len();
        match bytes.byte() % 4 {
            0 => kept[place] = bytes.byte(),
            1 => {
                let number = bytes.number().to_le_bytes();
                let end = (place + 8).min(kept.len());
                kept[place..end].copy_from_slice(&number[..end - place]);
            }
            2 => kept.truncate(place.max(1)),
            _ => kept.insert(place, bytes.byte()),
        }
    }
    let read = postcard::from_bytes::<SelfCalibrator>(&kept).ok();
    let Some(mut calibrator) = read.filter(SelfCalibrator::is_well_formed) else { return };
    for _ in 0..bytes.byte() % 4 {
        let motion = WheelMotion { left_m: bytes.mostly(-0.2, 0.2), right_m: bytes.mostly(-0.2, 0.2) };
        let landmarks: Vec<u64> = (0..bytes.byte() % 5).map(|_| bytes.byte().into()).collect();
        let bearings: Vec<f64> = landmarks.iter().map(|_| bytes.mostly(-3.2, 3.2)).collect();
        let before = calibrator.clone();
        if calibrator.step(&motion, &landmarks, &bearings).is_err() {
            assert!(
                format!("{before:?}") == format!("{calibrator:?}"),
                "a step that was refused has changed the state"
            );
        }
    }
    let _ = (calibrator.estimate().to_string(), calibrator.landmarks());
    assert!(calibrator.reset().is_ok());
}

/// A filter's state with numbers that are others; then steps.
fn filter(bytes: &mut Bytes<'_>) {
    let mounting = bytes.flag().then(MountingOptions::default);
    let options = TiltFilterOptions { mounting, ..TiltFilterOptions::default() };
    let mut filter = TiltFilter::new(options).expect("options");
    let own = Matrix2::identity() * 1e-4;
    for k in 0..bytes.byte() % 4 {
        let tilt = Tilt::from_alpha_beta(0.02 + 0.01 * f64::from(k), 0.3);
        filter.update_tilt(Some(tilt), &own, 0.9);
    }
    let mut state = filter.state().clone();
    for _ in 0..bytes.byte() % 4 {
        let number = bytes.number();
        let place = bytes.below(36);
        match bytes.below(10) {
            0 => state.floor[place % 3] = number,
            1 => state.mounting[place % 3] = number,
            2 => state.scene[place % 2] = number,
            3 => {
                let other = Matrix6::from_fn(|i, j| if i == place / 6 && j == place % 6 { number } else { 0.0 });
                state.covariance += other + other.transpose();
            }
            4 => state.covariance *= number,
            5 => state.common = state.common.map(|common| common * number),
            6 => state.driven_m = number,
            7 => state.rolled_m = number,
            8 => state.latest = Some((Vector3::new(number, 0.0, 1.0).normalize(), own * number)),
            _ => {
                let normal = Vector3::new(bytes.number(), number, 1.0);
                let normal = normal.try_normalize(0.0).unwrap_or(normal);
                state.pending = Some((normal, own * number));
                (state.agreeing, state.rejected) = (bytes.long() as u32, bytes.long() as u32);
            }
        }
    }
    let Ok(mut filter) = TiltFilter::with_state(options, state.clone()) else { return };
    for _ in 0..bytes.byte() % 6 {
        let _ = filter.predict(bytes.mostly(-3.2, 3.2), bytes.mostly(-1.0, 1.0));
        let normal = Vector3::new(bytes.mostly(-0.3, 0.3), bytes.mostly(-0.3, 0.3), bytes.mostly(0.5, 1.0));
        let (a, b) = (bytes.mostly(0.0, 0.01), bytes.mostly(0.0, 0.01));
        let _ = filter.update_normal(&normal, &Matrix2::new(a, 0.0, 0.0, b));
        for told in [Some(filter.estimate()), Some(filter.floor()), filter.mounting()].into_iter().flatten() {
            assert!(told.tilt.is_none_or(|tilt| (tilt.normal().norm() - 1.0).abs() < 1e-9), "{state:?} {told:?}");
            assert!(told.sigma_rad >= 0.0 && (0.0..=1.0).contains(&told.confidence), "{state:?} {told:?}");
        }
        assert!(TiltFilter::with_state(options, filter.state().clone()).is_ok(), "{state:?} {:?}", filter.state());
    }
}

/// Any state of a tracker; then frames.
fn tracker(bytes: &mut Bytes<'_>) {
    let width = bytes.below(5);
    let mut state = TrackerState {
        next_frame: if bytes.flag() { bytes.byte().into() } else { bytes.long() },
        next_track: if bytes.flag() { bytes.byte().into() } else { bytes.long() },
        ..TrackerState::default()
    };
    for _ in 0..bytes.byte() % 4 {
        let tracks: Vec<u64> = (0..bytes.byte() % 4).map(|_| bytes.byte().into()).collect();
        let numbers = tracks.len() * width + bytes.below(8) / 7;
        let descriptors = (0..numbers).map(|_| bytes.number() as f32).collect();
        state.frames.push_back(FrameMemory { tracks, descriptors });
    }
    for _ in 0..bytes.byte() % 4 {
        state.followed.push(Followed {
            track: bytes.byte().into(),
            seen: bytes.byte().into(),
            parallax: Parallax {
                bearing_rad: bytes.number(),
                inverse_distance: bytes.number(),
                covariance: [bytes.number(), bytes.number(), bytes.number()],
                is_metric: bytes.flag(),
            },
            polarity: bytes.mostly(-1.0, 1.0),
            descriptor: (0..width).map(|_| bytes.number() as f32).collect(),
        });
    }
    let Ok(mut tracker) = LineTracker::with_state(TrackerOptions::default(), state) else { return };
    let mut out = Vec::new();
    for _ in 0..=bytes.byte() % 3 {
        let lines = lines(&mut *bytes);
        let descriptors: Vec<f32> = (0..lines.lines.len() * width).map(|_| bytes.mostly(0.0, 1.0) as f32).collect();
        let motion = bytes.flag().then(|| Motion {
            turn_rad: bytes.mostly(-1.0, 1.0),
            distance_m: bytes.flag().then(|| bytes.mostly(-1.0, 1.0)),
        });
        if tracker.update(&lines, &descriptors, motion.as_ref(), &mut out).is_ok() {
            assert_eq!(out.len(), lines.lines.len());
            let mut tracks: Vec<_> = out.iter().map(|line| line.track).collect();
            tracks.sort_unstable();
            assert!(tracks.windows(2).all(|two| two[0] != two[1]), "one track of two lines: {out:?}");
            assert!(LineTracker::with_state(TrackerOptions::default(), tracker.state().clone()).is_ok());
        }
    }
}
