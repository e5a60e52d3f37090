//! How a robust fit went, and why it stopped.

use std::fmt;

/// Why a fit stopped, with the measured number and the limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// Random sampling has drawn as many samples as its confidence needs.
    Confident {
        /// Samples drawn.
        trials: u32,
        /// Samples that the final share of inliers asks for.
        needed: u32,
    },
    /// Random sampling has drawn all the samples it may.
    TrialLimit {
        /// The limit.
        limit: u32,
    },
    /// The model has stopped changing.
    Converged {
        /// Refits done.
        iterations: u32,
        /// The last change, in the problem's unit of distance.
        change: f64,
        /// The change below which it counts as converged.
        tolerance: f64,
    },
    /// The residuals are small enough that nothing more needs to be rejected.
    Settled {
        /// Root mean square residual, in the problem's unit.
        rms: f64,
        /// The root mean square residual asked for.
        limit: f64,
    },
    /// Refitting has been repeated as often as it may.
    IterationLimit {
        /// The limit.
        limit: u32,
        /// The last change, in the problem's unit of distance.
        change: f64,
    },
    /// There are fewer observations than a model needs.
    TooFew {
        /// Observations there are.
        have: usize,
        /// Observations needed.
        need: usize,
    },
    /// The model found is an angle that the method cannot mean.
    OutOfReach {
        /// The angle found, in radians.
        angle_rad: f64,
        /// The angle within which an answer means something, in radians.
        limit_rad: f64,
    },
    /// The most probable of several models that observations agree with.
    Chosen {
        /// Its probability.
        probability: f64,
        /// How many there are.
        of: usize,
    },
    /// Of several models that observations agree with, none is probable enough.
    Ambiguous {
        /// Probability of the best.
        probability: f64,
        /// The probability asked for.
        limit: f64,
        /// How many there are.
        of: usize,
    },
    /// The observations that agree do not tell how far the model may be off.
    Undetermined {
        /// How many agree.
        agreeing: usize,
    },
    /// The observations do not determine a model (they are all alike).
    NoModel {
        /// Samples or refits tried.
        trials: u32,
    },
}

impl Stop {
    /// Whether the fit has no model to offer.
    pub fn is_failure(self) -> bool {
        matches!(
            self,
            Self::TooFew { .. }
                | Self::NoModel { .. }
                | Self::OutOfReach { .. }
                | Self::Ambiguous { .. }
                | Self::Undetermined { .. }
        )
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Confident { trials, needed } => write!(f, "confident after {trials} trials ({needed} needed)"),
            Self::TrialLimit { limit } => write!(f, "limit of {limit} trials reached"),
            Self::Converged { iterations, change, tolerance } => {
                write!(f, "converged after {iterations} iterations (change {change:.2e}, tolerance {tolerance:.2e})")
            }
            Self::Settled { rms, limit } => write!(f, "residuals settled at {rms:.2e} (limit {limit:.2e})"),
            Self::IterationLimit { limit, change } => {
                write!(f, "limit of {limit} iterations reached (last change {change:.2e})")
            }
            Self::TooFew { have, need } => write!(f, "too few observations: {have}, at least {need} needed"),
            Self::OutOfReach { angle_rad, limit_rad } => {
                let (angle, limit) = (angle_rad.to_degrees(), limit_rad.to_degrees());
                write!(f, "an angle of {angle:.1} degrees was found, beyond the limit of {limit:.1} degrees")
            }
            Self::Chosen { probability, of } => {
                write!(f, "the most probable of {of} directions (probability {probability:.2})")
            }
            Self::Ambiguous { probability, limit, of } => {
                write!(f, "which of {of} directions is up is not told: probability {probability:.2}, {limit:.2} needed")
            }
            Self::Undetermined { agreeing } => {
                write!(f, "the {agreeing} observations that agree do not tell how far it may be off")
            }
            Self::NoModel { trials } => write!(f, "no model: the observations are degenerate ({trials} tried)"),
        }
    }
}

/// The outcome of a robust fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitReport<M> {
    /// The model, `None` exactly if [`Stop::is_failure`].
    pub model: Option<M>,
    /// Observations that the model was last fitted to.
    pub inliers: usize,
    /// Root mean square residual over them, in the problem's unit; NaN without a model.
    pub rms: f64,
    /// Random samples drawn or refits done.
    pub iterations: u32,
    /// Why it stopped.
    pub stop: Stop,
}

impl<M> FitReport<M> {
    /// A failure, with its reason.
    pub(super) fn failed(stop: Stop, iterations: u32) -> Self {
        Self { model: None, inliers: 0, rms: f64::NAN, iterations, stop }
    }
}
