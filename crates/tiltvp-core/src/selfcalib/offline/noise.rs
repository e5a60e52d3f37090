//! The noise of a log, where its residuals say that it is another than told.

use super::descent::solve;
use crate::selfcalib::bundle::{BundleProblem, DescentReport, FreeParameters};
use crate::selfcalib::diagnosis::NoiseFactors;

/// Most rounds of solving with the noise that the last residuals told: variance components converge in two or three.
const NOISE_ROUNDS: usize = 5;

/// Solves a problem again with the noise that its residuals tell where that is more than was told; `None` where it is not.
///
/// Wheels and clock are free meanwhile, so that what they are wrong by does not count as noise.
pub(super) fn solve_with_noise(problem: &mut BundleProblem, max_iterations: u32) -> Option<DescentReport> {
    if problem.noise_factors() == NoiseFactors::ONE {
        return None;
    }
    let mut free = problem.with_free(FreeParameters { wheels: true, offset: true });
    let mut total = NoiseFactors::ONE;
    for _ in 0..NOISE_ROUNDS {
        solve(&mut free, max_iterations);
        let factors = free.noise_factors();
        if factors == NoiseFactors::ONE {
            break;
        }
        free.scale_noise(factors);
        total = total.times(factors);
    }
    // Noise that is told too large costs accuracy, but leaves the stated errors true: what is told stays.
    let more = NoiseFactors { bearings: total.bearings.max(1.0), motions: total.motions.max(1.0) };
    if more == NoiseFactors::ONE {
        return None;
    }
    problem.scale_noise(more);
    Some(solve(problem, max_iterations))
}
