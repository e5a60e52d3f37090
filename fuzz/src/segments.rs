//! Straight edges of any picture under any options: arcs of unit bearings with variances above zero.

use tiltvp_core::edges::EdgeOptions;
use tiltvp_core::segments::{Segment, SegmentDetector, SegmentDetectorOptions, SegmentOptions, Segments};

use crate::bytes::Bytes;
use crate::picture::{Picture, SMALL};

/// A detector of a small camera and two pictures, the second with the memory of the first.
pub fn segments(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let camera = &SMALL[bytes.below(SMALL.len())];
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
    let Ok(detector) = SegmentDetector::new(camera.clone(), SegmentDetectorOptions { edges, segments, ..own }) else {
        return;
    };
    let (mut scratch, mut found, mut again) = (detector.scratch(), Segments::default(), Segments::default());
    for _ in 0..2 {
        let picture = Picture::of(camera, 1, &mut bytes);
        detector.detect(&picture.view(), &mut scratch, &mut found).expect("an image of the camera");
        for segment in &found.list {
            check(segment, &found, segments);
        }
        assert!(found.list.is_sorted_by(|a, b| a.length_rad >= b.length_rad));
    }
    let picture = Picture::of(camera, 1, &mut bytes);
    detector.detect(&picture.view(), &mut scratch, &mut found).expect("an image of the camera");
    detector.detect(&picture.view(), &mut detector.scratch(), &mut again).expect("an image of the camera");
    assert_eq!(found, again, "memory that has served tells");
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
