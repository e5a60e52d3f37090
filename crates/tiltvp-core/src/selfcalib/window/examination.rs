//! The examination of the window: what its solution contradicts, and which assumption is most likely wrong.

use super::state::{MOUNTING, SlidingWindow};
use super::tuning::{COST_TOLERANCE, EXAMINATION_GROWTH, EXAMINATION_STEPS, ITERATIONS};
use crate::selfcalib::diagnosis::{Cause, Contradictions, Suspect};

/// What an examination found, and when the next is due.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Examination {
    pub(crate) contradictions: Contradictions,
    pub(crate) suspect: Option<Suspect>,
    /// Steps with bearings so far, and at which of them the window is examined next.
    steps: usize,
    next: usize,
}

impl Examination {
    /// Whether most of the odometry is contradicted, or bearings scatter more than told, so that solving the window at every
    /// contradiction does not help.
    pub(super) fn hopeless(&self) -> bool {
        let Contradictions { motions, contradicted_motions, .. } = self.contradictions;
        let noisy = self.suspect.is_some_and(|suspect| suspect.cause == Cause::BearingSigma);
        noisy || self.contradictions.most_turns() || 2 * contradicted_motions > motions
    }
}

impl SlidingWindow {
    /// Counts a step with bearings, and examines the window where that is due.
    pub(super) fn examine_if_due(&mut self) {
        self.examination.steps += 1;
        if self.examination.steps >= self.examination.next.max(EXAMINATION_STEPS) {
            self.examine();
            self.examination.next = (self.examination.steps as f64 * EXAMINATION_GROWTH) as usize;
        }
    }

    /// Solves a copy of the window, and asks what it contradicts and what is suspect.
    pub(crate) fn examine(&mut self) {
        let mut now = self.problem.clone();
        if now.keyframes.len() < 3 || now.gauss_newton(ITERATIONS, COST_TOLERANCE, false).is_none() {
            return;
        }
        let counts = now.contradictions();
        let covariance = self.covariance.fixed_view::<3, 3>(MOUNTING, MOUNTING).into();
        self.examination.contradictions = counts;
        self.examination.suspect = now.suspect(&counts, now.noise_factors(), &covariance);
    }

    /// What the last examination found.
    pub(crate) fn examination(&self) -> &Examination {
        &self.examination
    }
}
