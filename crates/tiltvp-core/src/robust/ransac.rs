//! The one random-sampling loop (Fischler and Bolles 1981), as paper 000 section 2.1.4 uses it.

use super::loss::Gate;
use super::problem::Problem;
use super::report::{FitReport, Stop};
use super::sampler::Sampler;
use crate::error::{Error, Result};

/// Largest sample that a problem may ask for.
const MAX_SAMPLE: usize = 8;

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
}

impl RansacOptions {
    /// The paper's limits with a threshold of one's own.
    pub fn with_threshold(threshold: f64) -> Self {
        Self { threshold, max_trials: 1000, confidence: 0.9999, seed: 0 }
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
        Ok(())
    }
}

/// Draws minimal samples, keeps the model with the largest consensus, and refits it to its consensus set.
///
/// Sampling stops once `1 - (1 - P)^n > confidence`, with `P` the probability that one sample is drawn from the largest
/// consensus set so far (without replacement), or at the limit. `weights` (one per observation, above zero) are those of
/// the final fit; on return they are zero outside the consensus set.
pub fn ransac<P: Problem>(
    problem: &P,
    options: &RansacOptions,
    near: &P::Model,
    weights: &mut [f32],
) -> FitReport<P::Model> {
    const { assert!(P::SAMPLE_SIZE <= MAX_SAMPLE) };
    let len = problem.len();
    if len < P::SAMPLE_SIZE {
        return FitReport::failed(Stop::TooFew { have: len, need: P::SAMPLE_SIZE }, 0);
    }
    let mut sampler = Sampler::new(options.seed, len);
    let mut sample = [0; MAX_SAMPLE];
    let sample = &mut sample[..P::SAMPLE_SIZE];
    let mut best: Option<(usize, P::Model)> = None;
    let mut needed = options.max_trials;
    let mut trials = 0;
    while trials < needed.min(options.max_trials) {
        trials += 1;
        sampler.draw(sample);
        let Some(model) = problem.fit_minimal(sample) else { continue };
        let most = best.as_ref().map_or(0, |(most, _)| *most);
        let count = problem.consensus(&model, options.threshold, most);
        if best.is_none() || count > most {
            needed = trials_needed(count, len, P::SAMPLE_SIZE, options.confidence).max(1);
            best = Some((count, model));
        }
    }
    let Some((_, model)) = best else {
        return FitReport::failed(Stop::NoModel { trials }, trials);
    };
    let stop = if needed <= trials {
        Stop::Confident { trials, needed }
    } else {
        Stop::TrialLimit { limit: options.max_trials }
    };
    let summary = problem.summarise(&model, Gate::Hard { threshold: options.threshold }, weights);
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

/// Smallest `n` with `1 - (1 - P)^n > confidence`, where `P` is the exact probability of an all-inlier sample.
fn trials_needed(inliers: usize, len: usize, sample_size: usize, confidence: f64) -> u32 {
    let all_inliers: f64 = (0..sample_size).map(|i| inliers.saturating_sub(i) as f64 / (len - i) as f64).product();
    if all_inliers >= 1.0 {
        return 1;
    }
    let needed = (1.0 - confidence).ln() / (-all_inliers).ln_1p();
    if needed.is_finite() { (needed.floor() + 1.0).min(f64::from(u32::MAX)) as u32 } else { u32::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_follow_the_exact_product_without_replacement() {
        // Half of four observations: P = 2/4 * 1/3 = 1/6, not 1/4.
        let exact = (1e-4f64.ln() / (5.0f64 / 6.0).ln()).floor() as u32 + 1;
        assert_eq!(trials_needed(2, 4, 2, 0.9999), exact);
        assert_eq!(trials_needed(4, 4, 2, 0.9999), 1);
        assert_eq!(trials_needed(1, 4, 2, 0.9999), u32::MAX);
    }
}
