//! The alarm of a mount that was bumped: innovations over a window of steps that are too large for what is believed.

use std::collections::VecDeque;

use super::recursive::Outcome;
use crate::filter::chi_square_quantile;

/// Steps with bearings that the test looks back on.
const WINDOW: usize = 12;

/// Probability with which a window of a filter that is right passes.
const PROBABILITY: f64 = 1.0 - 1e-6;

/// How much larger than expected the innovations of noise that is not quite as assumed may be.
const EXCESS: f64 = 2.0;

/// The innovations of the last steps.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Alarm {
    /// (normalised innovations squared, rejected ones counting as the gate's limit; how many).
    steps: VecDeque<(f64, u32)>,
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
        self.steps.push_back((outcome.nis + limit * outcome.rejected as f64, count as u32));
        let (sum, dof) = self.sums();
        let beyond = self.steps.len() == WINDOW && sum > EXCESS * f64::from(dof);
        self.raised |= beyond && sum > chi_square_quantile(PROBABILITY, dof);
    }

    fn sums(&self) -> (f64, u32) {
        self.steps.iter().fold((0.0, 0), |(sum, dof), (nis, count)| (sum + nis, dof + count))
    }

    /// The mean normalised innovation squared of the window, 1 for a filter that is right; `None` before the first.
    pub(super) fn mean_nis(&self) -> Option<f64> {
        let (sum, dof) = self.sums();
        (dof > 0).then(|| sum / f64::from(dof))
    }

    /// Whether a window was ever too large.
    pub(super) fn raised(&self) -> bool {
        self.raised
    }
}
