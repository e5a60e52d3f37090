//! How much a mounting hangs on its landmarks, and on the odometry of the parts of a drive.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::descent::{DescentReport, FIRST_DAMPING};
use super::problem::BundleProblem;
use crate::geometry::wrap_angle;

/// Parts of a drive whose odometry is doubted in turn. With 16 deviations of drives with a carpet are the same within a sixth.
const PARTS: usize = 8;

/// The factor of its standard deviations meanwhile. With 3 wheels that run 5 % too far on a quarter of a drive are half seen; with 100
/// the parts before and after it hardly hold together, and deviations of drives whose motions err alone grow by a half.
const DOUBT: f64 = 10.0;

/// Most iterations of each solution, which starts at that of the whole, and the fall of the cost below which it has converged.
const ITERATIONS: u32 = 30;
const TOLERANCE: f64 = 1e-3;

impl BundleProblem {
    /// Covariance of the calibration parameters, x, y and yaw first, from how far a solution moves where the odometry of each part of the
    /// drive is doubted in turn. `None` without motions, or if one of them has no solution.
    ///
    /// Where motions err on their own it is what their noise makes. Where they err together, as on a carpet on which both wheels run too
    /// far, it is that much more, of which residuals say little: the solution follows what lasts.
    pub(crate) fn motion_scatter(&self) -> Option<DMatrix<f64>> {
        let motions = self.keyframes.len() - 1;
        let parts = PARTS.min(motions);
        let doubted = |part: usize| {
            let (mut problem, of) = (self.clone(), |part: usize| 1 + motions * part / parts);
            for keyframe in &mut problem.keyframes[of(part)..of(part + 1)] {
                keyframe.information /= DOUBT * DOUBT;
            }
            let descent = problem.levenberg_marquardt(ITERATIONS, TOLERANCE, FIRST_DAMPING);
            self.moved(&problem, &descent)
        };
        let width = self.free.width();
        (0..parts)
            .map(doubted)
            .try_fold(DMatrix::zeros(width, width), |sum, off| off.map(|off| sum + &off * off.transpose()))
            .filter(|_| parts > 0)
    }

    /// Covariance of x, y and yaw from the solutions without each of so many parts of the landmarks in turn: the delete-a-group
    /// jackknife of Shao and Wu 1989. `None` if one part has them all, or without one there is no solution.
    ///
    /// Where few landmarks tell the mounting the solution follows the errors of each, and residuals say little of them: such as of a
    /// line that is two things'.
    pub(crate) fn landmark_scatter(
        &self,
        parts: usize,
        solve: impl Fn(&mut Self) -> DescentReport,
    ) -> Option<Matrix3<f64>> {
        let parts = parts.min(self.landmarks.len());
        if parts < 2 {
            return None;
        }
        let left_out = |part: usize| {
            let mut problem = self.without_landmarks(|landmark| landmark % parts == part);
            let descent = solve(&mut problem);
            self.moved(&problem, &descent)
        };
        let mounting = |off: DVector<f64>| -> Vector3<f64> { off.fixed_rows::<3>(0).into() };
        let moved = (0..parts).map(|part| left_out(part).map(mounting)).collect::<Option<Vec<_>>>()?;
        let mean = moved.iter().sum::<Vector3<f64>>() / parts as f64;
        let squares = moved.iter().map(|off| (off - mean) * (off - mean).transpose()).sum::<Matrix3<f64>>();
        Some(squares * (1.0 - 1.0 / parts as f64))
    }

    /// How far the calibration parameters of another solution are from this one's. `None` if it has none.
    fn moved(&self, other: &Self, descent: &DescentReport) -> Option<DVector<f64>> {
        let of = |problem: &Self| problem.shared().rows(0, problem.free.width()).into_owned();
        let mut off = of(other) - of(self);
        off[2] = wrap_angle(off[2]);
        Some(off).filter(|off| descent.cost.is_finite() && off.iter().all(|x| x.is_finite()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::bundle::FreeParameters;
    use crate::selfcalib::model::BearingLoss;
    use crate::selfcalib::options::SelfCalibratorOptions;

    #[test]
    fn a_robot_that_stands_has_no_motions_to_be_doubted() {
        let options = SelfCalibratorOptions::default();
        let loss = BearingLoss::Truncated(4.5);
        let problem = BundleProblem::new(&options, &Vector3::zeros(), FreeParameters::default(), loss);
        assert_eq!(problem.motion_scatter(), None);
    }
}
