//! The descent of a whole log's problem: robustly, then without outliers, then with the scatters of the landmarks; and without slips.

use super::incremental::ROBUST_LOSS;
use crate::selfcalib::bundle::{BundleProblem, CholeskyFactor, DescentReport, FIRST_DAMPING, FreeParameters};
use crate::selfcalib::model::{BearingLoss, MotionLoss, OUTLIER_SIGMAS};

/// Fall of the cost below which a descent has converged: far below the 1/2 by which the cost rises at one standard deviation.
pub(super) const TOLERANCE: f64 = 1e-3;

/// Most estimates of the landmarks' scatters, each followed by two descents. They stop by themselves once none changes by 20 %;
/// the limit bounds the time where two solutions alternate.
const SCATTER_ROUNDS: usize = 4;

/// Solves a problem with robust losses, then without outliers, then with the scatters of the landmarks.
pub(super) fn solve(problem: &mut BundleProblem, max_iterations: u32) -> DescentReport {
    problem.slip = MotionLoss::Logarithmic;
    problem.turns_as_read = true;
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
        let descent = solve_other_side(problem, last, max_iterations);
        iterations += descent.iterations;
        last = descent;
    }
    DescentReport { iterations, ..last }
}

/// Solves a problem with a free time offset, solved with late bearings or with early ones, with the others, and leaves the better solution.
fn solve_other_side(problem: &mut BundleProblem, solved: DescentReport, max_iterations: u32) -> DescentReport {
    let mut other = problem.clone();
    other.late = !problem.late;
    let descent = other.levenberg_marquardt_carrying(max_iterations, TOLERANCE, FIRST_DAMPING);
    if descent.cost < solved.cost {
        *problem = other;
        return descent;
    }
    DescentReport { iterations: descent.iterations, ..solved }
}

/// The time offset of a solved problem where it is free, in its standard deviations.
pub(super) fn time_offset_sigmas(solved: &BundleProblem, max_iterations: u32) -> Option<f64> {
    let mut problem = solved.with_free(FreeParameters { offset: true, ..solved.free });
    let descent = problem.levenberg_marquardt_carrying(max_iterations, TOLERANCE, FIRST_DAMPING);
    solve_other_side(&mut problem, descent, max_iterations);
    let system = problem.eliminate_poses(problem.keyframes.len() - 1, false, 0.0)?;
    let covariance = CholeskyFactor::regularised(&system.equations.information)?.inverse();
    let at = problem.free.offset_at();
    Some(problem.offset_s.abs() / covariance[(at, at)].sqrt())
}

/// Solves a problem that was solved again without the pull of motions that have slipped, if there are any.
pub(super) fn solve_without_slips(problem: &mut BundleProblem, max_iterations: u32) -> Option<DescentReport> {
    if !problem.any_slipped() {
        return None;
    }
    problem.slip = MotionLoss::Redescending;
    Some(problem.levenberg_marquardt_carrying(max_iterations, TOLERANCE, FIRST_DAMPING))
}
