//! What a robust fit asks of a model-fitting problem.

use super::census::Census;
use super::loss::Gate;
use super::sampling::Score;

/// A model-fitting problem that borrows its observations.
///
/// Fits go through a [`Summary`](Self::Summary), the sufficient statistics of a weighted subset, so that one pass over
/// the observations both applies the last model's gate and prepares the next fit.
pub trait Problem {
    /// What is fitted.
    type Model: Clone;
    /// Sufficient statistics of a weighted subset of the observations.
    type Summary;
    /// How many observations determine a model.
    const SAMPLE_SIZE: usize;

    /// How many observations there are.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The model through `SAMPLE_SIZE` observations, `None` if they are degenerate.
    fn fit_minimal(&self, sample: &[usize]) -> Option<Self::Model>;

    /// How many observations have a residual of at most `threshold`, in the problem's unit. Where that cannot exceed
    /// `to_beat`, any count up to `to_beat` will do.
    fn consensus(&self, model: &Self::Model, threshold: f64, to_beat: usize) -> usize;

    /// [`consensus`](Self::consensus) of several models, one count for each; none for those that are none.
    fn consensus_of_each(&self, models: &[Option<Self::Model>], threshold: f64, to_beat: usize, counts: &mut [usize]) {
        for (model, count) in models.iter().zip(counts) {
            *count = model.as_ref().map_or(0, |model| self.consensus(model, threshold, to_beat));
        }
    }

    /// Takes the census by which [`consensus_at_most`](Self::consensus_at_most) bounds the consensus of models for a threshold;
    /// whether there is one for such problems.
    fn take_census(&self, _threshold: f64, _census: &mut Census) -> bool {
        false
    }

    /// No less than the [`consensus`](Self::consensus) of a model for the threshold of the census that was taken.
    fn consensus_at_most(&self, _census: &Census, _model: &Self::Model) -> usize {
        self.len()
    }

    /// [`consensus`](Self::consensus) among the listed observations alone.
    fn consensus_among(&self, observations: &[u32], model: &Self::Model, threshold: f64) -> usize;

    /// The sum of [`Score::gain`] over all observations. Where that cannot exceed `to_beat`, any number up to `to_beat` will
    /// do.
    fn support(&self, model: &Self::Model, threshold: f64, score: Score, to_beat: f64) -> f64;

    /// How promising an observation is as part of a sample, zero or more: progressive sampling begins with the largest.
    fn quality(&self, index: usize) -> f32;

    /// Applies a gate about a model and summarises what is left; a hard gate also sets the weights it rejects to zero.
    fn summarise(&self, model: &Self::Model, gate: Gate, weights: &mut [f32]) -> Self::Summary;

    /// What a hard gate about a model leaves of a summary of the observations with these weights; it sets the weights that it
    /// rejects to zero.
    fn trim(&self, _before: &Self::Summary, model: &Self::Model, threshold: f64, weights: &mut [f32]) -> Self::Summary {
        self.summarise(model, Gate::Hard { threshold }, weights)
    }

    /// The weighted least-squares model nearest to `near`, `None` if the observations do not determine one.
    fn fit(&self, summary: &Self::Summary, near: &Self::Model) -> Option<Self::Model>;

    /// Root of the weighted mean square residual of a model over the summarised observations.
    fn rms(&self, summary: &Self::Summary, model: &Self::Model) -> f64;

    /// How many observations a summary holds (those with a weight above zero).
    fn count(summary: &Self::Summary) -> usize;

    /// How far two models are apart, in the unit in which convergence is declared.
    fn distance(&self, a: &Self::Model, b: &Self::Model) -> f64;
}
