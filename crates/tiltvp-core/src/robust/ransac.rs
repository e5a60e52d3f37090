//! The one random-sampling loop (Fischler and Bolles 1981), as paper 000 section 2.1.4 uses it.

use super::census::Census;
use super::local::improve;
use super::loss::Gate;
use super::problem::Problem;
use super::prosac::{all_inliers, best_beginning};
use super::report::{FitReport, Stop};
use super::sampler::{Sampler, best_first, shuffled};
use super::sampling::{SampleOrder, Sampling, Score, Verification};
use super::verification::{PROBES, Verifier};
use crate::error::{Error, Result};

/// Largest sample that a problem may ask for.
const MAX_SAMPLE: usize = 8;

/// Models that are counted at once, where nothing learnt from one bears on the next sample.
const AT_ONCE: usize = 8;

/// Models of which those are counted at once that a census leaves.
const BOUNDED_AT_ONCE: usize = 32;

/// Options of [`ransac`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RansacOptions {
    /// Largest residual of an inlier, in the problem's unit.
    pub threshold: f64,
    /// Most samples drawn, `N_R` in the paper. Default 1000.
    pub max_trials: u32,
    /// Probability of having drawn an all-inlier sample at which sampling stops, `q_min` in the paper. Default 0.9999.
    pub confidence: f64,
    /// Seed of the generator. Default 0.
    pub seed: u64,
    /// How samples are drawn, improved, scored and verified. Default the paper's way.
    pub sampling: Sampling,
}

impl RansacOptions {
    /// The paper's limits with a threshold of one's own.
    pub fn with_threshold(threshold: f64) -> Self {
        Self { threshold, max_trials: 1000, confidence: 0.9999, seed: 0, sampling: Sampling::default() }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        if !(self.threshold > 0.0 && self.threshold.is_finite()) {
            return Err(Error::option("threshold", self.threshold, "a positive finite residual"));
        }
        if self.max_trials == 0 {
            return Err(Error::option("max_trials", self.max_trials, "at least 1"));
        }
        if !(self.confidence > 0.0 && self.confidence < 1.0) {
            return Err(Error::option("confidence", self.confidence, "a probability strictly between 0 and 1"));
        }
        self.sampling.validate()
    }
}

/// The memory of the sampling loop: plain sampling needs none, the others grow it once.
#[derive(Debug, Clone, Default)]
pub struct RansacScratch {
    keys: Vec<u64>,
    order: Vec<u32>,
    probes: Vec<u32>,
    census: Census,
}

impl RansacScratch {
    /// Makes room for `capacity` observations, sampled in this way, so that no fit of so many allocates.
    pub fn reserve(&mut self, sampling: &Sampling, capacity: usize) {
        let Self { keys, order, probes, census } = self;
        if sampling.order != SampleOrder::Uniform {
            keys.clear();
            keys.reserve(capacity);
            order.clear();
            order.reserve(capacity);
        }
        if sampling.verification != Verification::Full {
            probes.clear();
            probes.reserve(capacity);
        }
        if *sampling == Sampling::default() && Census::pays(capacity, u32::MAX) {
            census.reserve();
        }
    }
}

/// Counts the consensus of models, or of those that may beat the best. What a census bounds from above by the best count has any
/// count up to that: it would not be taken, however many there are.
fn count_hopeful<P: Problem>(
    problem: &P,
    census: Option<&Census>,
    models: &[Option<P::Model>],
    (threshold, to_beat): (f64, usize),
    counts: &mut [usize],
) {
    let Some(census) = census else { return problem.consensus_of_each(models, threshold, to_beat, counts) };
    let mut hopeful = [const { None }; BOUNDED_AT_ONCE];
    for (hopeful, model) in hopeful.iter_mut().zip(models) {
        *hopeful = model.clone().filter(|model| problem.consensus_at_most(census, model) > to_beat);
    }
    problem.consensus_of_each(&hopeful[..models.len()], threshold, to_beat, counts);
}

/// Draws minimal samples, keeps the model with the best score, and refits it to its consensus set.
///
/// Sampling stops once `1 - (1 - P)^n > confidence`, with `P` the probability that one sample is drawn from the consensus
/// set of the best model so far (without replacement) and survives the verification, or at the limit. `weights` (one per
/// observation, above zero) are those of the final fit; on return they are zero outside the consensus set.
pub fn ransac<P: Problem>(
    problem: &P,
    options: &RansacOptions,
    near: &P::Model,
    weights: &mut [f32],
    scratch: &mut RansacScratch,
) -> FitReport<P::Model> {
    const { assert!(P::SAMPLE_SIZE <= MAX_SAMPLE) };
    let (len, threshold, sampling) = (problem.len(), options.threshold, &options.sampling);
    if len < P::SAMPLE_SIZE {
        return FitReport::failed(Stop::TooFew { have: len, need: P::SAMPLE_SIZE }, 0);
    }
    let RansacScratch { keys, order, probes, census } = scratch;
    let mut sampler = match sampling.order {
        SampleOrder::Uniform => Sampler::uniform(options.seed, len),
        SampleOrder::Progressive { uniform_after, .. } => {
            // The pool grows by at most one with each trial.
            best_first(problem, P::SAMPLE_SIZE + options.max_trials as usize, keys, order);
            Sampler::progressive(options.seed, len, order, P::SAMPLE_SIZE, uniform_after)
        }
    };
    if sampling.verification != Verification::Full {
        shuffled(options.seed, len, PROBES, probes);
    }
    let mut verifier = Verifier::new(sampling.verification, probes);
    let mut sample = [0; MAX_SAMPLE];
    let sample = &mut sample[..P::SAMPLE_SIZE];
    let mut best: Option<(f64, P::Model)> = None;
    let mut needed = options.max_trials;
    let mut trials = 0;
    // Samples drawn ahead of what is known of them; they are looked at in turn, so that all is as if they had not been.
    let plain = *sampling == Sampling::default();
    let (mut models, mut counts, mut drawn) = ([const { None }; BOUNDED_AT_ONCE], [0; BOUNDED_AT_ONCE], 0..0);
    let mut bounded = false;
    while trials < needed.min(options.max_trials) {
        if drawn.is_empty() {
            let left = needed.min(options.max_trials) - trials;
            if plain && !bounded && best.is_some() && Census::pays(len, left) {
                bounded = problem.take_census(threshold, census);
            }
            let ahead = match (plain, bounded) {
                (false, _) => 1,
                (true, false) => AT_ONCE,
                (true, true) => BOUNDED_AT_ONCE,
            };
            drawn = 0..ahead.min(left as usize);
            for model in &mut models[drawn.clone()] {
                sampler.draw(sample);
                *model = problem.fit_minimal(sample);
            }
            if plain {
                let (census, most) = (bounded.then_some(&*census), best.as_ref().map_or(0, |(most, _)| *most as usize));
                count_hopeful(problem, census, &models[drawn.clone()], (threshold, most), &mut counts[drawn.clone()]);
            }
        }
        trials += 1;
        let Some(next) = drawn.next() else { break };
        let Some(model) = models[next].take() else { continue };
        // The first model is scored whatever the test says, so that there is one to compare with.
        if !verifier.passes(problem, &model, threshold) && best.is_some() {
            continue;
        }
        let most = best.as_ref().map_or(0.0, |(most, _)| *most);
        // Counts are exact in double precision.
        let score = if plain { counts[next] as f64 } else { sampling.score.of(problem, &model, threshold, most) };
        if best.is_some() && score <= most {
            continue;
        }
        let (model, score) = match sampling.local_optimization {
            Some(local) => improve(problem, local, (threshold, sampling.score), (model, score), weights),
            None => (model, score),
        };
        let inliers = match sampling.score {
            Score::Count => score as usize,
            _ => problem.consensus(&model, threshold, 0),
        };
        let (pool, chance, share) = match sampling.order {
            SampleOrder::Uniform | SampleOrder::Progressive { chance_share: None, .. } => {
                (len, all_inliers(inliers, len, P::SAMPLE_SIZE), inliers as f64 / len as f64)
            }
            SampleOrder::Progressive { chance_share: Some(chance_share), .. } => {
                best_beginning(problem, &model, threshold, inliers, order, chance_share)
            }
        };
        sampler.limit_pool(pool);
        verifier.learn_good(inliers as f64 / len as f64);
        needed = verifier.trials_needed(trials, chance, share, options.confidence).max(1);
        best = Some((score, model));
    }
    let Some((_, model)) = best else {
        return FitReport::failed(Stop::NoModel { trials }, trials);
    };
    let stop = if needed <= trials {
        Stop::Confident { trials, needed }
    } else {
        Stop::TrialLimit { limit: options.max_trials }
    };
    let model = sampling.score.refit(problem, model, threshold, weights);
    let summary = problem.summarise(&model, Gate::Hard { threshold }, weights);
    let start = if problem.distance(&model, near).is_finite() { &model } else { near };
    let Some(refitted) = problem.fit(&summary, start) else {
        return FitReport::failed(Stop::NoModel { trials }, trials);
    };
    FitReport {
        rms: problem.rms(&summary, &refitted),
        model: Some(refitted),
        inliers: P::count(&summary),
        iterations: trials,
        stop,
    }
}
