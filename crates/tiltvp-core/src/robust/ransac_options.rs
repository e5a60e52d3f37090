//! Options of the random-sampling loop.

use super::sampling::Sampling;
use crate::error::{Error, Result};

/// Options of [`ransac`](super::ransac).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RansacOptions {
    /// Largest residual of an inlier, in the problem's unit.
    pub threshold: f64,
    /// Most samples drawn, `N_R` of Fleer 2017. Default 1000.
    pub max_trials: u32,
    /// Probability of having drawn an all-inlier sample at which sampling stops, `q_min` of Fleer 2017. Default 0.9999.
    pub confidence: f64,
    /// Seed of the generator. Default 0.
    pub seed: u64,
    /// How samples are drawn, improved and scored. Default plain RANSAC.
    pub sampling: Sampling,
}

impl RansacOptions {
    /// The limits of Fleer 2017 with a threshold of one's own.
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
