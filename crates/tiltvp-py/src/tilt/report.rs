//! `FitReport`: how a robust fit went and why it stopped, as a frozen Python value.

use tiltvp_core::robust::Stop;

use crate::field::StopWord;
use crate::value::value;

value! {
    /// How a robust fit went, and why it stopped. Frozen, comparable, hashable, and to be pickled.
    FitReport as own {
        /// Why the fit stopped, in a word.
        ///
        /// "confident": random sampling has drawn as many samples as its confidence needs; "trial-limit": it has drawn all
        /// it may. "converged": the model has stopped changing; "settled": the residuals are small enough;
        /// "iteration-limit": refitting has been repeated as often as it may. "chosen": it is the most probable of several
        /// alternatives; "ambiguous": of several none is probable enough. No answer comes of "too-few" observations,
        /// "no-model" (they are all alike), "undetermined" (they do not tell how far it may be off) and "out-of-reach" (an angle
        /// that the method cannot mean).
        stop: StopWord,
        /// The same in a sentence, with the measured number and the limit; after it what keeps an estimate from being sure.
        reason: String,
        /// Random samples drawn or refits done.
        iterations: u32,
        /// Root mean square residual: radians, or pixels of the image-space methods; NaN without a model.
        residual_rms: f64,
    }
}

impl FitReport {
    pub(super) fn new(stop: Stop, iterations: u32, residual_rms: f64) -> Self {
        let word = match stop {
            Stop::Confident { .. } => "confident",
            Stop::TrialLimit { .. } => "trial-limit",
            Stop::Converged { .. } => "converged",
            Stop::Settled { .. } => "settled",
            Stop::IterationLimit { .. } => "iteration-limit",
            Stop::TooFew { .. } => "too-few",
            Stop::NoModel { .. } => "no-model",
            Stop::OutOfReach { .. } => "out-of-reach",
            Stop::Chosen { .. } => "chosen",
            Stop::Ambiguous { .. } => "ambiguous",
            Stop::Undetermined { .. } => "undetermined",
        };
        Self { stop: StopWord(word.to_owned()), reason: stop.to_string(), iterations, residual_rms }
    }
}
