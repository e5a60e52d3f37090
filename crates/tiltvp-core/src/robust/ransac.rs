//! The one random-sampling loop (Fischler and Bolles 1981), as section 2.1.4 of Fleer 2017 uses it.

use tiltvp_kernels::rows::ConsensusBound;

use super::hypotheses::Hypotheses;
use super::local::improve;
use super::loss::Gate;
use super::problem::{Problem, gated};
use super::ransac_options::RansacOptions;
use super::report::{FitReport, Stop};
use super::sampler::{Sampler, best_first};
use super::sampling::{SampleOrder, Sampling, Score};

/// The memory of the sampling loop, grown once.
#[derive(Debug, Clone, Default)]
pub struct RansacScratch {
    keys: Vec<u64>,
    order: Vec<u32>,
    bound: ConsensusBound,
}

impl RansacScratch {
    /// Makes room for `capacity` observations, sampled in this way, so that no fit of so many allocates.
    pub fn reserve(&mut self, sampling: &Sampling, capacity: usize) {
        let Self { keys, order, bound } = self;
        if sampling.order != SampleOrder::Uniform {
            keys.clear();
            keys.reserve(capacity);
            order.clear();
            order.reserve(capacity);
        }
        if ConsensusBound::pays(capacity, u32::MAX) {
            bound.reserve();
        }
    }
}

/// Draws minimal samples, keeps the model with the best score, and refits it to its consensus set.
///
/// Sampling stops once `1 - (1 - P)^n > confidence`, with `P` the probability that one sample is drawn from the consensus
/// set of the best model so far (without replacement), or at the limit. `weights` (one per observation, above zero) are
/// those of the final fit; on return they are zero outside the consensus set.
pub fn ransac<P: Problem>(
    problem: &P,
    options: &RansacOptions,
    weights: &mut [f32],
    scratch: &mut RansacScratch,
) -> FitReport<P::Model> {
    let (len, threshold, sampling) = (problem.rows().len(), options.threshold, &options.sampling);
    if len < P::SAMPLE_SIZE {
        return FitReport::failed(Stop::TooFew { have: len, need: P::SAMPLE_SIZE }, 0);
    }
    let RansacScratch { keys, order, bound } = scratch;
    let sampler = match sampling.order {
        SampleOrder::Uniform => Sampler::uniform(options.seed, len),
        SampleOrder::Progressive { uniform_after } => {
            // The pool grows by at most one with each trial.
            best_first(problem, P::SAMPLE_SIZE + options.max_trials as usize, keys, order);
            Sampler::progressive(options.seed, len, order, P::SAMPLE_SIZE, uniform_after)
        }
    };
    let mut hypotheses = Hypotheses::new(problem, options, sampler, bound);
    let mut best: Option<(P::Model, f64)> = None;
    let (mut trials, mut needed) = (0, options.max_trials);
    while trials < needed.min(options.max_trials) {
        let next = hypotheses.next(best.as_ref().map(|(_, score)| *score), needed.min(options.max_trials) - trials);
        trials += 1;
        let Some(found) = next else { continue };
        let (model, score) = match sampling.local_optimization {
            Some(local) => improve(problem, local, (threshold, sampling.score), found, weights),
            None => found,
        };
        let inliers = match sampling.score {
            Score::Count => score as usize,
            Score::Msac => problem.rows().count_within(problem.coefficients(&model), threshold),
        };
        needed = trials_needed(all_inliers(inliers, len, P::SAMPLE_SIZE), options.confidence);
        best = Some((model, score));
    }
    let Some((model, _)) = best else {
        return FitReport::failed(Stop::NoModel { trials }, trials);
    };
    let stop = if needed <= trials {
        Stop::Confident { trials, needed }
    } else {
        Stop::TrialLimit { limit: options.max_trials }
    };
    let moments = gated(problem, &model, Gate::Hard { threshold }, weights);
    let Some(refitted) = problem.fit_weighted(&moments) else {
        return FitReport::failed(Stop::NoModel { trials }, trials);
    };
    let rms = moments.rms(problem.coefficients(&refitted));
    FitReport { rms, model: Some(refitted), inliers: moments.count, iterations: trials, stop }
}

/// The exact probability of drawing a sample of inliers without replacement.
fn all_inliers(inliers: usize, len: usize, sample_size: usize) -> f64 {
    (0..sample_size).map(|i| inliers.saturating_sub(i) as f64 / (len - i) as f64).product()
}

/// The least number of trials, one or more, of which one is a success of this probability with more than the given confidence.
fn trials_needed(chance: f64, confidence: f64) -> u32 {
    if chance >= 1.0 {
        return 1;
    }
    let needed = (1.0 - confidence).ln() / (-chance).ln_1p();
    if needed.is_finite() { (needed.floor() + 1.0).clamp(1.0, f64::from(u32::MAX)) as u32 } else { u32::MAX }
}
