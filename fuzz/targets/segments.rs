//! The straight edges of any image with any options: unit normals, finite covariances, ends that are there.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use tiltvp_core::image::ImageView;
use tiltvp_core::segments::{SegmentDetector, SegmentDetectorOptions, Segments};
use tiltvp_fuzz::{Choice, Picture, set_cheap};

#[derive(Debug, Arbitrary)]
struct Input {
    choices: Vec<Choice>,
    picture: Picture,
}

fuzz_target!(|input: Input| {
    let ([width, height], levels) = (input.picture.size(), input.picture.levels());
    let Ok(image) = ImageView::new(&levels, width, height, input.picture.stride()) else { return };
    let Some(camera) = input.picture.camera() else { return };
    let mut options = SegmentDetectorOptions::default();
    set_cheap(&mut options, &input.choices);
    let Ok(detector) = SegmentDetector::new(camera, options) else { return };
    let (mut scratch, mut found, mut again) = (detector.scratch(), Segments::default(), Segments::default());
    assert!(detector.detect(&image, &mut scratch, &mut found).is_ok());
    for segment in &found.list {
        assert!((segment.normal.norm() - 1.0).abs() < 1e-9, "a normal {:?}", segment.normal);
        let finite = segment.variances_rad2.iter().all(|variance| *variance >= 0.0 && variance.is_finite());
        assert!(finite, "variances {:?}", segment.variances_rad2);
        assert!(!found.points_of(segment).is_empty());
    }
    assert!(detector.detect(&image, &mut scratch, &mut again).is_ok());
    assert!(found == again, "another answer of the same image");
});
