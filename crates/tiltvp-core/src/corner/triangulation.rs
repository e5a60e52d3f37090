//! The vertex in space, from its bearings in two or more cameras of any kind (section III-F).

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::ray::VARIANCE_MIN;
use crate::filter::symmetric;
use crate::geometry::{RigidMotion, tangent_basis};

/// A bearing of a point, from a camera of a rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingObservation {
    /// Unit bearing, camera frame.
    pub bearing: Vector3<f64>,
    /// Its covariance in square radians, in the plane of [`tangent_basis`] at it.
    pub covariance: Matrix2<f64>,
    /// Where the camera is in the rig.
    pub rig_from_camera: RigidMotion,
}

/// A point in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangulatedPoint {
    /// The point in the rig's frame, metres.
    pub point_m: Vector3<f64>,
    /// Its covariance, square metres.
    pub covariance_m2: Matrix3<f64>,
    /// Sum of the squared misses of the bearings, each by its variance: chi-square of two degrees of freedom per bearing
    /// less three.
    pub chi_square: f64,
}

/// Gauss-Newton steps from the point nearest to the lines of sight. Convergence is quadratic from a start that is a few
/// standard deviations off; a step below rounding ends it earlier.
const STEPS: usize = 6;

/// The point with the least sum of squared misses of the bearings, each by its covariance.
///
/// `None` for fewer than two observations, for lines of sight that are parallel to rounding, and where a camera would have the
/// point behind it.
pub fn triangulate(observations: &[BearingObservation]) -> Option<TriangulatedPoint> {
    let (mut point, _) = nearest(observations)?;
    for step in 0..=STEPS {
        let (mut information, mut pull, mut chi_square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for observation in observations {
            let rotation = observation.rig_from_camera.rotation;
            let to = rotation.transpose() * (point - observation.rig_from_camera.translation_m);
            let distance = to.norm();
            let seen = to / distance;
            let ahead = seen.dot(&observation.bearing);
            if ahead <= 0.0 || ahead.is_nan() {
                return None;
            }
            let basis = tangent_basis(&observation.bearing).transpose();
            // In standard deviations, so that squares of what is left stay squares however thin the covariance.
            let whitener = whitener(&observation.covariance)?;
            let miss = whitener * basis * seen;
            let across = Matrix3::identity() - seen * seen.transpose();
            let by_point = whitener * basis * across * rotation.transpose() / distance;
            information += by_point.transpose() * by_point;
            pull += by_point.transpose() * miss;
            chi_square += miss.norm_squared();
        }
        let covariance_m2 = information.cholesky()?.inverse();
        let move_m = covariance_m2 * pull;
        if step == STEPS || move_m.norm() <= 1e-14 * point.norm() {
            // A covariance that rounding has turned round is that of lines of sight too near to parallel ones.
            let covariance_m2 = symmetric(&covariance_m2);
            let positive = covariance_m2.cholesky().is_some();
            let finite = point.iter().chain(covariance_m2.iter()).chain([&chi_square]).all(|x| x.is_finite());
            return (finite && positive).then_some(TriangulatedPoint { point_m: point, covariance_m2, chi_square });
        }
        point -= move_m;
    }
    None
}

/// What takes a miss of a bearing to standard deviations: the inverse of its covariance's Cholesky factor; none of a matrix that is
/// no covariance.
fn whitener(covariance: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    (covariance + Matrix2::from_diagonal_element(VARIANCE_MIN)).cholesky()?.l().try_inverse()
}

/// The point nearest to all lines of sight, and the inverse of the sum of projections across them; none where they are parallel.
fn nearest(observations: &[BearingObservation]) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    if observations.len() < 2 {
        return None;
    }
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for observation in observations {
        let along = observation.rig_from_camera.rotation * observation.bearing;
        let across = Matrix3::identity() - along * along.transpose();
        matrix += across;
        right += across * observation.rig_from_camera.translation_m;
    }
    // The least eigenvalue is about half of the squared angle between the lines of sight.
    let apart = matrix.symmetric_eigenvalues().min();
    if apart <= PARALLEL || apart.is_nan() {
        return None;
    }
    let inverse = matrix.try_inverse()?;
    Some((inverse * right, inverse))
}

/// The middle of the shortest line between two lines of sight, which is the point nearest to both, with its covariance to first
/// order; none where they are parallel and where the point would be behind a camera.
pub(super) fn midpoint(observations: &[BearingObservation; 2]) -> Option<TriangulatedPoint> {
    let (point, inverse) = nearest(observations)?;
    let (mut spread, mut chi_square) = (Matrix3::zeros(), 0.0);
    for observation in observations {
        let rotation = observation.rig_from_camera.rotation;
        let to = rotation.transpose() * (point - observation.rig_from_camera.translation_m);
        let ahead = to.dot(&observation.bearing);
        if ahead <= 0.0 || ahead.is_nan() {
            return None;
        }
        let basis = tangent_basis(&observation.bearing);
        let carried = rotation * basis * ahead;
        spread += carried * observation.covariance * carried.transpose();
        let miss = basis.transpose() * to / ahead;
        chi_square += (whitener(&observation.covariance)? * miss).norm_squared();
    }
    Some(TriangulatedPoint { point_m: point, covariance_m2: symmetric(&(inverse * spread * inverse)), chi_square })
}

/// Least eigenvalue of the sum of projections across the lines of sight, about half of their squared angle: 1e-8 rad,
/// at which the distance is rounding. The test of parallel lines of sight meets it.
const PARALLEL: f64 = 1e-16;
