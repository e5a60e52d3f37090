//! The tilt filter on simulated drives: its laws, its consistency, its gate, and what it does when it cannot know.
//!
//! Statistical tests hold means against the 95 % bands of a consistent filter, under one fixed seed: a right filter misses a
//! band with probability 5 % for each seed, once and for all, and never by chance from run to run.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Rotation3, Vector2, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use tiltvp_core::filter::{ConsistencyBand, squared_mahalanobis};
use tiltvp_core::geometry::{Tilt, angle_between, tangent_exp, tangent_log};
use tiltvp_core::robust::Stop;
use tiltvp_core::tilt::{
    FilteredTilt, MountingOptions, TiltEstimate, TiltFilter, TiltFilterOptions, TiltFilterState, Verdict,
};

const DEGREE: f64 = std::f64::consts::PI / 180.0;

struct Dice(ChaCha12Rng);

impl Dice {
    fn new(seed: u64) -> Self {
        Self(ChaCha12Rng::seed_from_u64(seed))
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Two independent normal numbers of one standard deviation (Box and Muller).
    fn normal(&mut self, sigma: f64) -> Vector2<f64> {
        let (length, angle) = ((-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt(), TAU * self.0.random::<f64>());
        Vector2::new(length * angle.cos(), length * angle.sin()) * sigma
    }
}

/// A world in which everything is as the filter has it.
struct Drive {
    options: TiltFilterOptions,
    floor: Vector3<f64>,
    mounting: Vector3<f64>,
    scene: Vector2<f64>,
    common: Option<f64>,
    driven_m: f64,
    dice: Dice,
}

impl Drive {
    fn new(options: TiltFilterOptions, seed: u64) -> Self {
        let mut dice = Dice::new(seed);
        let floor = tangent_exp(&Vector3::z(), &dice.normal(options.prior_rad));
        let own = options.mounting.map_or(Vector2::zeros(), |mounting| dice.normal(mounting.prior_rad));
        let mounting = tangent_exp(&Vector3::z(), &own);
        Self { options, floor, mounting, scene: Vector2::zeros(), common: None, driven_m: 0.0, dice }
    }

    fn drive(&mut self, yaw_rad: f64, distance_m: f64) {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -yaw_rad);
        let o = &self.options;
        let walk = (o.walk_rad_per_sqrt_m.powi(2) * distance_m + o.walk_rad_per_sqrt_step.powi(2)).sqrt();
        self.floor = tangent_exp(&(turn * self.floor), &self.dice.normal(walk));
        if let Some(mounting) = o.mounting {
            let walk = mounting.walk_rad_per_sqrt_m * distance_m.sqrt();
            self.mounting = tangent_exp(&self.mounting, &self.dice.normal(walk));
        }
        self.scene = (turn * Vector3::new(self.scene.x, self.scene.y, 0.0)).xy();
        self.driven_m += distance_m;
    }

    fn normal(&self) -> Vector3<f64> {
        Tilt::from_normal(&self.mounting).unwrap().leaning_from_upright() * self.floor
    }

    /// An estimate of one standard deviation `sigma`, and its covariance.
    fn look(&mut self, sigma: f64) -> (Vector3<f64>, Matrix2<f64>) {
        let floor = self.options.noise_floor_rad;
        let total = sigma.hypot(floor);
        let share = self.options.correlated_share;
        let rho = (-self.driven_m / self.options.correlation_m).exp();
        let noise = total * total;
        let (keep, common) = self.common.map_or((0.0, noise), |before| {
            let shared = before.min(noise);
            (rho * shared / before, rho * rho * shared + (1.0 - rho * rho) * noise)
        });
        let fresh = common - keep * keep * self.common.unwrap_or(0.0);
        self.scene = self.scene * keep + self.dice.normal((share * fresh).sqrt());
        (self.common, self.driven_m) = (Some(common), 0.0);
        let error = self.scene + self.dice.normal((noise - share * common).sqrt());
        (tangent_exp(&self.normal(), &error), Matrix2::identity() * (sigma * sigma))
    }
}

fn wide_gate(mounting: Option<MountingOptions>) -> TiltFilterOptions {
    TiltFilterOptions {
        gate_probability: 1.0 - 1e-9,
        confidence_min: 0.0,
        sigma_max_rad: f64::INFINITY,
        mounting,
        ..TiltFilterOptions::default()
    }
}

fn nees(found: &FilteredTilt, truth: &Vector3<f64>) -> f64 {
    let error = tangent_log(&found.tilt.unwrap().normal(), truth);
    squared_mahalanobis(&error, &found.covariance_rad2).unwrap()
}

struct Means {
    nees: f64,
    nees_floor: f64,
    nees_mounting: f64,
    nis: f64,
    looks: u32,
}

/// Mean NEES of the last step of each of many drives, and mean NIS of all steps.
fn means(options: TiltFilterOptions, drives: u64, steps: u32, step_m: f64, seed: u64) -> Means {
    let mut sums = Means { nees: 0.0, nees_floor: 0.0, nees_mounting: 0.0, nis: 0.0, looks: 0 };
    for run in 0..drives {
        let mut drive = Drive::new(options, seed + run);
        let mut filter = TiltFilter::new(options).unwrap();
        let yaw = drive.dice.uniform(-0.2, 0.2);
        for _ in 0..steps {
            let sigma = [0.3, 0.6, 1.2][drive.dice.uniform(0.0, 3.0) as usize] * DEGREE;
            let distance = drive.dice.uniform(0.0, 2.0 * step_m);
            drive.drive(yaw, distance);
            filter.predict(yaw, distance).unwrap();
            let (normal, covariance) = drive.look(sigma);
            let verdict = filter.update_normal(&normal, &covariance).unwrap();
            assert!(verdict.accepted(), "{verdict}");
            sums.nis += verdict.nis().unwrap();
            sums.looks += 1;
        }
        sums.nees += nees(&filter.estimate(), &drive.normal());
        sums.nees_floor += nees(&filter.floor(), &drive.floor);
        sums.nees_mounting += filter.mounting().map_or(0.0, |found| nees(&found, &drive.mounting));
    }
    let count = drives as f64;
    sums.nees /= count;
    sums.nees_floor /= count;
    sums.nees_mounting /= count;
    sums.nis /= f64::from(sums.looks);
    sums
}

fn assert_in_band(name: &str, mean: f64, samples: u32) {
    let band = ConsistencyBand::of_mean(0.95, 2, samples).unwrap();
    assert!(band.holds(mean), "{name}: mean {mean:.3} of {samples}, expected {:.3} to {:.3}", band.low, band.high);
}

#[test]
fn consistent_on_drives() {
    for (step_m, seed) in [(0.1, 1000), (0.0, 2000), (1.0, 3000)] {
        let found = means(wide_gate(None), 400, 60, step_m, seed);
        assert_in_band("NEES", found.nees, 400);
        assert_in_band("NIS", found.nis, found.looks);
    }
}

#[test]
fn consistent_with_a_lean_of_the_robot() {
    let options = wide_gate(Some(MountingOptions::default()));
    let found = means(options, 400, 80, 0.2, 5000);
    assert_in_band("NEES", found.nees, 400);
    assert_in_band("NEES of the floor", found.nees_floor, 400);
    assert_in_band("NEES of the mounting", found.nees_mounting, 400);
    assert_in_band("NIS", found.nis, found.looks);
}

/// The errors of one place, seen again and again: the worst case, the very same image each time, whatever it is worth.
#[test]
fn never_overconfident_standing_still() {
    let options = TiltFilterOptions { walk_rad_per_sqrt_step: 0.0, ..wide_gate(None) };
    let mut total = 0.0;
    for run in 0..400 {
        let mut drive = Drive::new(options, 9000 + run);
        let mut filter = TiltFilter::new(options).unwrap();
        let sigma = [0.3, 1.2][run as usize % 2] * DEGREE;
        let (normal, covariance) = drive.look(sigma);
        for _ in 0..300 {
            filter.predict(0.0, 0.0).unwrap();
            assert!(filter.update_normal(&normal, &covariance).unwrap().accepted());
        }
        let found = filter.estimate();
        assert!(found.sigma_rad > 0.98 * options.correlated_share.sqrt() * sigma, "{found}");
        total += nees(&found, &drive.normal());
    }
    // With the same noise in every image, even the share that should be new is not: at most 1 / share beyond 2.
    let band = ConsistencyBand::of_mean(0.95, 2, 400).unwrap();
    assert!(total / 400.0 < band.high / options.correlated_share, "{}", total / 400.0);
    assert!(total / 400.0 > band.low, "{}", total / 400.0);
}

/// Images of one place that claim different covariances must not be extrapolated to an error of zero.
#[test]
fn the_best_image_of_a_place_is_the_limit() {
    let mut filter = TiltFilter::new(wide_gate(None)).unwrap();
    for i in 0..200 {
        filter.predict(0.0, 0.0).unwrap();
        let sigma = [0.5, 1.5, 0.9][i % 3] * DEGREE;
        filter.update_normal(&Vector3::z(), &(Matrix2::identity() * (sigma * sigma))).unwrap();
    }
    assert!(filter.estimate().sigma_rad > 0.44 * DEGREE, "{}", filter.estimate());
}

#[test]
fn driving_on_does_what_standing_cannot() {
    let options = TiltFilterOptions { walk_rad_per_sqrt_m: 1e-4, walk_rad_per_sqrt_step: 0.0, ..wide_gate(None) };
    let sigma_after = |step_m: f64| {
        let mut filter = TiltFilter::new(options).unwrap();
        for _ in 0..100 {
            filter.predict(0.0, step_m).unwrap();
            filter.update_normal(&Vector3::z(), &(Matrix2::identity() * DEGREE * DEGREE)).unwrap();
        }
        filter.estimate().sigma_rad
    };
    assert!(sigma_after(1.0) < 0.3 * sigma_after(0.0));
}

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

#[test]
fn the_lean_of_the_robot_is_told_by_turning() {
    let options = TiltFilterOptions { mounting: Some(MountingOptions::default()), ..wide_gate(None) };
    let mut drive = Drive::new(options, 77);
    drive.floor = lean(2.0, 0.5);
    drive.mounting = lean(1.5, -1.2);
    let mut filter = TiltFilter::new(options).unwrap();
    let mut go = |filter: &mut TiltFilter, yaw: f64, images: u32| {
        for _ in 0..images {
            drive.drive(yaw, 0.1);
            filter.predict(yaw, 0.1).unwrap();
            let (normal, covariance) = drive.look(0.3 * DEGREE);
            filter.update_normal(&normal, &covariance).unwrap();
        }
        (drive.normal(), drive.mounting)
    };
    go(&mut filter, 0.0, 40);
    let before = filter.mounting().unwrap();
    assert!(before.sigma_rad > 0.9 * DEGREE, "{before}");
    let (normal, mounting) = go(&mut filter, 0.1, 250);
    let after = filter.mounting().unwrap();
    assert!(after.sigma_rad < 0.25 * DEGREE, "{after}");
    assert!(angle_between(&after.tilt.unwrap().normal(), &mounting) < 3.0 * after.sigma_rad);
    assert!(angle_between(&filter.estimate().tilt.unwrap().normal(), &normal) < 1.0 * DEGREE);
    assert!(TiltFilter::new(wide_gate(None)).unwrap().mounting().is_none());
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
        residual_rms: f64::NAN,
        iterations: 0,
        stop: Stop::NoModel { trials: 0 },
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
    assert_eq!(filter, before);
    assert!(filter.update(&image(Some(Tilt::UPRIGHT), 0.01, 0.51)).accepted());
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
            let verdict =
                filter.update(&image(Tilt::from_normal(&lean(degrees, 0.2)), 0.008, 0.45 + 0.02 * f64::from(i)));
            told.push((verdict, filter.estimate()));
        }
        told
    };
    let plain = story(base);
    let mounting = MountingOptions::default();
    for other in [
        TiltFilterOptions { walk_rad_per_sqrt_m: 0.02, ..base },
        TiltFilterOptions { walk_rad_per_sqrt_step: 0.003, ..base },
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
        TiltFilterState { common: Some(Matrix2::zeros()), ..before.state().clone() },
        TiltFilterState { pending: Some((Vector3::zeros(), small())), ..before.state().clone() },
        TiltFilterState { scene: Vector2::new(f64::NAN, 0.0), ..before.state().clone() },
    ] {
        assert!(TiltFilter::with_state(base, wrong).is_err());
    }
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
        let options = TiltFilterOptions { walk_rad_per_sqrt_step: 0.0, mounting: Some(MountingOptions::default()), ..TiltFilterOptions::default() };
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
