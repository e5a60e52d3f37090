//! What a robust fit asks of a model-fitting problem.

use super::loss::Gate;
use super::moments::Moments;
use super::rows::Rows;
use super::{Real, Weights};

/// A model-fitting problem that borrows its observations: rows `(x, y, z)` with the residual `x h0 + y h1 + z h2`, where the
/// coefficients `h` are those of a model.
///
/// Counting, bounds and sums over all observations are those of [`Rows`]; a problem says what a model is.
pub trait Problem {
    /// What is fitted.
    type Model: Clone;
    /// The arithmetic of the rows.
    type Number: Real;
    /// How many observations determine a model.
    const SAMPLE_SIZE: usize;
    /// What is known of the weights.
    const WEIGHTS: Weights = Weights::Any;
    /// Models whose `h2` is below this, which is above zero, are counted without looking at the upper bound of their consensus.
    const BOUNDED_H2_MIN: f64 = 1.0;

    /// The observations.
    fn rows(&self) -> &Rows<Self::Number>;

    /// How promising an observation is as part of a sample, zero or more: progressive sampling begins with the largest.
    fn quality(&self, _index: usize) -> f32 {
        0.0
    }

    /// The model through `SAMPLE_SIZE` observations, `None` if they are degenerate.
    fn fit_minimal(&self, sample: &[usize]) -> Option<Self::Model>;

    /// The weighted least-squares model, `None` if the observations do not determine one.
    fn fit_weighted(&self, moments: &Moments) -> Option<Self::Model>;

    /// The coefficients `(h0, h1, h2)` of a model.
    fn coefficients(&self, model: &Self::Model) -> [f64; 3];

    /// How far two models are apart, in the unit in which convergence is declared.
    fn distance(&self, a: &Self::Model, b: &Self::Model) -> f64;
}

/// Applies a gate about a model and takes the moments of what is left; a hard gate sets the weights that it rejects to zero.
pub(super) fn gated<P: Problem>(problem: &P, model: &P::Model, gate: Gate, weights: &mut [f32]) -> Moments {
    problem.rows().moments_of(problem.coefficients(model), gate, (weights, P::WEIGHTS))
}
