//! The memory that one thread works in, grown once.

use tiltvp_kernels::compaction::ROOM;

use super::methods::{SamplingScratch, SegmentWork, Subsample};
use super::trust::FEATURES;
use crate::edges::{Detector, EdgeOptions, EdgePixels, Region};
use crate::robust::Rows;

/// The memory that one thread works in; estimates after the first allocate nothing.
///
/// It serves all estimators that look at the same pixels: those made from one another by
/// [`with_options`](super::TiltEstimator::with_options) without another band, margin, smoothing or mask.
#[derive(Debug, Clone)]
pub struct Scratch {
    pub(super) detector: Detector,
    /// What the memory and the detector were made for.
    made_for: Extent,
    pub(super) edges: EdgePixels,
    pub(super) work: Work,
    /// Of the method of straight edges, once it has been used.
    pub(super) segments: Option<Box<SegmentWork>>,
}

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

/// What an estimator's scratch depends on.
#[derive(Debug, Clone, PartialEq)]
struct Extent {
    pixels: usize,
    columns: std::ops::Range<usize>,
    smoothing_px: f64,
    first: (u16, u16),
    last: (u16, u16),
}

impl Extent {
    fn new(region: &Region, options: &EdgeOptions) -> Self {
        let (pixels, last) = (region.len(), region.len().saturating_sub(1));
        let (first, last) = (region.place(0), region.place(last));
        Self { pixels, columns: region.columns(), smoothing_px: options.smoothing_px, first, last }
    }
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

impl Scratch {
    /// Room for an image in which every pixel of the region is an edge.
    pub(super) fn new(region: &Region, options: &EdgeOptions) -> Self {
        let n = region.len();
        Self {
            detector: Detector::new(region, options),
            made_for: Extent::new(region, options),
            edges: EdgePixels::with_capacity(n),
            work: Work {
                rows: Rows::with_capacity(n + ROOM),
                weights: Vec::with_capacity(n + ROOM),
                slots: Vec::with_capacity(n + ROOM),
                places: Vec::with_capacity(n + ROOM),
                inliers: Inliers::None,
                subsample: Subsample::with_capacity(n),
                sampling: SamplingScratch::default(),
                trusted: [0.0; FEATURES],
            },
            segments: None,
        }
    }

    /// Whether it is of the right size for a region.
    pub(super) fn serves(&self, region: &Region, options: &EdgeOptions) -> bool {
        self.made_for == Extent::new(region, options)
    }
}

impl Work {
    /// Whether a row agreed with the last estimate.
    pub(super) fn is_inlier(&self, row: usize) -> bool {
        match self.inliers {
            Inliers::None => false,
            Inliers::Weighted => self.weights.get(row).is_some_and(|weight| *weight > 0.0),
            Inliers::Within { model, threshold } => self.rows.is_within(row, model, threshold),
        }
    }
}
