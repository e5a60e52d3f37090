//! Triangulation of a vertex by two cameras: covariances that are true, and what has no intersection.

#![allow(clippy::unwrap_used)]

use nalgebra::{Matrix2, Rotation3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tiltvp_core::corner::{BearingObservation, triangulate};
use tiltvp_core::filter::{ConsistencyBand, positive_semidefinite, squared_mahalanobis};
use tiltvp_core::geometry::{RigidMotion, tangent_basis};

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (a, b): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

fn right_camera() -> (RigidMotion, RigidMotion) {
    let left_from_right = RigidMotion::new(
        "left_from_right",
        *Rotation3::from_euler_angles(0.01, -0.02, 0.015).matrix(),
        Vector3::new(0.12, 0.001, -0.002),
    )
    .unwrap();
    (left_from_right, left_from_right.inverse())
}

#[test]
fn points_are_triangulated_with_covariance() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let (left_from_right, right_from_left) = right_camera();
    let (mut nees, mut chi) = (Vec::new(), Vec::new());
    let covariance = Matrix2::from_diagonal(&Vector2::new(1e-8, 4e-8));
    for _ in 0..1000 {
        let (x, y) = (rng.random::<f64>() - 0.5, 0.6 * (rng.random::<f64>() - 0.5));
        let point = Vector3::new(x, y, 1.0).normalize() * (1.0 + 2.0 * rng.random::<f64>());
        let mut observe = |camera: &RigidMotion, rig_from_camera: RigidMotion| {
            let clean = camera.point(&point).normalize();
            let noise = Vector2::new(1e-4 * normal(&mut rng), 2e-4 * normal(&mut rng));
            let bearing = (clean + tangent_basis(&clean) * noise).normalize();
            BearingObservation { bearing, covariance, rig_from_camera }
        };
        let observations =
            [observe(&RigidMotion::identity(), RigidMotion::identity()), observe(&right_from_left, left_from_right)];
        let found = triangulate(&observations).unwrap();
        nees.push(squared_mahalanobis(&(found.point_m - point), &found.covariance_m2).unwrap());
        chi.push(found.chi_square);
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / 1000.0;
    let band = ConsistencyBand::of_mean(0.9999, 3, 1000).unwrap();
    assert!(band.holds(mean(&nees)), "{} {band:?}", mean(&nees));
    let band = ConsistencyBand::of_mean(0.9999, 1, 1000).unwrap();
    assert!(band.holds(mean(&chi)), "{} {band:?}", mean(&chi));
}

#[test]
fn nothing_is_triangulated_from_parallel_or_parting_lines_of_sight() {
    let (left_from_right, _) = right_camera();
    let observe = |bearing: Vector3<f64>, rig_from_camera| BearingObservation {
        bearing: bearing.normalize(),
        covariance: Matrix2::identity() * 1e-8,
        rig_from_camera,
    };
    let ahead = observe(Vector3::new(0.1, 0.0, 1.0), RigidMotion::identity());
    assert!(triangulate(&[ahead]).is_none());
    let parallel = observe(left_from_right.rotation.transpose() * ahead.bearing, left_from_right);
    assert!(triangulate(&[ahead, parallel]).is_none());
    let parting = observe(left_from_right.rotation.transpose() * Vector3::new(0.3, 0.0, 1.0), left_from_right);
    assert!(triangulate(&[ahead, parting]).is_none());
    let meeting = observe(left_from_right.inverse().point(&(ahead.bearing * 2.0)), left_from_right);
    let sure = |covariance| [ahead, meeting].map(|one| BearingObservation { covariance, ..one });
    assert!(triangulate(&sure(ahead.covariance)).is_some());
    for wrong in [Matrix2::new(-1e-8, 0.0, 0.0, 1e-8), Matrix2::new(1e-8, 1e-7, 1e-7, 1e-8), Matrix2::repeat(f64::NAN)]
    {
        assert!(triangulate(&sure(wrong)).is_none());
    }
    // The same line of sight twice, of which rounding may make two.
    for k in 0..200 {
        let turn = Rotation3::from_scaled_axis(Vector3::new(-3.0, 0.01 * f64::from(k), -2.9)).into_inner();
        let place = RigidMotion { rotation: turn, translation_m: Vector3::new(-1.0, -1.0, -1.0) };
        for covariance in [Matrix2::zeros(), Matrix2::identity() * 1e-8] {
            let one = BearingObservation { covariance, ..observe(Vector3::repeat(-1.0), place) };
            let found = triangulate(&[one, one]);
            assert!(found.is_none_or(|found| found.covariance_m2.cholesky().is_some()), "{found:?}");
        }
    }
}

/// Covariances of which one direction is known 1e8 times as well as the other: whatever rounding leaves, an answer is one.
#[test]
fn nearly_singular_bearings_give_a_point_with_a_covariance_or_none() {
    let mut rng = ChaCha8Rng::seed_from_u64(18);
    let (left_from_right, right_from_left) = right_camera();
    let mut answers = 0;
    for k in 0..20_000 {
        let mut number = || 2.0 * rng.random::<f64>() - 1.0;
        let point = Vector3::new(number(), number(), 2.0);
        let thin = |angle: f64, size: f64| {
            let along = Vector2::new(angle.cos(), angle.sin());
            along * along.transpose() * size
        };
        let size = 10f64.powi(-(k % 16));
        let covariances = [thin(3.0 * number(), size), thin(3.0 * number(), size)];
        let off = Vector3::new(number(), number(), number()) * 0.01;
        let bearings = [(point + off).normalize(), right_from_left.point(&point).normalize()];
        let cameras = [RigidMotion::identity(), left_from_right];
        let observations = [0, 1].map(|k| BearingObservation {
            bearing: bearings[k],
            covariance: covariances[k],
            rig_from_camera: cameras[k],
        });
        let Some(found) = triangulate(&observations) else { continue };
        answers += 1;
        assert!(found.point_m.iter().all(|x| x.is_finite()) && found.chi_square >= 0.0, "{observations:?} {found:?}");
        assert!(positive_semidefinite(&found.covariance_m2), "{observations:?} {found:?}");
    }
    assert!(answers > 100, "{answers}");
}
