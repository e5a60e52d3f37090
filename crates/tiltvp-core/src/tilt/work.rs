//! What the fits of one thread work in.

use nalgebra::Vector3;
use tiltvp_kernels::compaction::ROOM;

use super::methods::sampling::SamplingScratch;
use super::methods::subsample::Subsample;
use super::overhead::OverheadLines;
use super::trust::FEATURES;
use crate::edges::StepMap;
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
    /// Lines overhead, for the methods that leave them out.
    pub overhead: OverheadLines,
    /// Steps of the pixel grid among the rows.
    pub steps: StepMap,
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
    /// Room for so many rows, of images of so many columns and rows.
    pub(super) fn with_capacity(n: usize, size: [usize; 2]) -> Self {
        Self {
            rows: Rows::with_capacity(n + ROOM),
            weights: Vec::with_capacity(n + ROOM),
            slots: Vec::with_capacity(n + ROOM),
            places: Vec::with_capacity(n + ROOM),
            inliers: Inliers::None,
            overhead: OverheadLines::default(),
            steps: StepMap::new(size),
            subsample: Subsample::with_capacity(n),
            sampling: SamplingScratch::default(),
            trusted: [0.0; FEATURES],
        }
    }

    /// Keeps the rows alone that pass a test of themselves, their pixel within the region and their place among the edge pixels.
    pub(super) fn keep(&mut self, test: impl Fn(&Vector3<f64>, u32, u32) -> bool) {
        let mut kept = 0;
        for row in 0..self.rows.len() {
            let observed = self.rows.get(row).unwrap_or_default();
            if test(&observed, self.slots[row], self.places[row]) {
                self.rows.put(row, kept);
                self.weights[kept] = self.weights[row];
                (self.slots[kept], self.places[kept]) = (self.slots[row], self.places[row]);
                kept += 1;
            }
        }
        self.rows.truncate(kept);
        self.weights.truncate(kept);
        self.slots.truncate(kept);
        self.places.truncate(kept);
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
