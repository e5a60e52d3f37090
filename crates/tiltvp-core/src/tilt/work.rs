//! What the fits of one thread work in.

use tiltvp_kernels::compaction::ROOM;

use super::methods::sampling::SamplingScratch;
use super::methods::subsample::Subsample;
use super::trust::FEATURES;
use crate::robust::Rows;

/// What the fits work in.
#[derive(Debug, Clone)]
pub(super) struct Work {
    pub rows: Rows<f32>,
    pub weights: Vec<f32>,
    /// Pixel of each row within the region.
    pub slots: Vec<u32>,
    /// Place of each row among the edge pixels.
    pub places: Vec<u32>,
    pub inliers: Inliers,
    /// Of the refined method.
    pub subsample: Subsample<f32>,
    /// Of the sampling methods.
    pub sampling: SamplingScratch,
    /// What told whether the last fit was of the vertical.
    pub trusted: [f64; FEATURES],
}

/// What tells the inliers of the last image.
#[derive(Debug, Clone, Copy)]
pub(super) enum Inliers {
    /// There was no fit.
    None,
    /// The rows with a weight above zero.
    Weighted,
    /// The rows with a residual of at most the threshold.
    Within { model: [f64; 3], threshold: f64 },
}

impl Inliers {
    pub(super) fn weighted_if(found: bool) -> Self {
        if found { Self::Weighted } else { Self::None }
    }
}

impl Work {
    /// Room for so many rows.
    pub(super) fn with_capacity(n: usize) -> Self {
        Self {
            rows: Rows::with_capacity(n + ROOM),
            weights: Vec::with_capacity(n + ROOM),
            slots: Vec::with_capacity(n + ROOM),
            places: Vec::with_capacity(n + ROOM),
            inliers: Inliers::None,
            subsample: Subsample::with_capacity(n),
            sampling: SamplingScratch::default(),
            trusted: [0.0; FEATURES],
        }
    }

    /// Whether a row agreed with the last estimate.
    pub(super) fn is_inlier(&self, row: usize) -> bool {
        match self.inliers {
            Inliers::None => false,
            Inliers::Weighted => self.weights.get(row).is_some_and(|weight| *weight > 0.0),
            Inliers::Within { model, threshold } => self.rows.is_within(row, model, threshold),
        }
    }
}
