//! Pictures one after the other before estimators of corners' poses, with anything known of them: refused, or rotations.

use std::cell::RefCell;
use std::collections::HashMap;

use nalgebra::{Matrix3, Rotation3, Vector3};
use tiltvp_core::corner::{
    CameraTurn, CornerDetector, CornerPoseEstimator, DetectorOptions, EstimatorOptions, Frame, FrameKnowledge,
    GravityDirection,
};
use tiltvp_core::geometry::validate_rotation;

use crate::bytes::Bytes;
use crate::picture::{Picture, SMALL};

thread_local! {
    /// The estimators that have been asked for, by camera, with what they have seen; none where a camera does not see enough.
    static KEPT: RefCell<HashMap<usize, Option<CornerPoseEstimator>>> = RefCell::default();
}

fn estimator(which: usize) -> Option<CornerPoseEstimator> {
    let options = DetectorOptions::for_method("general").expect("one of the methods");
    let detector = CornerDetector::new(SMALL[which].clone(), options, None).ok()?;
    CornerPoseEstimator::new(detector, None, EstimatorOptions::default()).ok()
}

/// Frames of a small camera.
pub fn sequence(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let which = bytes.below(SMALL.len());
    KEPT.with_borrow_mut(|kept| {
        let Some(estimator) = kept.entry(which).or_insert_with(|| estimator(which)) else { return };
        if bytes.flag() {
            estimator.reset();
        }
        for _ in 0..=bytes.byte() % 3 {
            let picture = Picture::of(&SMALL[which], 1, &mut bytes);
            let known = knowledge(&mut bytes);
            let Ok(found) = estimator.observe(&Frame::Gray(picture.view()), None, &known) else { continue };
            for one in &found.hypotheses {
                assert!(validate_rotation(&one.camera_from_object).is_ok(), "{known:?} {one:?}");
                assert!((0.0..=1.0 + 1e-9).contains(&one.probability), "{known:?} {one:?}");
            }
        }
    });
}

fn knowledge(bytes: &mut Bytes<'_>) -> FrameKnowledge {
    let vector = |bytes: &mut Bytes<'_>| Vector3::from_fn(|_, _| bytes.mostly(-1.0, 1.0));
    let gravity = bytes.flag().then(|| {
        let any = vector(bytes);
        let down = if bytes.byte() < 250 { any.try_normalize(1e-9).unwrap_or(any) } else { any };
        GravityDirection { down, sigma_rad: bytes.mostly(0.0, 0.3) }
    });
    let turn = bytes.flag().then(|| CameraTurn {
        before_from_now: Rotation3::from_scaled_axis(vector(bytes)).into_inner(),
        covariance: Matrix3::from_diagonal(&vector(bytes).map(|x| x * x * 0.01)),
    });
    FrameKnowledge { gravity, turn }
}
