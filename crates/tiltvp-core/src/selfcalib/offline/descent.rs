//! The descent of a whole log's problem: robustly, then without outliers, then with the scatters of the landmarks; and without slips.

use super::incremental::ROBUST_LOSS;
use crate::selfcalib::bundle::{BundleProblem, DescentReport, FIRST_DAMPING};
use crate::selfcalib::model::{BearingLoss, MotionLoss, OUTLIER_SIGMAS};

/// Fall of the cost below which a descent has converged: far below the 1/2 by which the cost rises at one standard deviation.
pub(super) const TOLERANCE: f64 = 1e-3;

/// Most estimates of the landmarks' scatters, each followed by two descents. They stop by themselves once none changes by 20 %;
/// the limit bounds the time where two solutions alternate.
const SCATTER_ROUNDS: usize = 4;

/// Solves a problem with robust losses, then without outliers, then with the scatters of the landmarks.
pub(super) fn solve(problem: &mut BundleProblem, max_iterations: u32) -> DescentReport {
    problem.slip = MotionLoss::Logarithmic;
    let descend = |problem: &mut BundleProblem, loss: BearingLoss| {
        problem.loss = loss;
        problem.levenberg_marquardt_carrying(max_iterations, TOLERANCE, FIRST_DAMPING)
    };
    let losses = [ROBUST_LOSS, BearingLoss::Truncated(OUTLIER_SIGMAS)];
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

/// Solves a problem that was solved again without the pull of motions that have slipped, if there are any.
pub(super) fn solve_without_slips(problem: &mut BundleProblem, max_iterations: u32) -> Option<DescentReport> {
    if !problem.any_slipped() {
        return None;
    }
    problem.slip = MotionLoss::Redescending;
    Some(problem.levenberg_marquardt_carrying(max_iterations, TOLERANCE, FIRST_DAMPING))
}
