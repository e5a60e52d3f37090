//! Straight edges of any picture under any options: arcs of unit bearings with variances above zero.
//!
//! A detector's tables take a hundred times what a picture takes. So most pictures are before detectors that are kept, each with the
//! memory that has served it: those of every lens with so many options of any values. Few are before one of options of their own.

use std::cell::RefCell;
use std::collections::HashMap;

use tiltvp_core::camera::Camera;
use tiltvp_core::edges::EdgeOptions;
use tiltvp_core::segments::{
    Segment, SegmentDetector, SegmentDetectorOptions, SegmentOptions, SegmentScratch, Segments,
};

use crate::bytes::Bytes;
use crate::picture::{Picture, SMALL};

/// Options of any values that are kept for each camera.
const KEPT_OPTIONS: u8 = 16;

thread_local! {
    /// The detectors that have been asked for, by camera and options; none where they are refused.
    static KEPT: RefCell<HashMap<(usize, u8), Option<(SegmentDetector, SegmentScratch)>>> = RefCell::default();
}

/// A picture before a detector of a small camera.
pub fn segments(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let which = bytes.below(SMALL.len());
    let camera = &SMALL[which];
    let choice = bytes.byte();
    if choice >= 252 {
        if let Some((detector, mut scratch)) = detector(camera, &mut bytes) {
            for _ in 0..2 {
                look(&detector, &mut scratch, &mut bytes);
            }
        }
        return;
    }
    let choice = choice % KEPT_OPTIONS;
    KEPT.with_borrow_mut(|kept| {
        let made = kept.entry((which, choice)).or_insert_with(|| {
            // Bytes that are apart for options that are one apart, by Knuth's multiplicative hash.
            let seeds: Vec<_> = (1..32)
                .flat_map(|k| (u64::from(choice) * 32 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15).to_be_bytes())
                .collect();
            detector(camera, &mut Bytes::new(&seeds))
        });
        if let Some((detector, scratch)) = made {
            look(detector, scratch, &mut bytes);
        }
    });
}

/// A detector of options of any values, unless they are refused.
fn detector(camera: &Camera, bytes: &mut Bytes<'_>) -> Option<(SegmentDetector, SegmentScratch)> {
    let own = SegmentDetectorOptions::default();
    let edges = EdgeOptions {
        gradient_min: bytes.mostly(1.0, 300.0),
        smoothing_px: bytes.mostly(0.0, 3.0),
        margin_px: bytes.mostly(1.0, 5.0),
        ..own.edges
    };
    let segments = SegmentOptions {
        gradient_start: bytes.mostly(0.0, 500.0),
        stray_max_px: bytes.mostly(0.05, 4.0),
        rms_max_px: bytes.mostly(0.01, 4.0),
        support_min_px: 4 + u32::from(bytes.byte() % 32),
        gap_max: bytes.mostly(0.0, 4.0),
    };
    let detector = SegmentDetector::new(camera.clone(), SegmentDetectorOptions { edges, segments, ..own }).ok()?;
    let scratch = detector.scratch();
    Some((detector, scratch))
}

/// A picture by memory that has served, and now and then by memory that has not.
fn look(detector: &SegmentDetector, scratch: &mut SegmentScratch, bytes: &mut Bytes<'_>) {
    let picture = Picture::of(detector.camera(), 1, bytes);
    let mut found = Segments::default();
    detector.detect(&picture.view(), scratch, &mut found).expect("an image of the camera");
    for segment in &found.list {
        check(segment, &found, detector.options().segments);
    }
    assert!(found.list.is_sorted_by(|a, b| a.length_rad >= b.length_rad));
    if bytes.byte().is_multiple_of(4) {
        let mut again = Segments::default();
        detector.detect(&picture.view(), &mut detector.scratch(), &mut again).expect("an image of the camera");
        assert_eq!(found, again, "memory that has served tells");
    }
}

fn check(segment: &Segment, found: &Segments, options: SegmentOptions) {
    for unit in [segment.normal, segment.middle, segment.ends[0], segment.ends[1]] {
        assert!((unit.norm() - 1.0).abs() < 1e-9, "{segment:?}");
    }
    for on in [segment.middle, segment.ends[0], segment.ends[1]] {
        assert!(segment.normal.dot(&on).abs() < 1e-6, "{segment:?}");
    }
    assert!(segment.length_rad > 0.0 && segment.length_rad <= std::f64::consts::PI, "{segment:?}");
    assert!(segment.variances_rad2.iter().all(|x| *x > 0.0 && x.is_finite()), "{segment:?}");
    assert!(segment.rms_px >= 0.0 && segment.rms_px <= options.rms_max_px, "{segment:?}");
    assert!(segment.px_per_rad > 0.0 && segment.px_per_rad.is_finite(), "{segment:?}");
    assert!(segment.contrast >= 0.0 && segment.contrast.is_finite(), "{segment:?}");
    assert!(segment.support() >= options.support_min_px as usize, "{segment:?}");
    assert_eq!(found.points_of(segment).len(), segment.support());
}
