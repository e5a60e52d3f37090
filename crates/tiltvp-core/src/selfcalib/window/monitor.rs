//! The innovations of the last steps: whether the filter is consistent, and the alarm of a mount that was bumped.

use std::collections::VecDeque;

use super::tuning::{
    ALARM_EXCESS, ALARM_PROBABILITY, ALARM_REJECTED_SHARE, INCONSISTENT_EXCESS, INCONSISTENT_REJECTED_SHARE,
    MONITOR_STEPS,
};
use crate::filter::chi_square_quantile;
use crate::selfcalib::step_outcome::StepOutcome;

/// The innovations of the last steps with bearings.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct InnovationMonitor {
    /// Normalised innovation squared of the bearings used, their number, and the number of rejected ones.
    steps: VecDeque<(f64, usize, usize)>,
    alarmed: bool,
}

impl InnovationMonitor {
    /// Adds a step; `gate` is the limit of the normalised innovation squared of one bearing.
    pub(crate) fn record(&mut self, outcome: &StepOutcome, gate: f64) {
        let count = outcome.used + outcome.rejected;
        if count == 0 {
            return;
        }
        if self.steps.len() == MONITOR_STEPS {
            self.steps.pop_front();
        }
        self.steps.push_back((outcome.nis, outcome.used, outcome.rejected));
        let (sum, used, rejected) = self.sums();
        // Rejected bearings beyond the share that any tracker has count as the limit of the gate.
        let beyond = (rejected as f64 - ALARM_REJECTED_SHARE * (used + rejected) as f64).max(0.0).round();
        let (sum, dof) = (sum + gate * beyond, used as f64 + beyond);
        let large = self.steps.len() == MONITOR_STEPS && sum > ALARM_EXCESS * dof;
        self.alarmed |= large && sum > chi_square_quantile(ALARM_PROBABILITY, dof as u32);
    }

    fn sums(&self) -> (f64, usize, usize) {
        self.steps
            .iter()
            .fold((0.0, 0, 0), |(sum, used, rejected), (nis, more, less)| (sum + nis, used + more, rejected + less))
    }

    /// The mean normalised innovation squared of the last steps, 1 for a consistent filter; `None` before the first.
    pub(crate) fn mean_nis(&self) -> Option<f64> {
        let (sum, used, _) = self.sums();
        (used > 0).then(|| sum / used as f64)
    }

    /// Whether there was an alarm, or innovations are too large now, or too many bearings were rejected.
    pub(super) fn is_inconsistent(&self) -> bool {
        let (sum, used, rejected) = self.sums();
        self.alarmed
            || sum > INCONSISTENT_EXCESS * used as f64
            || rejected as f64 > INCONSISTENT_REJECTED_SHARE * (used + rejected) as f64
    }

    /// Whether the innovations of the last steps were ever too large.
    pub(crate) fn alarmed(&self) -> bool {
        self.alarmed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After so many steps of a hundred bearings with innovations as they should be, of which so many are rejected.
    fn after(steps: usize, rejected: usize) -> InnovationMonitor {
        let used = 100 - rejected;
        let outcome = StepOutcome { nis: used as f64, used, rejected, ..StepOutcome::default() };
        let mut monitor = InnovationMonitor::default();
        (0..steps).for_each(|_| monitor.record(&outcome, 15.0));
        monitor
    }

    #[test]
    fn rejected_bearings_alarm_beyond_the_share_that_any_tracker_has_once_there_are_enough_steps() {
        assert!(!after(2 * MONITOR_STEPS, 10).alarmed());
        assert!(!after(MONITOR_STEPS - 1, 40).alarmed());
        assert!(after(MONITOR_STEPS, 40).alarmed());
    }
}
