//! Same seed, same bytes: for repeated calls, for scratch that has seen other images, and for any number of threads.

#![allow(clippy::unwrap_used)]

mod scene;

use nalgebra::Matrix3;
use scene::{Image, constant, fisheye, noise, stripes};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::image::ImageView;
use tiltvp_core::tilt::{METHODS, TiltEstimate, TiltEstimator, TiltOptions};

/// Every number of an estimate as its bits, so that NaN equals NaN and 0 does not equal -0.
fn bits(estimate: &TiltEstimate) -> Vec<u64> {
    let TiltEstimate {
        tilt,
        covariance_rad2,
        confidence,
        edge_pixels,
        prefiltered_pixels,
        inlier_pixels,
        shift_px,
        alternatives,
        residual_rms,
        iterations,
        stop,
        doubt,
    } = *estimate;
    let reason = format!("{stop:?} {doubt:?}");
    let mut floats = vec![confidence, residual_rms, shift_px.unwrap_or(-1.0)];
    floats.extend(covariance_rad2.iter());
    floats.extend(tilt.map_or([2.0; 3], |tilt| tilt.normal().into()));
    for alternative in alternatives.iter().flatten() {
        floats.push(alternative.probability);
        floats.extend(alternative.normal.iter());
    }
    let counts = [edge_pixels, prefiltered_pixels, inlier_pixels, iterations as usize];
    floats.into_iter().map(f64::to_bits).chain(counts.map(|n| n as u64)).chain(reason.bytes().map(u64::from)).collect()
}

fn images() -> Vec<Image> {
    let camera = fisheye(160);
    let identity = Matrix3::identity();
    let mut images = vec![constant(&camera, 90.0), noise(&camera, 1)];
    for i in 0..6u32 {
        let tilt = Tilt::from_alpha_beta(0.015 * f64::from(i), f64::from(i));
        images.push(stripes(&camera, &identity, &tilt, 23, 3.0, u64::from(i)));
    }
    images.push(noise(&camera, 2));
    images
}

fn estimators() -> impl Iterator<Item = TiltEstimator> {
    METHODS.into_iter().map(|name| {
        let options = TiltOptions { seed: 11, ..TiltOptions::for_method(name).unwrap() };
        TiltEstimator::new(fisheye(160), Matrix3::identity(), options).unwrap()
    })
}

#[test]
fn repeated_calls_and_used_scratch_give_the_same_bytes() {
    let images = images();
    for estimator in estimators() {
        let name = estimator.options().method.name();
        let mut used = estimator.scratch();
        let fresh = |image: &Image| estimator.estimate(&image.view(), &mut estimator.scratch()).unwrap();
        let first: Vec<_> = images.iter().map(|image| bits(&fresh(image))).collect();
        assert!(images.iter().filter(|image| fresh(image).tilt.is_some()).count() >= 6, "{name}");
        for round in 0..2 {
            for (i, image) in images.iter().enumerate().rev() {
                let again = bits(&estimator.estimate(&image.view(), &mut used).unwrap());
                assert_eq!(again, first[i], "{name}, image {i}, round {round}");
                let listed = estimator.estimate_with_elements(&image.view(), &mut used).unwrap();
                let afresh = estimator.estimate_with_elements(&image.view(), &mut estimator.scratch()).unwrap();
                assert_eq!(bits(&listed.0), first[i], "{name}");
                assert_eq!(format!("{:?}", listed.1), format!("{:?}", afresh.1), "{name}");
            }
        }
    }
}

#[test]
fn estimators_made_twice_and_row_strides_give_the_same_bytes() {
    let image = &images()[4];
    let stride = image.width + 13;
    let padded: Vec<u8> = image.data.chunks(image.width).flat_map(|row| row.iter().copied().chain([255; 13])).collect();
    let strided = ImageView::new(&padded, image.width, image.height, stride).unwrap();
    for (one, two) in estimators().zip(estimators()) {
        let a = one.estimate(&image.view(), &mut one.scratch()).unwrap();
        let b = two.estimate(&strided, &mut two.scratch()).unwrap();
        assert_eq!(bits(&a), bits(&b), "{}", one.options().method.name());
    }
}

#[test]
fn one_two_and_four_threads_give_the_same_bytes() {
    let images = images();
    let views: Vec<_> = images.iter().chain(&images).map(Image::view).collect();
    for estimator in estimators() {
        let name = estimator.options().method.name();
        let alone: Vec<_> =
            views.iter().map(|view| bits(&estimator.estimate(view, &mut estimator.scratch()).unwrap())).collect();
        for threads in [1, 2, 4] {
            let many = estimator.estimate_many(&views, threads).unwrap();
            assert_eq!(many.iter().map(bits).collect::<Vec<_>>(), alone, "{name}, {threads} threads");
        }
    }
}

#[test]
fn another_seed_is_another_sample_of_the_methods_that_sample() {
    let image = &images()[4];
    for name in ["image-space-ransac", "vector-consensus"] {
        let with = |seed| {
            let options = TiltOptions { seed, ..TiltOptions::for_method(name).unwrap() };
            let estimator = TiltEstimator::new(fisheye(160), Matrix3::identity(), options).unwrap();
            bits(&estimator.estimate(&image.view(), &mut estimator.scratch()).unwrap())
        };
        assert!((1..6).any(|seed| with(seed) != with(0)), "{name}");
    }
}

#[test]
fn the_error_of_many_images_is_that_of_the_first_wrong_one() {
    let estimator = estimators().next().unwrap();
    let right = noise(&fisheye(160), 1);
    let wrong: Vec<_> = (100..130).map(|side| noise(&fisheye(side), 1)).collect();
    let mut views: Vec<_> = (0..9).map(|_| right.view()).collect();
    views.extend(wrong.iter().map(Image::view));
    let expected = estimator.estimate_many(&views, 1).unwrap_err();
    for threads in [2, 4] {
        for _ in 0..20 {
            assert_eq!(estimator.estimate_many(&views, threads).unwrap_err(), expected, "{threads} threads");
        }
    }
    assert!(estimator.estimate_many(&views[..3], 0).unwrap_err().to_string().contains("threads"));
    assert_eq!(estimator.estimate_many(&[], 2).unwrap(), []);
}
