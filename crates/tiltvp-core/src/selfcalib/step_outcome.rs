//! What an estimator did in a step, as both methods report it.

/// What an estimator did in a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct StepOutcome {
    /// Normalised innovation squared of the bearings that were fused.
    pub(crate) nis: f64,
    pub(crate) used: usize,
    pub(crate) rejected: usize,
    pub(crate) started: usize,
    /// Whether most bearings were rejected, so that the wheels were taken to have slipped.
    pub(crate) slipped: bool,
    /// Normalised innovation squared of bearings that contradict one another so much that none was fused; 0 otherwise.
    pub(crate) contradiction: f64,
}
