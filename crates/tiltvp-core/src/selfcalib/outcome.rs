//! What a step of a filter found.

/// What a step found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Outcome {
    /// Normalised innovation squared of the bearings that were fused.
    pub(super) nis: f64,
    pub(super) used: usize,
    pub(super) rejected: usize,
    pub(super) started: usize,
    /// Whether most landmarks were not where they should be, so that the motion was taken to be nearly unknown.
    pub(super) slipped: bool,
    /// Normalised innovation squared of bearings that contradict one another so much that none was fused before the memory was
    /// asked; 0 where they do not.
    pub(super) contradiction: f64,
}
