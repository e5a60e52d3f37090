//! Local optimisation of a new best model: iterated least squares with a falling threshold (LO-RANSAC).

use super::loss::Gate;
use super::problem::{Problem, gated};
use super::sampling::{LocalOptimization, Score};

/// The best of a model and its refits, with its score; `found` is the model and its own score.
pub(super) fn improve<P: Problem>(
    problem: &P,
    options: LocalOptimization,
    (threshold, score): (f64, Score),
    found: (P::Model, f64),
    weights: &mut [f32],
) -> (P::Model, f64) {
    let (mut best, mut most) = found;
    let mut model = best.clone();
    for round in 0..options.iterations {
        let progress = f64::from(round) / f64::from(options.iterations.saturating_sub(1).max(1));
        let factor = options.widening + (1.0 - options.widening) * progress;
        let moments = gated(problem, &model, Gate::Within { threshold: factor * threshold }, weights);
        let Some(next) = problem.fit_weighted(&moments) else { break };
        let gained = problem.rows().support(problem.coefficients(&next), threshold, score, most);
        model = next;
        if gained > most {
            (best, most) = (model.clone(), gained);
        }
    }
    (best, most)
}
