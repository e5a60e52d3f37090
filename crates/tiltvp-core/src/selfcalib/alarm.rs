//! The alarm of a mount that was bumped: innovations over a window of steps that are too large for what is believed.

use std::collections::VecDeque;

use super::outcome::Outcome;
use crate::filter::chi_square_quantile;

/// Steps with bearings that the test looks back on.
const WINDOW: usize = 12;

/// Probability with which a window of a filter that is right passes.
const PROBABILITY: f64 = 1.0 - 1e-6;

/// How much larger than expected the innovations of noise that is not quite as assumed may be.
const EXCESS: f64 = 2.0;

/// How much larger than expected innovations may be where all is well.
const UNEASY: f64 = 1.5;

/// Share of bearings that may be rejected where all is well.
const REJECTED: f64 = 0.02;

/// Share of bearings that may be of something else, as no tracker is without: so many that the gate rejected count nothing.
const STRAY: f64 = 0.1;

/// The innovations of the last steps.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Alarm {
    /// Normalised innovations squared of the bearings that were used, how many, and how many were rejected.
    steps: VecDeque<(f64, usize, usize)>,
    raised: bool,
}

impl Alarm {
    pub(super) fn note(&mut self, outcome: &Outcome, limit: f64) {
        let count = outcome.used + outcome.rejected;
        if count == 0 {
            return;
        }
        if self.steps.len() == WINDOW {
            self.steps.pop_front();
        }
        self.steps.push_back((outcome.nis, outcome.used, outcome.rejected));
        let (sum, used, rejected) = self.sums();
        // Rejected ones beyond the share count as the gate's limit.
        let beyond = (rejected as f64 - STRAY * (used + rejected) as f64).max(0.0).round();
        let (sum, dof) = (sum + limit * beyond, used as f64 + beyond);
        let large = self.steps.len() == WINDOW && sum > EXCESS * dof;
        self.raised |= large && sum > chi_square_quantile(PROBABILITY, dof as u32);
    }

    fn sums(&self) -> (f64, usize, usize) {
        self.steps
            .iter()
            .fold((0.0, 0, 0), |(sum, used, rejected), (nis, more, less)| (sum + nis, used + more, rejected + less))
    }

    /// The mean normalised innovation squared of the window, 1 for a filter that is right; `None` before the first.
    pub(super) fn mean_nis(&self) -> Option<f64> {
        let (sum, used, _) = self.sums();
        (used > 0).then(|| sum / used as f64)
    }

    /// Whether a window was ever too large, or innovations are larger now than they should be, or too many were rejected.
    pub(super) fn uneasy(&self) -> bool {
        let (sum, used, rejected) = self.sums();
        self.raised || sum > UNEASY * used as f64 || rejected as f64 > REJECTED * (used + rejected) as f64
    }

    /// Whether a window was ever too large.
    pub(super) fn raised(&self) -> bool {
        self.raised
    }
}
