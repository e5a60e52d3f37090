//! How much a mounting hangs on its landmarks.

use nalgebra::{Matrix3, Vector3};

use super::descent::solve;
use crate::geometry::wrap_angle;
use crate::selfcalib::bundle::BundleProblem;

/// Covariance of x, y and yaw from the solutions without each of so many parts of the landmarks in turn: the delete-a-group
/// jackknife of Shao and Wu 1989. `None` if one part has them all, or without one there is no solution.
///
/// Where few landmarks tell the mounting the solution follows the errors of each, and residuals say little of them: such as of a
/// line that is two things'.
pub(super) fn jackknife_covariance(problem: &BundleProblem, parts: usize, max_iterations: u32) -> Option<Matrix3<f64>> {
    let parts = parts.min(problem.landmarks.len());
    if parts < 2 {
        return None;
    }
    let mut solutions = Vec::with_capacity(parts);
    for part in 0..parts {
        let mut without = problem.without_landmarks(|landmark| landmark % parts == part);
        let descent = solve(&mut without, max_iterations);
        let mut off = without.mounting - problem.mounting;
        off.z = wrap_angle(off.z);
        solutions.push(Some(off).filter(|off| descent.cost.is_finite() && off.iter().all(|x| x.is_finite()))?);
    }
    let mean = solutions.iter().sum::<Vector3<f64>>() / parts as f64;
    let squares = solutions.iter().map(|off| (off - mean) * (off - mean).transpose()).sum::<Matrix3<f64>>();
    Some(squares * (1.0 - 1.0 / parts as f64))
}
