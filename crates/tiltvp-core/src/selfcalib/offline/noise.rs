//! The noise of a log, or of the motions of a part of it, where its residuals say that it is another than told.

use nalgebra::Vector2;

use super::descent::solve;
use crate::selfcalib::bundle::{BundleProblem, DescentReport, FreeParameters};
use crate::selfcalib::diagnosis::NoiseFactors;

/// Most rounds of solving with the noise that the last residuals told: variance components converge in two or three.
const NOISE_ROUNDS: usize = 5;

/// Most parts of a drive whose odometry is doubted for good: as many as a carpet under a quarter of it lies in.
const DOUBTED_MAX: usize = 3;

/// The probability that bearings contradict a part of the motions as much by chance, below which it is doubted for good: a part that is
/// doubted for nothing costs little. The largest error of drives with a carpet (seeds 302000, 303000, 310000 and 330000 of
/// `just measure-trust-calibration --only carpet`) is 2.0 deviations of the bound rms with 0.01, 2.1 with 0.004, 2.3 with 0.001 and 2.7
/// without doubt (where nothing is stricter); those of drives whose motions err alone are the same.
const DOUBTED_BY_CHANCE: f64 = 0.01;

/// The same where the noise of all motions seems to be larger than told, and where the wheels are estimated, which follow a part of what
/// errs. With 0.01 parts are doubted instead of the noise in a tenth of the drives whose noise is told 5 times too small, and the squared
/// errors of the imbalance and of the wheel base are 4.7 and 4.9 of their stated variances on a carpet
/// (`a_carpet_makes_deviations_of_wheels_and_delay_wider`), with 0.001 1.8 and 2.6.
const DOUBTED_STRICTLY: f64 = 0.001;

/// Solves a problem again with the noise that its residuals tell where that is more than was told; `None` where it is not.
///
/// Wheels, clock and image centre are free meanwhile, so that what they are wrong by does not count as noise.
pub(super) fn solve_with_noise(problem: &mut BundleProblem, max_iterations: u32) -> Option<DescentReport> {
    if problem.noise_factors() == NoiseFactors::ONE {
        return None;
    }
    let mut free = problem.with_free(FreeParameters::ALL);
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

/// Solves a problem again without the odometry of the parts of the drive that the bearings contradict. Returns those too, as shares of
/// the drive from where to where; `None` where they contradict none.
pub(super) fn solve_with_doubt(
    problem: &mut BundleProblem,
    max_iterations: u32,
) -> Option<(DescentReport, Vec<Vector2<f64>>)> {
    let motions = (problem.keyframes.len() - 1) as f64;
    let excess = |problem: &BundleProblem| problem.noise_factors().motions.max(1.0);
    let is_strict = problem.free.wheels || excess(problem) > 1.0;
    let by_chance = if is_strict { DOUBTED_STRICTLY } else { DOUBTED_BY_CHANCE };
    let (mut last, mut parts) = (None, Vec::new());
    while parts.len() < DOUBTED_MAX
        && let Some(keyframes) =
            problem.doubted_parts().and_then(|parts| parts.contradicted(excess(problem), by_chance))
    {
        parts.push(Vector2::new((keyframes.start - 1) as f64, (keyframes.end - 1) as f64) / motions);
        problem.doubt(keyframes);
        last = Some(solve(problem, max_iterations));
    }
    parts.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut joined: Vec<Vector2<f64>> = Vec::new();
    for part in parts {
        match joined.last_mut() {
            Some(before) if part.x <= before.y => before.y = part.y,
            _ => joined.push(part),
        }
    }
    Some((last?, joined))
}
