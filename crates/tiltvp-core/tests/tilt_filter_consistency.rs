//! The tilt filter is consistent on simulated drives: its errors are as large as it says, whatever the robot does.
//!
//! Means are held against the 95 % bands of a consistent filter, under one fixed seed: a right filter misses a band with
//! probability 5 % for each seed, once and for all, and never by chance from run to run.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Rotation3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use tiltvp_core::filter::{ConsistencyBand, squared_mahalanobis};
use tiltvp_core::geometry::{Tilt, angle_between, tangent_exp, tangent_log};
use tiltvp_core::tilt::{FilteredTilt, MountingOptions, TiltFilter, TiltFilterOptions};

const DEGREE: f64 = std::f64::consts::PI / 180.0;

struct Generator(ChaCha12Rng);

impl Generator {
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
    random: Generator,
}

impl Drive {
    fn new(options: TiltFilterOptions, seed: u64) -> Self {
        let mut random = Generator::new(seed);
        let floor = tangent_exp(&Vector3::z(), &random.normal(options.prior_rad));
        let own = options.mounting.map_or(Vector2::zeros(), |mounting| random.normal(mounting.prior_rad));
        let mounting = tangent_exp(&Vector3::z(), &own);
        Self { options, floor, mounting, scene: Vector2::zeros(), common: None, driven_m: 0.0, random }
    }

    fn drive(&mut self, yaw_rad: f64, distance_m: f64) {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -yaw_rad);
        let o = &self.options;
        let rolled_m = distance_m.max(o.half_track_m * yaw_rad.abs());
        let walk = (o.walk_rad_per_sqrt_m.powi(2) * rolled_m + o.walk_rad_per_sqrt_step.powi(2)).sqrt();
        self.floor = tangent_exp(&(turn * self.floor), &self.random.normal(walk));
        if let Some(mounting) = o.mounting {
            let walk = mounting.walk_rad_per_sqrt_m * distance_m.sqrt();
            self.mounting = tangent_exp(&self.mounting, &self.random.normal(walk));
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
        self.scene = self.scene * keep + self.random.normal((share * fresh).sqrt());
        (self.common, self.driven_m) = (Some(common), 0.0);
        let error = self.scene + self.random.normal((noise - share * common).sqrt());
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
        let yaw = drive.random.uniform(-0.2, 0.2);
        for _ in 0..steps {
            let sigma = [0.3, 0.6, 1.2][drive.random.uniform(0.0, 3.0) as usize] * DEGREE;
            let distance = drive.random.uniform(0.0, 2.0 * step_m);
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

fn lean(degrees: f64, beta_rad: f64) -> Vector3<f64> {
    Tilt::from_alpha_beta(degrees * DEGREE, beta_rad).normal()
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
