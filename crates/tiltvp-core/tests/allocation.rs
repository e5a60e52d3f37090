//! After the first image an estimate takes no memory from the heap, whatever the image.

#![allow(clippy::unwrap_used)]

mod scene;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use nalgebra::Matrix3;
use scene::{constant, fisheye, noise, stripes};
use tiltvp_core::camera::Camera;
use tiltvp_core::edges::NormalKind;
use tiltvp_core::geometry::Tilt;
use tiltvp_core::lines::{LineExtractor, LineOptions, Lines};
use tiltvp_core::robust::{LocalOptimization, SampleOrder, Sampling, Score};
use tiltvp_core::segments::{SegmentDetector, SegmentDetectorOptions, Segments};
use tiltvp_core::selfcalib::{SelfCalibrator, SelfCalibratorOptions, WheelMotion};
use tiltvp_core::tilt::{Correction, METHODS, Method, TiltEstimator, TiltOptions, TrainedCorrection};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, counting the requests of each thread.
struct Counting;

fn count() {
    // While a thread ends its counter is gone, and nothing is measured.
    let _ = ALLOCATIONS.try_with(|n| n.set(n.get() + 1));
}

// SAFETY: every call is handed to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn allocations(work: impl FnOnce()) -> usize {
    let before = ALLOCATIONS.get();
    work();
    ALLOCATIONS.get() - before
}

/// The defaults of every method, and every choice that runs other code.
fn choices() -> Vec<TiltOptions> {
    let mut all: Vec<_> = METHODS.map(|name| TiltOptions::for_method(name).unwrap()).into();
    for mut options in all.clone() {
        let sampling = match &mut options.method {
            Method::ImageSpaceRansac(own) => Some(&mut own.sampling),
            Method::VectorConsensus(own) => Some(&mut own.sampling),
            Method::ImageSpaceRejectRefit(_) | Method::Refined(_) | Method::Segments(_) => None,
        };
        if let Some(sampling) = sampling {
            *sampling = Sampling {
                order: SampleOrder::progressive(),
                local_optimization: Some(LocalOptimization::default()),
                score: Score::Msac,
            };
            all.push(options);
        }
    }
    for options in all.clone() {
        let mut other = options;
        match &mut other.method {
            Method::ImageSpaceRansac(own) => own.space.correction = Correction::None,
            Method::ImageSpaceRejectRefit(own) => own.space.correction = Correction::None,
            Method::VectorConsensus(own) => {
                (own.normal, own.correction) = (NormalKind::Tangent, TrainedCorrection::Factor(1.7));
            }
            Method::Refined(_) | Method::Segments(_) => other.edges.smoothing_px = 2.0,
        }
        // Every pixel of a noisy image is an edge.
        other.edges.gradient_min = 1e-3;
        other.tilt_max_rad = Some(1.5);
        all.push(other);
    }
    all
}

fn camera() -> Camera {
    fisheye(200)
}

#[test]
fn no_estimate_after_the_first_allocates() {
    let camera = camera();
    let few = stripes(&camera, &Matrix3::identity(), &Tilt::from_alpha_beta(0.05, 1.0), 5, 0.0, 1);
    let many = stripes(&camera, &Matrix3::identity(), &Tilt::from_alpha_beta(0.05, 1.0), 40, 3.0, 1);
    let images = [constant(&camera, 128.0), few, many, noise(&camera, 7), noise(&camera, 8)];
    for options in choices() {
        let estimator = TiltEstimator::new(camera.clone(), Matrix3::identity(), options).unwrap();
        let mut scratch = estimator.scratch();
        // The first image has no edge at all: nothing can have grown to fit the next.
        estimator.estimate(&images[0].view(), &mut scratch).unwrap();
        let by_segments = matches!(estimator.options().method, Method::Segments(_));
        if by_segments {
            // Lists of straight edges grow with what images hold.
            for image in &images {
                estimator.estimate(&image.view(), &mut scratch).unwrap();
            }
        }
        let mut most = 0;
        for (i, image) in images.iter().enumerate() {
            let mut edges = 0;
            let taken = allocations(|| edges = estimator.estimate(&image.view(), &mut scratch).unwrap().edge_pixels);
            assert_eq!(taken, 0, "image {i}, {edges} edge pixels, {:?}", estimator.options());
            most = most.max(edges);
        }
        // Noise has edge pixels everywhere, and few straight edges.
        let enough = if by_segments { 1000 } else { estimator.region_pixels() * 4 / 10 };
        assert!(most > enough, "{most} of {} pixels", estimator.region_pixels());
    }
}

#[test]
fn no_detection_of_straight_edges_allocates_once_lists_have_grown() {
    let camera = camera();
    let few = stripes(&camera, &Matrix3::identity(), &Tilt::from_alpha_beta(0.05, 1.0), 5, 0.0, 1);
    let many = stripes(&camera, &Matrix3::identity(), &Tilt::from_alpha_beta(0.05, 1.0), 40, 3.0, 1);
    let images = [constant(&camera, 128.0), few, many, noise(&camera, 7)];
    let detector = SegmentDetector::new(camera, SegmentDetectorOptions::default()).unwrap();
    let (mut scratch, mut found) = (detector.scratch(), Segments::default());
    for image in &images {
        detector.detect(&image.view(), &mut scratch, &mut found).unwrap();
    }
    let mut most = 0;
    for (i, image) in images.iter().enumerate() {
        let taken = allocations(|| detector.detect(&image.view(), &mut scratch, &mut found).unwrap());
        assert_eq!(taken, 0, "image {i}, {} edges", found.list.len());
        most = most.max(found.list.len());
    }
    // A stable sort allocates from some twenty on.
    assert!(most > 30, "{most} edges");
}

#[test]
fn no_extraction_of_lines_allocates_once_lists_have_grown() {
    let camera = camera();
    let tilt = Tilt::from_alpha_beta(0.05, 1.0);
    let few = stripes(&camera, &Matrix3::identity(), &tilt, 5, 0.0, 1);
    let many = stripes(&camera, &Matrix3::identity(), &tilt, 40, 3.0, 1);
    let images = [constant(&camera, 128.0), few, many, noise(&camera, 7)];
    let extractor = LineExtractor::new(camera, Matrix3::identity(), LineOptions::default()).unwrap();
    let (mut scratch, mut found) = (extractor.scratch(), Lines::default());
    for image in &images {
        extractor.extract(&image.view(), Some(&tilt), Some(0.002), &mut scratch, &mut found).unwrap();
    }
    let mut most = 0;
    for (i, image) in images.iter().enumerate() {
        let taken = allocations(|| {
            extractor.extract(&image.view(), Some(&tilt), Some(0.002), &mut scratch, &mut found).unwrap();
        });
        assert_eq!(taken, 0, "image {i}, {} lines", found.lines.len());
        most = most.max(found.lines.len());
    }
    // A stable sort allocates from some twenty on.
    assert!(most > 25, "{most} lines");
}

/// Were the matrices moved for each, two thousand in one step would take twenty seconds.
#[test]
fn landmarks_that_begin_in_one_step_are_given_room_at_once() {
    let taken = [50, 400].map(|n: u32| {
        let options = SelfCalibratorOptions { wheel_base_m: 0.4, ..SelfCalibratorOptions::default() };
        let mut filter = SelfCalibrator::new(options).unwrap();
        let bearings: Vec<f64> = (0..n).map(|i| 6.0 * f64::from(i) / f64::from(n) - 3.0).collect();
        let names: Vec<u64> = (0..n.into()).collect();
        let motion = WheelMotion { left_m: 0.1, right_m: 0.1 };
        allocations(|| assert_eq!(filter.step(&motion, &names, &bearings).unwrap().started, names.len()))
    });
    assert!(taken[1] < taken[0] + 100, "{taken:?}");
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![1u8; 100]))), 1);
}
