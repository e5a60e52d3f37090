//! Known tilts of worlds of vertical stripes, through every kind of lens and mounting, by every method.

#![allow(clippy::unwrap_used)]

mod scene;

use nalgebra::{Matrix3, Rotation3, Vector3};
use scene::{fisheye, shrunk, stripes};
use tiltvp_core::camera::Camera;
use tiltvp_core::edges::{EdgeOptions, NormalKind};
use tiltvp_core::geometry::{Tilt, tangent_basis};
use tiltvp_core::testing::zoo;
use tiltvp_core::tilt::{METHODS, Method, TiltEstimate, TiltEstimator, TiltOptions};

fn about(axis: Vector3<f64>, angle_deg: f64) -> Matrix3<f64> {
    Rotation3::from_scaled_axis(axis * angle_deg.to_radians()).into_inner()
}

/// A camera that looks forward: its axis is the robot's x, its right the robot's -y, its down the robot's -z.
fn forward() -> Matrix3<f64> {
    Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0)
}

fn estimate(camera: &Camera, mount: &Matrix3<f64>, tilt: &Tilt, options: TiltOptions) -> TiltEstimate {
    let image = stripes(camera, mount, tilt, 37, 2.0, 5);
    let estimator = TiltEstimator::new(camera.clone(), *mount, options).unwrap();
    estimator.estimate(&image.view(), &mut estimator.scratch()).unwrap()
}

fn error_deg(estimate: &TiltEstimate, tilt: &Tilt) -> f64 {
    estimate.tilt.map_or(f64::INFINITY, |found| found.angle_to(tilt).to_degrees())
}

fn tilts() -> Vec<Tilt> {
    let lean = |alpha: f64, beta: f64| Tilt::from_alpha_beta(alpha.to_radians(), beta.to_radians());
    vec![Tilt::UPRIGHT, lean(2.06, 0.0), lean(1.38, 137.0), lean(2.8, -137.0), lean(5.0, 90.0), lean(8.0, -30.0)]
}

/// The options of a method with the exact normals where the method has a choice.
fn exact(name: &str) -> TiltOptions {
    let mut options = TiltOptions::for_method(name).unwrap();
    if let Method::VectorConsensus(own) = &mut options.method {
        own.normal = NormalKind::Tangent;
    }
    options.tilt_max_rad = Some(12f64.to_radians());
    options
}

/// The largest error of each method in degrees, given its bound for leans of up to five degrees and for eight.
fn check(name: &str, camera: &Camera, mount: &Matrix3<f64>, edges: impl Fn(&mut EdgeOptions), bounds: Bounds) {
    let mut wrong = Vec::new();
    for (method, bound) in bounds {
        for tilt in tilts() {
            let mut options = exact(method);
            edges(&mut options.edges);
            let found = estimate(camera, mount, &tilt, options);
            let (alpha, beta) = (tilt.alpha_rad().to_degrees(), tilt.beta_rad().to_degrees());
            let error = error_deg(&found, &tilt);
            let sigma = (0.5 * found.covariance_rad2.trace()).sqrt().to_degrees();
            println!(
                "{name}, {method}, ({alpha:.2}, {beta:.0}): {error:.3} deg, sigma {sigma:.2} deg, confidence {:.3}",
                found.confidence
            );
            // The paper's methods err by degrees and say so, or by their approximations, which they cannot know.
            let honest = !["refined", "segments"].contains(&method) || (found.confidence > 0.7 && error <= 4.0 * sigma);
            if !(error <= bound * (alpha / 5.0).max(1.0) && honest) {
                wrong.push(format!("{name}, {method}, ({alpha:.2}, {beta:.0}): {error:.3} deg, {found:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A bound in degrees for each method.
type Bounds = [(&'static str, f64); METHODS.len()];

/// Bounds for a round lens about the vertical.
const UPWARD: Bounds = [
    ("refined", 0.1),
    ("image-space-ransac", 2.2),
    ("image-space-reject-refit", 0.5),
    ("vector-consensus", 0.5),
    ("segments", 0.1),
];

/// Bounds for a lens that is a few degrees off the vertical, about which the image-space methods are only nearly right.
const SLANTED: Bounds = [
    ("refined", 0.1),
    ("image-space-ransac", 3.0),
    ("image-space-reject-refit", 1.5),
    ("vector-consensus", 0.5),
    ("segments", 0.1),
];

#[test]
fn upward_fisheye() {
    check("upward", &fisheye(320), &Matrix3::identity(), |_| (), UPWARD);
}

#[test]
fn turned_and_slanted_mounts() {
    check("turned", &fisheye(320), &about(Vector3::z(), 30.0), |_| (), UPWARD);
    let slanted = about(Vector3::new(3.0, -4.0, 0.0) / 5.0, 3.0) * about(Vector3::z(), -100.0);
    check("slanted", &fisheye(320), &slanted, |_| (), SLANTED);
}

/// An upward camera under a convex mirror sees what is about and below the horizon, its centre looks down.
#[test]
fn under_a_mirror() {
    let below = |edges: &mut EdgeOptions| {
        (edges.elevation_min_rad, edges.elevation_max_rad) = (-std::f64::consts::FRAC_PI_4, 0.0);
    };
    check("mirrored", &fisheye(320).mirrored(), &Matrix3::identity(), below, UPWARD);
    check("mirrored, turned", &fisheye(320).mirrored(), &about(Vector3::z(), 30.0), below, UPWARD);
    let slanted = about(Vector3::x(), 3.0);
    check("mirrored, slanted", &fisheye(320).mirrored(), &slanted, below, SLANTED);
}

/// The rule of a lens without a stated limit: the nadir is near the centre of the image, the zenith far outside of it.
#[test]
fn under_a_mirror_with_a_lens_that_knows_no_limit() {
    let camera = fisheye(320);
    let camera = Camera::new(320, 320, camera.model().clone()).unwrap().mirrored();
    let below = |edges: &mut EdgeOptions| {
        (edges.elevation_min_rad, edges.elevation_max_rad) = (-std::f64::consts::FRAC_PI_4, 0.0);
    };
    check("mirrored, no limit", &camera, &about(Vector3::x(), 3.0), below, SLANTED);
}

/// A downward camera without a mirror: the same vanishing point, the other handedness.
#[test]
fn looking_down() {
    let below = |edges: &mut EdgeOptions| {
        (edges.elevation_min_rad, edges.elevation_max_rad) = (-std::f64::consts::FRAC_PI_4, 0.0);
    };
    check("downward", &fisheye(320), &about(Vector3::x(), 180.0), below, UPWARD);
}

/// The image-space methods assume a lens about the vertical; those on normals do not.
#[test]
fn looking_forward() {
    let wide = |edges: &mut EdgeOptions| (edges.elevation_min_rad, edges.elevation_max_rad) = (-0.7, 0.7);
    for method in ["refined", "vector-consensus", "segments"] {
        for tilt in tilts() {
            let mut options = exact(method);
            wide(&mut options.edges);
            let found = estimate(&fisheye(320), &forward(), &tilt, options);
            let error = error_deg(&found, &tilt);
            println!("forward, {method}: {error:.3} deg, {:.3}", found.confidence);
            assert!(error < if method == "vector-consensus" { 2.2 } else { 0.15 }, "{method}: {found:?}");
        }
    }
}

/// Every lens of the zoo, looking up or, where it does not reach the band that way, forward.
#[test]
fn every_lens_of_the_zoo() {
    for (name, camera) in zoo() {
        let camera = shrunk(&camera, 320);
        let tilt = Tilt::from_alpha_beta(4f64.to_radians(), 2.0);
        // A panorama is about its camera's y, and a pinhole sees only what it looks at.
        let narrow = name.contains("pinhole") || name.contains("equirectangular");
        let mount = if narrow || !camera.is_mirrored() && camera.max_theta_rad() < 1.3 {
            forward()
        } else {
            Matrix3::identity()
        };
        let mut options = TiltOptions::for_method("refined").unwrap();
        let reach = if narrow { 0.5 } else { 0.9 };
        (options.edges.elevation_min_rad, options.edges.elevation_max_rad) = (-reach, reach);
        let found = estimate(&camera, &mount, &tilt, options);
        let error = error_deg(&found, &tilt);
        println!("{name}: {error:.3} deg, confidence {:.3}, {} edge pixels", found.confidence, found.edge_pixels);
        assert!(error < 0.3, "{name}: {error} deg, {found:?}");
    }
}

/// The error is what the covariance says, for images as noisy as a camera's in dim light: squared distances with two degrees of
/// freedom, the floor included.
#[test]
fn covariance_is_that_of_the_error() {
    let camera = fisheye(320);
    let options = TiltOptions::for_method("refined").unwrap();
    let estimator = TiltEstimator::new(camera.clone(), Matrix3::identity(), options).unwrap();
    let mut scratch = estimator.scratch();
    let (mut sum, runs) = (0.0, 40u32);
    for run in 0..runs {
        let tilt = Tilt::from_alpha_beta(0.05, f64::from(run));
        let image = stripes(&camera, &Matrix3::identity(), &tilt, 21, 4.0, u64::from(100 * run));
        let found = estimator.estimate(&image.view(), &mut scratch).unwrap();
        let normal = found.tilt.unwrap().normal();
        let error = tangent_basis(&normal).transpose() * (tilt.normal() - normal);
        sum += error.dot(&(found.covariance_rad2.try_inverse().unwrap() * error));
        let covariance = found.covariance_rad2;
        assert_eq!(covariance, covariance.transpose());
        assert!(covariance.symmetric_eigenvalues().min() > 0.0);
    }
    // The stripes are plumb, so the floor makes this a bound from above; the covariance may not be too small.
    println!("mean squared distance {:.3} of 2", sum / f64::from(runs));
    assert!(sum / f64::from(runs) < 2.6);
}
