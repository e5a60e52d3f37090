//! Whatever the image, the camera, the mounting and the options: an answer or an error of ours, and an answer that agrees
//! with itself.

#![allow(clippy::unwrap_used)]

mod scene;

use std::f64::consts::PI;
use std::sync::LazyLock;

use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use scene::{Image, constant, fisheye, noise, random, shrunk, stripes};
use tiltvp_core::camera::{Camera, Equidistant, Model};
use tiltvp_core::corner::{CornerDetector, DetectorOptions};
use tiltvp_core::edges::{EdgeOptions, Mask, NormalKind};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::image::ImageView;
use tiltvp_core::lines::{LineExtractor, LineOptions, Lines};
use tiltvp_core::robust::{LocalOptimization, SampleOrder, Sampling, Score};
use tiltvp_core::segments::{SegmentDetector, SegmentDetectorOptions, SegmentOptions, Segments};
use tiltvp_core::testing::zoo;
use tiltvp_core::tilt::{
    CommonDirectionOptions, Correction, ImageSpaceOptions, ImageSpaceRansacOptions, ImageSpaceRejectRefitOptions,
    Method, RefineOptions, SegmentsOptions, TiltEstimator, TiltOptions, TrainedCorrection, VectorConsensusOptions,
    common_direction,
};

/// The lenses of the zoo over images of a few thousand pixels: what is in pixels shrinks with them.
static SMALL: LazyLock<Vec<Camera>> = LazyLock::new(|| zoo().iter().map(|(_, camera)| shrunk(camera, 90)).collect());

fn cameras() -> impl Strategy<Value = Camera> {
    let constructed = (1u32..90, 1u32..90, 0.5..80.0f64, -20.0..110.0f64, -20.0..110.0f64, 0.1..PI, any::<bool>())
        .prop_map(|(width, height, focal, cx, cy, theta, mirror)| {
            let model = Model::Equidistant(Equidistant::new(focal, cx, cy).unwrap());
            let camera = Camera::new(width, height, model).unwrap().with_max_theta_rad(theta).unwrap();
            if mirror { camera.mirrored() } else { camera }
        });
    prop_oneof![
        3 => (0..SMALL.len()).prop_map(|i| SMALL[i].clone()),
        2 => constructed,
        1 => Just(fisheye(90)),
    ]
}

fn rotations() -> impl Strategy<Value = Matrix3<f64>> {
    let any = (-4.0..4.0f64, -4.0..4.0f64, -4.0..4.0f64)
        .prop_map(|(x, y, z)| Rotation3::from_scaled_axis(Vector3::new(x, y, z)).into_inner());
    let wrong = prop_oneof![
        Just(Matrix3::zeros()),
        Just(-Matrix3::identity()),
        Just(Matrix3::repeat(f64::NAN)),
        Just(Matrix3::identity() * 1.1),
    ];
    prop_oneof![4 => Just(Matrix3::identity()), 4 => any, 1 => wrong]
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    Noise,
    Constant(u8),
    Gradient(f64, f64),
    Stripes { count: usize, sigma: f64 },
    PixelStripes { period: usize, slope: usize },
    Dots,
}

fn kinds() -> impl Strategy<Value = Kind> {
    prop_oneof![
        Just(Kind::Noise),
        any::<u8>().prop_map(Kind::Constant),
        (-20.0..20.0f64, -20.0..20.0f64).prop_map(|(a, b)| Kind::Gradient(a, b)),
        (1..30usize, 0.0..10.0f64).prop_map(|(count, sigma)| Kind::Stripes { count, sigma }),
        (1..20usize, 0..5usize).prop_map(|(period, slope)| Kind::PixelStripes { period, slope }),
        Just(Kind::Dots),
    ]
}

fn draw(kind: Kind, camera: &Camera, mount: &Matrix3<f64>, seed: u64) -> Image {
    match kind {
        Kind::Noise => noise(camera, seed),
        Kind::Constant(level) => constant(camera, f64::from(level)),
        Kind::Gradient(a, b) => Image::of(camera, |u, v| 128.0 + a * u as f64 + b * v as f64),
        Kind::Stripes { count, sigma } => {
            let tilt = Tilt::from_alpha_beta(0.3 * random(seed, 0), 6.0 * random(seed, 1));
            stripes(camera, mount, &tilt, count, sigma, seed)
        }
        Kind::PixelStripes { period, slope } => {
            Image::of(camera, |u, v| if (u + slope * v) / period % 2 == 0 { 0.0 } else { 255.0 })
        }
        Kind::Dots => Image::of(camera, |u, v| if random(seed, (v * 1000 + u) as u64) < 0.003 { 255.0 } else { 0.0 }),
    }
}

/// Mostly numbers of the domain, now and then one that is not.
fn number(low: f64, high: f64) -> impl Strategy<Value = f64> {
    let odd = prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(-1.0),
        Just(0.0),
        Just(1e-300),
        Just(f64::MIN_POSITIVE),
        Just(1e300),
        Just(f64::MAX),
    ];
    prop_oneof![60 => low..high, 1 => odd]
}

fn sampling() -> impl Strategy<Value = Sampling> {
    let order = prop_oneof![
        Just(SampleOrder::Uniform),
        (0..100_000u32).prop_map(|uniform_after| SampleOrder::Progressive { uniform_after }),
    ];
    let local_optimization = proptest::option::of(
        (0..6u32, number(1.0, 4.0)).prop_map(|(iterations, widening)| LocalOptimization { iterations, widening }),
    );
    let score = prop_oneof![Just(Score::Count), Just(Score::Msac)];
    (order, local_optimization, score).prop_map(|(order, local_optimization, score)| Sampling {
        order,
        local_optimization,
        score,
    })
}

fn segments() -> impl Strategy<Value = SegmentOptions> {
    (number(0.0, 900.0), number(0.05, 9.0), number(0.01, 9.0), 4..60u32, number(0.0, 9.0)).prop_map(
        |(gradient_start, stray_max_px, rms_max_px, support_min_px, gap_max)| SegmentOptions {
            gradient_start,
            stray_max_px,
            rms_max_px,
            support_min_px,
            gap_max,
        },
    )
}

fn methods() -> impl Strategy<Value = Method> {
    let correction = || {
        prop_oneof![
            Just(Correction::None),
            Just(Correction::ClosedForm),
            number(5.0, 500.0).prop_map(Correction::factor)
        ]
    };
    let normal = prop_oneof![Just(NormalKind::Tangent), Just(NormalKind::Gradient)];
    prop_oneof![
        (number(0.1, 30.0), prop::option::of(number(1.0, 80.0)), correction(), sampling()).prop_map(
            |(threshold_px, offset_max_px, correction, sampling)| {
                let space = ImageSpaceOptions { offset_max_px, correction };
                Method::ImageSpaceRansac(ImageSpaceRansacOptions { threshold_px, space, sampling })
            }
        ),
        (number(0.01, 0.99), prop::option::of(number(1.0, 80.0)), correction()).prop_map(
            |(keep_fraction, offset_max_px, correction)| {
                let own = ImageSpaceRejectRefitOptions::default();
                Method::ImageSpaceRejectRefit(ImageSpaceRejectRefitOptions {
                    keep_fraction,
                    space: ImageSpaceOptions { offset_max_px, correction },
                    ..own
                })
            }
        ),
        (number(0.001, 1.0), normal, number(0.3, 3.0), sampling()).prop_map(
            |(threshold_rad, normal, factor, sampling)| {
                let correction = TrainedCorrection::Factor(factor);
                Method::VectorConsensus(VectorConsensusOptions { threshold_rad, normal, correction, sampling })
            }
        ),
        (number(0.01, 0.99), number(0.001, 0.9)).prop_map(|(keep_fraction, scale_rad)| Method::Refined(
            RefineOptions { keep_fraction, scale_rad, ..RefineOptions::default() }
        )),
        (segments(), number(0.001, 0.9), 2..200usize).prop_map(|(segments, scatter_rad, segments_max)| {
            Method::Segments(SegmentsOptions { segments, scatter_rad, segments_max })
        }),
    ]
}

fn edge_options() -> impl Strategy<Value = EdgeOptions> {
    (number(1.0, 900.0), number(0.0, 4.0), number(-1.5, 0.4), number(0.1, 1.5), number(0.0, 4.0)).prop_map(
        |(gradient_min, smoothing_px, elevation_min_rad, rise, margin_px)| EdgeOptions {
            gradient_min,
            smoothing_px,
            elevation_min_rad,
            elevation_max_rad: (elevation_min_rad + rise).min(1.57),
            margin_px,
        },
    )
}

fn options() -> impl Strategy<Value = TiltOptions> {
    (methods(), edge_options(), prop::option::of(number(0.01, 1.5)), 1..4u32, any::<u64>()).prop_map(
        |(method, edges, tilt_max_rad, row_stride, seed)| TiltOptions {
            method,
            edges,
            tilt_max_rad,
            mask: None,
            row_stride,
            seed,
        },
    )
}

/// No mask, one of the right size with holes, or one of another size.
fn masked(camera: &Camera, choice: u8, seed: u64) -> Option<Mask> {
    let (width, height) = (camera.width() as usize, camera.height() as usize);
    let holes = |n: usize| (0..n).map(|i| random(seed, i as u64 / 40) < 0.9).collect();
    match choice {
        0 => Some(Mask::new(width, height, holes(width * height)).unwrap()),
        1 => Some(Mask::new(width + 1, height, holes((width + 1) * height)).unwrap()),
        2 => Some(Mask::new(width, height, vec![false; width * height]).unwrap()),
        _ => None,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, rng_seed: prop::test_runner::RngSeed::Fixed(20), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn an_estimate_or_an_error(
        camera in cameras(),
        mount in rotations(),
        options in options(),
        mask in 0u8..12,
        kinds in prop::collection::vec(kinds(), 1..4),
        seed in any::<u32>(),
    ) {
        let options = TiltOptions { mask: masked(&camera, mask, u64::from(seed)), ..options };
        let Ok(estimator) = TiltEstimator::new(camera.clone(), mount, options) else { return Ok(()) };
        let mut scratch = estimator.scratch();
        for kind in kinds {
            let image = draw(kind, &camera, &mount, u64::from(seed));
            let found = estimator.estimate(&image.view(), &mut scratch).unwrap();
            prop_assert!(found.inlier_pixels <= found.prefiltered_pixels, "{:?}", found);
            prop_assert!(found.prefiltered_pixels <= found.edge_pixels, "{:?}", found);
            prop_assert!(found.edge_pixels <= estimator.region_pixels(), "{:?}", found);
            prop_assert!((0.0..=1.0).contains(&found.confidence), "{:?}", found);
            prop_assert_eq!(found.tilt.is_none(), found.stop.is_failure(), "{:?}", found);
            prop_assert_eq!(found.residual_rms.is_finite(), found.tilt.is_some(), "{:?}", found);
            prop_assert!(found.shift_px.is_none_or(|l| l.is_finite() && l >= 0.0), "{:?}", found);
            let covariance = found.covariance_rad2;
            if covariance.iter().all(|x| x.is_finite()) {
                prop_assert_eq!(covariance, covariance.transpose());
                prop_assert!(covariance.symmetric_eigenvalues().min() > 0.0, "{:?}", found);
                prop_assert!(found.tilt.is_some());
            } else {
                prop_assert!(covariance[(0, 0)].is_infinite() && covariance[(1, 1)].is_infinite(), "{:?}", found);
                prop_assert_eq!(found.confidence, 0.0);
            }
            if let Some(tilt) = found.tilt {
                prop_assert!((tilt.normal().norm() - 1.0).abs() < 1e-9, "{:?}", found);
                prop_assert!(tilt.normal().z >= 0.0, "a robot that leans by {} rad", tilt.alpha_rad());
            }
            let (again, elements) = estimator.estimate_with_elements(&image.view(), &mut scratch).unwrap();
            prop_assert_eq!(format!("{again:?}"), format!("{found:?}"));
            prop_assert_eq!(elements.len(), found.edge_pixels);
            prop_assert_eq!(elements.iter().filter(|e| e.prefiltered).count(), found.prefiltered_pixels);
            prop_assert_eq!(elements.iter().filter(|e| e.inlier).count(), found.inlier_pixels, "{:?}", found);
            prop_assert!(elements.iter().all(|e| e.prefiltered || !e.inlier));
            prop_assert!(elements.iter().all(|e| u32::from(e.u) < camera.width() && u32::from(e.v) < camera.height()));
        }
    }

    #[test]
    fn any_normals_and_options_have_a_common_direction_or_an_error(
        values in prop::collection::vec((number(-1.0, 1.0), number(-1.0, 1.0), number(-0.3, 0.3)), 0..40),
        weights in prop::option::of(prop::collection::vec(number(0.0, 10.0), 0..40)),
        sigma_rad in number(0.001, 0.999),
        prior in (number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0)),
        max_angle_rad in number(0.01, 1.57),
    ) {
        let normals: Vec<_> = values.iter().map(|&(x, y, z)| Vector3::new(x, y, z)).collect();
        let weights = weights.map(|mut w| { w.resize(normals.len(), 1.0); w });
        let prior = Vector3::new(prior.0, prior.1, prior.2);
        let options = CommonDirectionOptions { sigma_rad, prior, max_angle_rad };
        let Ok(found) = common_direction(&normals, weights.as_deref(), &options) else { return Ok(()) };
        prop_assert_eq!(found.inliers.len(), normals.len());
        prop_assert_eq!(found.direction.is_none(), found.stop.is_failure(), "{:?}", found);
        prop_assert!(found.covariance_rad2.iter().all(|x| !x.is_nan()), "{:?}", found);
        if let Some(direction) = found.direction {
            prop_assert!((direction.norm() - 1.0).abs() < 1e-9);
            let prior = (prior / prior.amax()).normalize();
            prop_assert!(direction.dot(&prior) >= max_angle_rad.cos() - 1e-9, "{:?} about {:?}", found, prior);
            prop_assert!(found.covariance_rad2.symmetric_eigenvalues().min() >= -1e-15 || !found.covariance_rad2[(0, 0)].is_finite());
        } else {
            prop_assert!(found.inliers.iter().all(|inlier| !inlier));
        }
    }

    #[test]
    fn any_bytes_are_an_image_or_an_error(
        data in prop::collection::vec(any::<u8>(), 0..400),
        width in prop_oneof![0..30usize, Just(usize::MAX)],
        height in prop_oneof![0..30usize, Just(usize::MAX)],
        stride in prop_oneof![0..40usize, Just(usize::MAX), Just(usize::MAX / 2)],
    ) {
        if let Ok(view) = ImageView::new(&data, width, height, stride) {
            for v in [0, 1, 2, height - 1, height, height + 5, usize::MAX] {
                prop_assert_eq!(view.row(v).len(), if v < height { width } else { 0 });
            }
        }
    }
}

#[test]
fn scratch_of_another_estimator_is_refused() {
    let make = |side, edges| {
        let options = TiltOptions { edges, ..TiltOptions::for_method("refined").unwrap() };
        TiltEstimator::new(fisheye(side), Matrix3::identity(), options).unwrap()
    };
    let own = make(120, EdgeOptions::default());
    let image = noise(own.camera(), 1);
    for other in [
        make(60, EdgeOptions::default()),
        make(180, EdgeOptions::default()),
        make(120, EdgeOptions { smoothing_px: 1.0, ..EdgeOptions::default() }),
    ] {
        let error = own.estimate(&image.view(), &mut other.scratch()).unwrap_err();
        assert!(error.to_string().starts_with("scratch"), "{error}");
    }
    // How strong an edge must be takes no other memory.
    let strict = EdgeOptions { gradient_min: 400.0, ..EdgeOptions::default() };
    for same in [EdgeOptions::default(), strict] {
        assert!(own.estimate(&image.view(), &mut make(120, same).scratch()).is_ok());
    }
}

/// The left or the right half of an image of even width: as many pixels of a fisheye, elsewhere.
fn half(side: usize, right: bool) -> Mask {
    let usable = (0..side * side).map(|i| (i % side >= side / 2) == right).collect();
    Mask::new(side, side, usable).unwrap()
}

#[test]
fn scratch_of_another_detector_or_extractor_is_refused() {
    let camera = fisheye(120);
    let image = noise(&camera, 1);
    let smooth = EdgeOptions { smoothing_px: 2.0, ..EdgeOptions::default() };
    let segments = |edges, mask| {
        let options = SegmentDetectorOptions { edges, mask, ..SegmentDetectorOptions::default() };
        SegmentDetector::new(camera.clone(), options).unwrap()
    };
    let [left, right] = [false, true].map(|right| Some(half(120, right)));
    let own = segments(EdgeOptions::default(), left.clone());
    for other in [segments(smooth, left.clone()), segments(EdgeOptions::default(), right.clone())] {
        let refused = own.detect(&image.view(), &mut other.scratch(), &mut Segments::default());
        assert!(refused.unwrap_err().to_string().starts_with("scratch"));
    }
    let lines = |method, edges, mask| {
        let options = LineOptions { edges, mask, ..LineOptions::for_method(method).unwrap() };
        LineExtractor::new(camera.clone(), Matrix3::identity(), options).unwrap()
    };
    let own = lines("great-circle", EdgeOptions::default(), left.clone());
    let others = [
        lines("great-circle", smooth, left.clone()),
        lines("great-circle", EdgeOptions::default(), right),
        lines("radial", EdgeOptions::default(), left),
    ];
    for other in others {
        let refused = own.extract(&image.view(), None, None, &mut other.scratch(), &mut Lines::default());
        assert!(refused.unwrap_err().to_string().starts_with("scratch"));
    }
    let corners =
        |method| CornerDetector::new(camera.clone(), DetectorOptions::for_method(method).unwrap(), None).unwrap();
    let refused =
        corners("general").detect_general(&image.view(), None, &mut corners("coloured").scratch(), &mut Vec::new());
    assert!(refused.unwrap_err().to_string().starts_with("scratch"));
}

#[test]
fn a_lean_of_no_angles_has_no_lines() {
    let extractor =
        LineExtractor::new(fisheye(120), Matrix3::identity(), LineOptions::for_method("great-circle").unwrap())
            .unwrap();
    let (image, mut scratch) = (noise(extractor.camera(), 1), extractor.scratch());
    for alpha_rad in [f64::NAN, f64::INFINITY] {
        let tilt = Tilt::from_alpha_beta(alpha_rad, 0.2);
        let refused = extractor.extract(&image.view(), Some(&tilt), None, &mut scratch, &mut Lines::default());
        assert!(refused.unwrap_err().to_string().starts_with("tilt"));
        let lines = extractor.lines_at(&[0.5], Some(&tilt));
        let refused = extractor.describe(&image.view(), &lines, &mut scratch, &mut Vec::new());
        assert!(refused.unwrap_err().to_string().starts_with("lines"));
    }
}
