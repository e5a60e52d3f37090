//! An estimate by way of edge pixels is the estimate at once, to the last bit, and estimators made from one another are as good
//! as new ones.

#![allow(clippy::unwrap_used)]

mod scene;

use std::sync::Arc;

use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use scene::{Image, constant, fisheye, noise, stripes};
use tiltvp_core::edges::{EdgeOptions, Mask, NormalKind};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::tilt::{Correction, ImageEdges, METHODS, Method, TiltEstimate, TiltEstimator, TiltOptions};

const SIDE: u32 = 160;

/// An estimate as text, in which NaN equals NaN and every digit counts.
fn digits(estimate: &TiltEstimate) -> String {
    format!("{estimate:?}")
}

fn images() -> Vec<Image> {
    let camera = fisheye(SIDE);
    let lean = |i: u32| Tilt::from_alpha_beta(0.03 * f64::from(i), f64::from(i));
    let mut images = vec![constant(&camera, 90.0), noise(&camera, 1), noise(&camera, 2)];
    images.extend((0..5).map(|i| stripes(&camera, &Matrix3::identity(), &lean(i), 23, 3.0, u64::from(i))));
    // Lines of one pixel, as they are drawn into images.
    let mut drawn = stripes(&camera, &Matrix3::identity(), &lean(1), 5, 3.0, 9);
    for (i, level) in drawn.data.iter_mut().enumerate().filter(|(i, _)| i % 7 == 0) {
        *level = if (i / drawn.width) % 80 < 40 { 255 } else { *level };
    }
    images.push(drawn);
    images
}

/// The methods of edge pixels: straight edges are found in the image, in every row.
fn pixel_methods() -> impl Iterator<Item = &'static str> {
    METHODS.into_iter().filter(|name| *name != "segments")
}

/// The defaults of every method of edge pixels, and prefilters from hardly any to hardly anything.
fn choices() -> Vec<TiltOptions> {
    let mut all = Vec::new();
    for name in pixel_methods() {
        for tilt_max_rad in [None, Some(1.4), Some(0.3), Some(0.02), Some(1e-4), Some(1e-6)] {
            for gradient_min in [None, Some(1.0), Some(700.0)] {
                let mut options = TiltOptions { tilt_max_rad, ..TiltOptions::for_method(name).unwrap() };
                options.edges.gradient_min = gradient_min.unwrap_or(options.edges.gradient_min);
                all.push(options);
            }
        }
    }
    all
}

fn new(options: TiltOptions) -> TiltEstimator {
    TiltEstimator::new(fisheye(SIDE), Matrix3::identity(), options).unwrap()
}

#[test]
fn stages_give_what_the_whole_gives() {
    let images = images();
    let mut tilts = 0;
    for options in choices() {
        let estimator = new(options);
        let (mut scratch, mut other) = (estimator.scratch(), estimator.scratch());
        let staged: Vec<_> = images.iter().map(|image| estimator.detect(&image.view(), &mut other).unwrap()).collect();
        for (image, edges) in images.iter().zip(&staged) {
            let whole = estimator.estimate(&image.view(), &mut scratch).unwrap();
            let by_stages = estimator.estimate_edges(edges, &mut other).unwrap();
            assert_eq!(digits(&whole), digits(&by_stages), "{:?}", estimator.options());
            assert_eq!(edges.len(), whole.edge_pixels);
            tilts += usize::from(whole.tilt.is_some());
        }
    }
    assert!(tilts > 200, "{tilts}");
}

#[test]
fn estimators_with_other_options_are_as_good_as_new() {
    let images = images();
    let all = choices();
    let first = new(all[0].clone());
    let mut chain = first.clone();
    let mut scratch = first.scratch();
    for options in all {
        let fresh = new(options.clone());
        // Once from the first, once from whatever was before.
        chain = chain.with_options(options.clone()).unwrap();
        let direct = first.with_options(options).unwrap();
        for image in &images[1..5] {
            let expected = digits(&fresh.estimate(&image.view(), &mut fresh.scratch()).unwrap());
            for estimator in [&chain, &direct] {
                let found = if estimator.shares_scratch_with(&first) {
                    estimator.estimate(&image.view(), &mut scratch)
                } else {
                    estimator.estimate(&image.view(), &mut estimator.scratch())
                };
                assert_eq!(digits(&found.unwrap()), expected, "{:?}", estimator.options());
            }
        }
    }
}

#[test]
fn every_kind_of_change_is_taken_up() {
    let n = SIDE as usize;
    let image = &images()[4];
    let changes: [fn(&mut TiltOptions); 9] = [
        |o| o.edges.gradient_min *= 1.5,
        |o| o.edges.smoothing_px += 1.0,
        |o| o.edges.elevation_min_rad = 0.2,
        |o| o.edges.elevation_max_rad = 0.5,
        |o| o.edges.margin_px = 6.0,
        |o| o.row_stride = 3,
        |o| o.mask = Some(Mask::new(160, 160, (0..160 * 160).map(|i| i % 160 > 50).collect()).unwrap()),
        |o| match &mut o.method {
            Method::ImageSpaceRansac(own) => own.space.correction = Correction::None,
            Method::ImageSpaceRejectRefit(own) => own.space.correction = Correction::None,
            Method::VectorConsensus(own) => own.normal = NormalKind::Tangent,
            Method::Refined(own) => own.scale_rad = 0.01,
            Method::Segments(own) => own.scatter_rad = 0.1,
        },
        |o| o.method = Method::from_name("vector-consensus").unwrap(),
    ];
    assert_eq!(image.width, n);
    for name in pixel_methods() {
        let start = new(TiltOptions::for_method(name).unwrap());
        for (i, change) in changes.iter().enumerate() {
            let mut options = start.options().clone();
            change(&mut options);
            let (fresh, made) = (new(options.clone()), start.with_options(options).unwrap());
            let answers = [&fresh, &made]
                .map(|estimator| digits(&estimator.estimate(&image.view(), &mut estimator.scratch()).unwrap()));
            assert_eq!(answers[0], answers[1], "{name}, change {i}");
            // And back again.
            let back = made.with_options(start.options().clone()).unwrap();
            let answers = [&start, &back]
                .map(|estimator| digits(&estimator.estimate(&image.view(), &mut estimator.scratch()).unwrap()));
            assert_eq!(answers[0], answers[1], "{name}, change {i} undone");
        }
    }
    let mut wrong = new(TiltOptions::for_method("refined").unwrap()).options().clone();
    wrong.edges.gradient_min = -1.0;
    assert!(new(TiltOptions::for_method("refined").unwrap()).with_options(wrong).is_err());
}

#[test]
fn edges_of_another_origin_are_refused_with_what_differs() {
    let image = &images()[4];
    let estimator = new(TiltOptions::for_method("refined").unwrap());
    let mut scratch = estimator.scratch();
    let refusal = |edges: &ImageEdges| {
        let error = estimator.estimate_edges(edges, &mut estimator.scratch()).unwrap_err().to_string();
        assert!(error.starts_with("edges: got"), "{error}");
        error
    };
    let with = |change: fn(&mut EdgeOptions)| {
        let mut options = estimator.options().clone();
        change(&mut options.edges);
        let other = estimator.with_options(options).unwrap();
        refusal(&other.detect(&image.view(), &mut other.scratch()).unwrap())
    };
    assert!(with(|o| o.gradient_min = 300.0).contains("gradient_min = 300, expected gradient_min = 150"));
    assert!(with(|o| o.smoothing_px = 1.5).contains("smoothing_px = 1.5"));
    assert!(with(|o| o.elevation_min_rad = 0.1).contains("elevation_min_rad = 0.1"));
    assert!(with(|o| o.elevation_max_rad = 0.5).contains("elevation_max_rad = 0.5"));
    assert!(with(|o| o.margin_px = 3.0).contains("margin_px = 3"));

    let mask = Some(Mask::new(160, 160, vec![true; 160 * 160]).unwrap());
    let masked = estimator.with_options(TiltOptions { mask, ..estimator.options().clone() }).unwrap();
    let edges = masked.detect(&image.view(), &mut masked.scratch()).unwrap();
    assert!(refusal(&edges).contains("mask = a mask, expected mask = no mask"));

    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.1).into_inner();
    let turned = TiltEstimator::new(fisheye(SIDE), turn, estimator.options().clone()).unwrap();
    assert!(refusal(&turned.detect(&image.view(), &mut turned.scratch()).unwrap()).contains("robot_from_camera"));

    let camera = fisheye(SIDE).with_max_theta_rad(1.5).unwrap();
    let narrow = TiltEstimator::new(camera, Matrix3::identity(), estimator.options().clone()).unwrap();
    assert!(refusal(&narrow.detect(&image.view(), &mut narrow.scratch()).unwrap()).contains("camera"));

    // Another method, and an estimator made anew, are no other origin.
    let edges = estimator.detect(&image.view(), &mut scratch).unwrap();
    let mut options = TiltOptions::for_method("vector-consensus").unwrap();
    options.edges = estimator.options().edges;
    assert!(new(options).estimate_edges(&edges, &mut scratch).is_ok());
    assert_eq!(new(estimator.options().clone()).detect(&image.view(), &mut scratch).unwrap(), edges);
}

#[test]
fn wrong_edges_are_refused() {
    let estimator = new(TiltOptions::for_method("refined").unwrap());
    let origin = estimator.detect(&images()[4].view(), &mut estimator.scratch()).unwrap().origin().clone();
    let make = |slots: &[u32], gx: &[f32]| ImageEdges::new(Arc::clone(&origin), slots, gx, gx);
    assert!(make(&[0, 1], &[1.0]).unwrap_err().to_string().contains("as many"));
    assert!(make(&[1, 1], &[1.0, 2.0]).unwrap_err().to_string().contains("ascending"));
    assert!(make(&[1, 2], &[1.0, f32::NAN]).unwrap_err().to_string().contains("finite"));
    let beyond = make(&[3, u32::MAX], &[200.0, 300.0]).unwrap();
    assert!(estimator.estimate_edges(&beyond, &mut estimator.scratch()).unwrap_err().to_string().contains("below"));
    let none = make(&[], &[]).unwrap();
    assert!(none.is_empty() && estimator.estimate_edges(&none, &mut estimator.scratch()).unwrap().tilt.is_none());
    assert!(none.clone().with_steps(&[5, 5]).unwrap_err().to_string().contains("ascending"));
    assert_eq!(none.clone().with_steps(&[2, 5]).unwrap().steps(), [2, 5]);
    let off = Vector2::new(3.0, -2.0);
    assert_eq!(none.clone().with_centre_off_px(Some(off)).unwrap().centre_off_px(), Some(off));
    assert!(none.with_centre_off_px(Some(off * f64::NAN)).unwrap_err().to_string().contains("centre"));
}

#[test]
fn a_blurred_image_is_as_blurred_on_every_second_row() {
    // Steps of twenty pixels, in mean levels of as many columns.
    let mut image = stripes(&fisheye(SIDE), &Matrix3::identity(), &Tilt::from_alpha_beta(0.0, 0.0), 23, 0.0, 1);
    let width = image.width;
    for row in image.data.chunks_mut(width) {
        let levels: Vec<u32> = row.iter().map(|level| u32::from(*level)).collect();
        for (u, level) in row.iter_mut().enumerate() {
            let near = &levels[u.saturating_sub(10)..(u + 10).min(width)];
            *level = (near.iter().sum::<u32>() / near.len() as u32) as u8;
        }
    }
    let blur = |row_stride| {
        let estimator = new(TiltOptions { row_stride, ..TiltOptions::for_method("refined").unwrap() });
        estimator.detect(&image.view(), &mut estimator.scratch()).unwrap().blur_rad()
    };
    assert!(blur(1) > 0.01);
    assert!((blur(2) / blur(1) - 1.0).abs() < 1e-12);
}
