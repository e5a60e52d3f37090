//! The descent of a whole log's problem: robustly, then without outliers and slips, then with the scatters of the landmarks.

use super::incremental::ROBUST_LOSS;
use crate::selfcalib::bundle::{BundleProblem, DescentReport, FIRST_DAMPING, SLIP_SIGMAS};
use crate::selfcalib::model::{BearingLoss, MotionLoss, OUTLIER_SIGMAS};

/// Fall of the cost below which a descent has converged: far below the 1/2 by which the cost rises at one standard deviation.
pub(super) const TOLERANCE: f64 = 1e-3;

/// Most estimates of the landmarks' scatters, each followed by two descents. They stop by themselves once none changes by 20 %;
/// the limit bounds the time where two solutions alternate.
const SCATTER_ROUNDS: usize = 4;

/// Solves a problem with robust losses, then without outliers and slips, then with the scatters of the landmarks.
pub(super) fn solve(problem: &mut BundleProblem, max_iterations: u32) -> DescentReport {
    let descend = |problem: &mut BundleProblem, losses: (BearingLoss, MotionLoss)| {
        (problem.loss, problem.slip) = losses;
        problem.levenberg_marquardt(max_iterations, TOLERANCE, FIRST_DAMPING)
    };
    let losses = [
        (ROBUST_LOSS, MotionLoss::Logarithmic(SLIP_SIGMAS)),
        (BearingLoss::Truncated(OUTLIER_SIGMAS), MotionLoss::Redescending(SLIP_SIGMAS)),
    ];
    let [robust, mut last] = losses.map(|loss| descend(problem, loss));
    let mut iterations = robust.iterations + last.iterations;
    for _ in 0..SCATTER_ROUNDS {
        if !problem.estimate_scatters() {
            break;
        }
        for loss in losses {
            last = descend(problem, loss);
            iterations += last.iterations;
        }
    }
    if problem.free.offset {
        let mut other = problem.clone();
        other.late = !problem.late;
        let descent = descend(&mut other, losses[1]);
        iterations += descent.iterations;
        if descent.cost < last.cost {
            (*problem, last) = (other, descent);
        }
    }
    DescentReport { iterations, ..last }
}
