//! How much a mounting hangs on its landmarks, and on the odometry of the parts of a drive.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::descent::{DescentReport, FIRST_DAMPING};
use super::problem::BundleProblem;
use crate::filter::chi_square_cdf;
use crate::geometry::wrap_angle;

/// Parts of a drive whose odometry is doubted in turn. With 16 deviations of drives with a carpet are the same within a sixth.
const PARTS: usize = 8;

/// The factor of its standard deviations meanwhile. With 3 wheels that run 5 % too far on a quarter of a drive are half seen; with 100
/// the parts before and after it hardly hold together, and deviations of drives whose motions err alone grow by a half.
const DOUBT: f64 = 10.0;

/// Most iterations of each solution, which starts at that of the whole, and the fall of the cost below which it has converged.
const ITERATIONS: u32 = 30;
const TOLERANCE: f64 = 1e-3;

/// What changes where the odometry of each part of a drive is doubted in turn.
pub(crate) struct DoubtedParts {
    /// The keyframes to which the motions of each part lead.
    keyframes: Vec<Range<usize>>,
    /// How far the calibration parameters move, x, y and yaw first.
    moved: Vec<DVector<f64>>,
    /// By how much the cost falls, but for what single slips add to it.
    falls: Vec<f64>,
}

impl DoubtedParts {
    /// Covariance of the calibration parameters from how far they move.
    ///
    /// Where motions err on their own it is what their noise makes. Where they err together, as on a carpet on which both wheels run too
    /// far, it is that much more, of which residuals say little: the solution follows what lasts.
    pub(crate) fn scatter(&self) -> DMatrix<f64> {
        let width = self.moved[0].len();
        self.moved.iter().fold(DMatrix::zeros(width, width), |sum, off| sum + off * off.transpose())
    }

    /// That of x, y and yaw.
    pub(crate) fn scatter_of_mounting(&self) -> Matrix3<f64> {
        self.scatter().fixed_view::<3, 3>(0, 0).into()
    }

    /// The keyframes of the part that the bearings contradict the most, if by chance they contradict one as much with less than a
    /// probability: twice the fall of the cost is chi-square of as many numbers of its motions as the bearings tell, which is what it is
    /// where most parts are doubted. By `excess` the variances of all motions seem to be larger than told.
    pub(crate) fn contradicted(&self, excess: f64, by_chance: f64) -> Option<Range<usize>> {
        let mut sorted = self.falls.clone();
        sorted.sort_by(f64::total_cmp);
        let most = sorted[sorted.len() / 2];
        let worst = (0..self.falls.len()).max_by(|a, b| self.falls[*a].total_cmp(&self.falls[*b]))?;
        let told = (2.0 * most / excess).max(1.0).round() as u32;
        let probable = chi_square_cdf(2.0 * self.falls[worst] / excess, told);
        (probable > 1.0 - by_chance).then(|| self.keyframes[worst].clone())
    }
}

impl BundleProblem {
    /// Solves the problem with the odometry of each part of the drive doubted in turn. `None` without motions, or if one of them has no
    /// solution.
    pub(crate) fn doubted_parts(&self) -> Option<DoubtedParts> {
        let motions = self.keyframes.len() - 1;
        let parts = PARTS.min(motions);
        let first = |part: usize| 1 + motions * part / parts;
        let keyframes: Vec<Range<usize>> = (0..parts).map(|part| first(part)..first(part + 1)).collect();
        let cost = self.cost();
        let solved = |part: &Range<usize>| {
            let mut problem = self.clone();
            problem.doubt(part.clone());
            let descent = problem.levenberg_marquardt_carrying(ITERATIONS, TOLERANCE, FIRST_DAMPING);
            let slips: f64 = part.clone().filter(|to| self.slipped(*to)).map(|to| self.motion_cost(to)).sum();
            Some((self.moved(&problem, &descent)?, cost - descent.cost - slips))
        };
        let (moved, falls) = keyframes.iter().map(solved).collect::<Option<(Vec<_>, Vec<_>)>>()?;
        (parts > 0).then_some(DoubtedParts { keyframes, moved, falls })
    }

    /// Doubts the odometry that leads to keyframes.
    pub(crate) fn doubt(&mut self, keyframes: Range<usize>) {
        for keyframe in &mut self.keyframes[keyframes] {
            keyframe.information /= DOUBT * DOUBT;
        }
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
        assert!(problem.doubted_parts().is_none());
    }

    #[test]
    fn bearings_contradict_a_part_where_the_cost_falls_farther_than_by_chance() {
        let contradicted = |falls: [f64; 5]| {
            let keyframes = (0..5).map(|part| 1 + 4 * part..5 + 4 * part).collect();
            DoubtedParts { keyframes, moved: vec![DVector::zeros(3); 5], falls: falls.to_vec() }.contradicted(1.0, 1e-3)
        };
        // Of 18 numbers chi-square is above 42.31 once in a thousand times, of one above 10.83.
        assert_eq!(contradicted([9.0, 4.0, 12.0, 21.2, 8.0]), Some(13..17));
        assert_eq!(contradicted([9.0, 4.0, 12.0, 21.1, 8.0]), None);
        assert_eq!(contradicted([0.01, 0.0, 5.42, 0.0, 0.01]), Some(9..13));
        assert_eq!(contradicted([0.01, 0.0, 5.41, 0.0, 0.01]), None);
        // Of two the farther one.
        assert_eq!(contradicted([90.0, 4.0, 9.0, 50.0, 8.0]), Some(1..5));
    }
}
