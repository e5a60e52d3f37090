//! The tilt filter: its gate, when it jumps and when it abstains, its options, and laws that hold on any drive.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix2, Rotation3, Vector2, Vector3};
use proptest::prelude::*;
use tiltvp_core::geometry::{Tilt, angle_between};
use tiltvp_core::robust::Stop;
use tiltvp_core::tilt::{
    ALTERNATIVES, MountingOptions, TiltEstimate, TiltFilter, TiltFilterOptions, TiltFilterState, Verdict,
};

const DEGREE: f64 = PI / 180.0;

fn settled(options: TiltFilterOptions, normal: &Vector3<f64>) -> TiltFilter {
    let mut filter = TiltFilter::new(options).unwrap();
    for _ in 0..20 {
        filter.predict(0.0, 0.05).unwrap();
        assert!(filter.update_normal(normal, &small()).unwrap().accepted());
    }
    filter
}

fn small() -> Matrix2<f64> {
    Matrix2::identity() * (0.4 * DEGREE).powi(2)
}

fn lean(degrees: f64, beta_rad: f64) -> Vector3<f64> {
    Tilt::from_alpha_beta(degrees * DEGREE, beta_rad).normal()
}

#[test]
fn a_step_is_followed_within_three_images() {
    let mut filter = settled(TiltFilterOptions::default(), &lean(0.5, 0.3));
    let after = lean(5.0, 1.0);
    let mut verdicts = Vec::new();
    for _ in 0..3 {
        filter.predict(0.0, 0.05).unwrap();
        verdicts.push(filter.update_normal(&after, &small()).unwrap());
    }
    assert_eq!(verdicts.iter().map(|v| v.name()).collect::<Vec<_>>(), ["outside-gate", "outside-gate", "jumped"]);
    assert!(angle_between(&filter.estimate().tilt.unwrap().normal(), &after) < 0.05 * DEGREE);
    filter.predict(0.0, 0.05).unwrap();
    assert_eq!(filter.update_normal(&after, &small()).unwrap().name(), "accepted");
}

#[test]
fn a_step_is_followed_while_turning() {
    let mut filter = settled(TiltFilterOptions::default(), &Vector3::z());
    let mut after = lean(4.0, 0.0);
    for expected in ["outside-gate", "outside-gate", "jumped", "accepted"] {
        after = Rotation3::from_axis_angle(&Vector3::z_axis(), -0.8) * after;
        filter.predict(0.8, 0.05).unwrap();
        assert_eq!(filter.update_normal(&after, &small()).unwrap().name(), expected);
    }
}

#[test]
fn what_the_gate_has_rejected_turns_with_the_robot() {
    let mut filter = settled(TiltFilterOptions::default(), &Vector3::z());
    assert_eq!(filter.update_normal(&lean(10.0, 0.3), &small()).unwrap().name(), "outside-gate");
    let (_, before) = filter.state().pending.unwrap();
    filter.predict(1.0, 0.0).unwrap();
    let (pending, after) = filter.state().pending.unwrap();
    assert!(angle_between(&pending, &lean(10.0, 0.3 - 1.0)) < 1e-9, "{pending}");
    assert!((1.0..1.5).contains(&(after.trace() / before.trace())), "{before} {after}");
}

#[test]
fn single_bad_images_change_nothing() {
    let truth = lean(1.0, -0.7);
    let mut filter = settled(TiltFilterOptions::default(), &truth);
    let mut twin = filter.clone();
    for i in 0..30 {
        filter.predict(0.0, 0.05).unwrap();
        twin.predict(0.0, 0.05).unwrap();
        if i % 3 == 0 {
            let verdict = filter.update_normal(&lean(6.0, f64::from(i)), &small()).unwrap();
            assert_eq!(verdict.name(), "outside-gate");
            assert!(verdict.nis().unwrap() > filter.nis_limit(), "{verdict}");
        } else {
            assert!(filter.update_normal(&truth, &small()).unwrap().accepted());
            assert!(twin.update_normal(&truth, &small()).unwrap().accepted());
        }
        assert_eq!(filter.estimate(), twin.estimate());
    }
    assert_eq!(filter.state(), twin.state());
}

#[test]
fn images_that_agree_with_nothing_end_in_abstaining() {
    let options = TiltFilterOptions::default();
    let mut filter = settled(options, &Vector3::z());
    for i in 1..=options.lost_after {
        assert!(filter.estimate().tilt.is_some());
        let verdict = filter.update_normal(&lean(8.0, 2.4 * f64::from(i)), &small()).unwrap();
        assert_eq!(verdict.name(), if i < options.lost_after { "outside-gate" } else { "lost" });
    }
    assert!(filter.estimate().tilt.is_none());
    assert!(filter.estimate().sigma_rad >= options.prior_rad);
    assert_eq!(filter.update_normal(&lean(3.0, 0.0), &small()).unwrap().name(), "accepted");
    assert!(filter.estimate().tilt.is_some());
}

#[test]
fn a_filter_without_images_abstains_again() {
    let mut filter = settled(TiltFilterOptions::default(), &Vector3::z());
    let mut steps = 0;
    while filter.estimate().tilt.is_some() {
        filter.predict(0.0, 0.1).unwrap();
        steps += 1;
        assert!(steps < 1000);
    }
    assert!(steps > 3);
    let abstaining = filter.estimate();
    assert!(abstaining.sigma_rad > abstaining.sigma_max_rad && abstaining.to_string().contains("beyond the limit"));
    assert!(abstaining.confidence < settled(TiltFilterOptions::default(), &Vector3::z()).estimate().confidence);
}

fn image(tilt: Option<Tilt>, sigma_rad: f64, confidence: f64) -> TiltEstimate {
    TiltEstimate {
        tilt,
        covariance_rad2: Matrix2::identity() * (sigma_rad * sigma_rad),
        confidence,
        edge_pixels: 0,
        prefiltered_pixels: 0,
        inlier_pixels: 0,
        shift_px: None,
        alternatives: [None; ALTERNATIVES],
        residual_rms: f64::NAN,
        iterations: 0,
        stop: Stop::NoModel { trials: 0 },
        doubt: None,
    }
}

#[test]
fn images_that_say_nothing_are_left_out() {
    let mut filter = settled(TiltFilterOptions::default(), &lean(1.0, 0.0));
    let before = filter.clone();
    assert_eq!(filter.update(&image(None, f64::INFINITY, 0.0)), Verdict::NoTilt);
    assert_eq!(filter.update(&image(Some(Tilt::UPRIGHT), f64::INFINITY, 1.0)), Verdict::NoTilt);
    let unsure = filter.update(&image(Some(Tilt::UPRIGHT), 0.01, 0.49));
    assert_eq!(unsure, Verdict::LowConfidence { confidence: 0.49, limit: 0.5 });
    assert!(unsure.to_string().contains("0.490") && unsure.to_string().contains("0.500"));
    assert!(!filter.update(&image(Some(Tilt::UPRIGHT), 0.01, f64::NAN)).accepted());
    assert!(!filter.update(&image(Some(Tilt::from_alpha_beta(f64::NAN, 0.0)), 0.01, 0.99)).accepted());
    assert_eq!(filter, before);
    assert!(filter.update(&image(Some(Tilt::UPRIGHT), 0.01, 0.51)).accepted());
}

/// A driver that gives one image again and again made the filter sure of what was true where it was taken.
#[test]
fn a_frozen_camera_is_left_out_once_the_wheels_have_rolled() {
    for (yaw_rad, distance_m) in [(0.0, 0.006), (0.04, 0.0)] {
        let mut filter = TiltFilter::new(TiltFilterOptions::default()).unwrap();
        let mut step = |alpha_rad: f64, yaw_rad: f64, distance_m: f64| {
            filter.predict(yaw_rad, distance_m).unwrap();
            let tilt = (alpha_rad > 0.0).then(|| Tilt::from_alpha_beta(alpha_rad, 0.1));
            (filter.update(&image(tilt, 0.008, 0.9)), filter.estimate().sigma_rad)
        };
        assert!(step(0.03, 1.0, 1.0).0.accepted() && (0..50).all(|_| step(0.03, 0.0, 0.0).0.accepted()));
        assert!(step(0.03, yaw_rad, distance_m).0.accepted());
        let (verdict, sure) = step(0.03, yaw_rad, distance_m);
        let Verdict::Repeated { rolled_m, limit_m: 0.01 } = verdict else { panic!("{verdict}") };
        assert!((rolled_m - 0.012).abs() < 1e-12 && !verdict.accepted() && verdict.nis().is_none());
        assert!(verdict.name() == "repeated" && verdict.to_string().contains("rolled 0.012 m, at most 0.010 m"));
        assert!(step(0.03, 0.0, 1.0).1 > sure);
        assert_eq!(step(0.0, 0.0, 0.0).0, Verdict::NoTilt);
        let names = [0.03, 0.030_001, 0.03, 0.2, 0.2, 0.2].map(|alpha_rad| step(alpha_rad, 0.0, 0.1).0.name());
        // Nor does it come to agree with itself outside the gate.
        assert_eq!(names, ["repeated", "accepted", "accepted", "outside-gate", "repeated", "repeated"]);
    }
}

#[test]
fn every_option_changes_something() {
    let base = TiltFilterOptions { mounting: Some(MountingOptions::default()), ..TiltFilterOptions::default() };
    let story = |options: TiltFilterOptions| {
        let mut filter = TiltFilter::new(options).unwrap();
        let mut told = Vec::new();
        for i in 0..40u32 {
            filter.predict(0.1, 0.3).unwrap();
            let degrees = if i > 34 {
                6.0
            } else if i % 7 == 5 {
                2.2
            } else if i > 20 && i < 32 {
                3.0 + 3.0 * f64::from(i % 2)
            } else {
                0.5
            };
            // No two images are the same.
            let tilt = Tilt::from_normal(&lean(degrees, 0.2 + 1e-6 * f64::from(i)));
            let verdict = filter.update(&image(tilt, 0.008, 0.45 + 0.02 * f64::from(i)));
            told.push((verdict, filter.estimate()));
        }
        told
    };
    let plain = story(base);
    let mounting = MountingOptions::default();
    for other in [
        TiltFilterOptions { walk_rad_per_sqrt_m: 0.02, ..base },
        TiltFilterOptions { walk_rad_per_sqrt_step: 0.003, ..base },
        TiltFilterOptions { half_track_m: 5.0, ..base },
        TiltFilterOptions { gate_probability: 0.9, ..base },
        TiltFilterOptions { confidence_min: 0.9, ..base },
        TiltFilterOptions { jump_after: 2, ..base },
        TiltFilterOptions { lost_after: 3, jump_after: 9, ..base },
        TiltFilterOptions { correlated_share: 0.3, ..base },
        TiltFilterOptions { correlation_m: 0.5, ..base },
        TiltFilterOptions { noise_floor_rad: 0.01, ..base },
        TiltFilterOptions { prior_rad: 0.05, ..base },
        TiltFilterOptions { sigma_max_rad: 0.001, ..base },
        TiltFilterOptions { mounting: None, ..base },
        TiltFilterOptions { mounting: Some(MountingOptions { prior_rad: 0.1, ..mounting }), ..base },
        TiltFilterOptions { mounting: Some(MountingOptions { walk_rad_per_sqrt_m: 0.005, ..mounting }), ..base },
    ] {
        assert_ne!(story(other), plain, "{other:?}");
    }
}

#[test]
fn impossible_options_and_arguments_are_refused() {
    let base = TiltFilterOptions::default();
    let mounting = MountingOptions::default();
    for (options, name) in [
        (TiltFilterOptions { walk_rad_per_sqrt_m: -1.0, ..base }, "walk_rad_per_sqrt_m"),
        (TiltFilterOptions { walk_rad_per_sqrt_step: f64::NAN, ..base }, "walk_rad_per_sqrt_step"),
        (TiltFilterOptions { half_track_m: -0.1, ..base }, "half_track_m"),
        (TiltFilterOptions { gate_probability: 1.0, ..base }, "gate_probability"),
        (TiltFilterOptions { confidence_min: 1.1, ..base }, "confidence_min"),
        (TiltFilterOptions { jump_after: 0, ..base }, "jump_after"),
        (TiltFilterOptions { lost_after: 0, ..base }, "lost_after"),
        (TiltFilterOptions { correlated_share: 1.0, ..base }, "correlated_share"),
        (TiltFilterOptions { correlation_m: 0.0, ..base }, "correlation_m"),
        (TiltFilterOptions { noise_floor_rad: 0.0, ..base }, "noise_floor_rad"),
        (TiltFilterOptions { prior_rad: 2.0, ..base }, "prior_rad"),
        (TiltFilterOptions { sigma_max_rad: 0.0, ..base }, "sigma_max_rad"),
        (
            TiltFilterOptions { mounting: Some(MountingOptions { prior_rad: 0.0, ..mounting }), ..base },
            "mounting_prior",
        ),
        (
            TiltFilterOptions { mounting: Some(MountingOptions { walk_rad_per_sqrt_m: -1.0, ..mounting }), ..base },
            "mounting_walk_rad_per_sqrt_m",
        ),
    ] {
        let error = TiltFilter::new(options).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    let mut filter = settled(base, &Vector3::z());
    let before = filter.clone();
    assert!(filter.predict(f64::NAN, 0.0).is_err() && filter.predict(0.0, f64::INFINITY).is_err());
    assert!(filter.update_normal(&Vector3::zeros(), &small()).is_err());
    assert!(filter.update_normal(&Vector3::z(), &-small()).is_err());
    assert!(filter.update_normal(&Vector3::z(), &Matrix2::new(1.0, 0.5, 0.0, 1.0)).is_err());
    assert_eq!(filter, before);
    for wrong in [
        TiltFilterState { floor: Vector3::zeros(), ..before.state().clone() },
        TiltFilterState { covariance: -before.state().covariance, ..before.state().clone() },
        TiltFilterState { driven_m: -1.0, ..before.state().clone() },
        TiltFilterState { rolled_m: f64::NAN, ..before.state().clone() },
        TiltFilterState { latest: Some((Vector3::zeros(), small())), ..before.state().clone() },
        TiltFilterState { latest: Some((Vector3::z(), -small())), ..before.state().clone() },
        TiltFilterState { common: Some(Matrix2::zeros()), ..before.state().clone() },
        TiltFilterState { pending: Some((Vector3::zeros(), small())), ..before.state().clone() },
        TiltFilterState { scene: Vector2::new(f64::NAN, 0.0), ..before.state().clone() },
        TiltFilterState { scene: Vector2::new(3.75e255, 0.0), ..before.state().clone() },
        TiltFilterState { covariance: before.state().covariance * 1e306, ..before.state().clone() },
        TiltFilterState { common: Some(Matrix2::identity() * 1e306), ..before.state().clone() },
        TiltFilterState { pending: Some((Vector3::z(), Matrix2::identity() * 11.0)), ..before.state().clone() },
    ] {
        let error = TiltFilter::with_state(base, wrong).unwrap_err();
        assert!(matches!(error, tiltvp_core::Error::InvalidArgument { .. }), "{error}");
    }
    assert!(filter.update_normal(&Vector3::z(), &(Matrix2::identity() * 11.0)).is_err());
}

/// Covariances of a mounting that is none, of which rounding, and numbers that a state is read with, would leave negative variances.
#[test]
fn a_state_that_was_taken_can_be_taken_again() {
    let exact = TiltFilterOptions { prior_rad: FRAC_PI_2, noise_floor_rad: 1e-6, ..TiltFilterOptions::default() };
    for options in [TiltFilterOptions::default(), exact] {
        for cross in [0.0, 1e-33, 1e-12, 1e-10, 1e-7] {
            let mut state = TiltFilter::new(options).unwrap().state().clone();
            (state.covariance[(1, 3)], state.covariance[(3, 1)]) = (cross, cross);
            let mut filter = TiltFilter::with_state(options, state).unwrap();
            for k in 0..4 {
                let normal = lean(8.0 * f64::from(k), 1.2);
                filter.update_normal(&normal, &Matrix2::zeros()).unwrap();
                filter.predict(0.3, 0.1).unwrap();
                assert!(filter.floor().sigma_rad >= 0.0, "{cross} {k}: {:?}", filter.state());
                let again = TiltFilter::with_state(options, filter.state().clone());
                assert_eq!(again.as_ref(), Ok(&filter), "{cross} {k}: {:?}", filter.state());
            }
        }
    }
}

#[test]
fn no_tilt_becomes_more_unknown_than_an_angle() {
    let mounting = MountingOptions { walk_rad_per_sqrt_m: PI, ..MountingOptions::default() };
    let options = TiltFilterOptions {
        walk_rad_per_sqrt_m: PI,
        confidence_min: 0.0,
        mounting: Some(mounting),
        ..TiltFilterOptions::default()
    };
    let mut filter = settled(options, &Vector3::z());
    for k in 0..1000 {
        filter.predict(0.1, 1e6).unwrap();
        if k % 100 == 99 {
            filter.update_normal(&Vector3::z(), &(Matrix2::identity() * 9.8)).unwrap();
        }
        let again = TiltFilter::with_state(options, filter.state().clone()).unwrap();
        assert!(again.estimate().covariance_rad2.amax() < 4.0 * PI * PI);
    }
    filter.update_normal(&Vector3::z(), &small()).unwrap();
    assert!(filter.estimate().sigma_rad < 0.1, "{:?}", filter.estimate());
}

/// A few steps of a drive: turn, distance, lean, its direction, standard deviation.
fn stories() -> impl Strategy<Value = Vec<(f64, f64, f64, f64, f64)>> {
    prop::collection::vec((-7.0..7.0f64, -3.0..3.0f64, 0.0..3.1f64, -3.2..3.2f64, 0.0..0.5f64), 1..30)
}

fn told(options: TiltFilterOptions, story: &[(f64, f64, f64, f64, f64)], turned_rad: f64) -> TiltFilter {
    let mut filter = TiltFilter::new(options).unwrap();
    for &(yaw, distance, alpha, beta, sigma) in story {
        filter.predict(yaw, distance).unwrap();
        let normal = Tilt::from_alpha_beta(alpha, beta + turned_rad).normal();
        let spread = Rotation3::from_axis_angle(&Vector3::z_axis(), turned_rad)
            .into_inner()
            .fixed_view::<2, 2>(0, 0)
            .into_owned();
        let covariance = spread * Matrix2::new(sigma * sigma, 0.0, 0.0, 0.25 * sigma * sigma) * spread.transpose();
        filter.update_normal(&normal, &covariance).unwrap();
    }
    filter
}

proptest! {
    #[test]
    fn whatever_happens_the_state_stays_one(story in stories(), mounted in any::<bool>()) {
        let mounting = mounted.then(MountingOptions::default);
        let options = TiltFilterOptions { confidence_min: 0.0, mounting, ..TiltFilterOptions::default() };
        let filter = told(options, &story, 0.0);
        let again = TiltFilter::with_state(options, filter.state().clone()).unwrap();
        prop_assert_eq!(&again, &filter);
        let found = filter.estimate();
        prop_assert!(found.sigma_rad > 0.0 && (0.0..=1.0).contains(&found.confidence));
    }

    /// Turning in steps by whole turns leaves the floor's tilt, and everything known about it, where it was.
    #[test]
    fn whole_turns_are_nothing(alpha in 0.0..0.4f64, beta in -3.1..3.1f64, steps in 1u32..50, back in any::<bool>()) {
        let options = TiltFilterOptions {
            walk_rad_per_sqrt_step: 0.0,
            half_track_m: 0.0,
            mounting: Some(MountingOptions::default()),
            ..TiltFilterOptions::default()
        };
        let mut filter = TiltFilter::new(options).unwrap();
        filter.update_normal(&Tilt::from_alpha_beta(alpha, beta).normal(), &Matrix2::new(1e-4, 3e-5, 3e-5, 4e-4)).unwrap();
        let before = filter.state().clone();
        for _ in 0..steps {
            filter.predict(if back { -TAU } else { TAU } / f64::from(steps), 0.0).unwrap();
        }
        let after = filter.state();
        prop_assert!((after.floor - before.floor).norm() < 1e-12);
        prop_assert!((after.mounting - before.mounting).norm() == 0.0);
        prop_assert!((after.scene - before.scene).norm() < 1e-12);
        prop_assert!((after.covariance - before.covariance).amax() < 1e-12 * before.covariance.amax().max(1.0));
    }

    /// A robot whose x axis is called by another name sees the same, turned.
    #[test]
    fn the_filter_has_no_preferred_heading(story in stories(), turned in -3.1..3.1f64) {
        let calm: Vec<_> = story.iter().map(|&(yaw, d, alpha, beta, s)| (yaw, d, 0.1 * alpha, beta, s)).collect();
        let options = TiltFilterOptions { confidence_min: 0.0, sigma_max_rad: f64::INFINITY, mounting: Some(MountingOptions::default()), ..TiltFilterOptions::default() };
        let (one, other) = (told(options, &calm, 0.0), told(options, &calm, turned));
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), turned);
        let (a, b) = (one.estimate(), other.estimate());
        prop_assert!((turn * a.tilt.unwrap().normal() - b.tilt.unwrap().normal()).norm() < 1e-9);
        let plane = turn.into_inner().fixed_view::<2, 2>(0, 0).into_owned();
        prop_assert!((plane * a.covariance_rad2 * plane.transpose() - b.covariance_rad2).amax() < 1e-9);
    }
}
