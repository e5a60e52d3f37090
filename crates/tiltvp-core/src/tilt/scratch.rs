//! The memory that one thread works in, grown once.

use super::methods::segments::work::SegmentWork;
use super::work::Work;
use crate::edges::{Detector, EdgeOptions, EdgePixels, Extent, Region};

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

impl Scratch {
    /// Room for an image in which every pixel of the region is an edge.
    pub(super) fn new(region: &Region, options: &EdgeOptions) -> Self {
        let n = region.len();
        Self {
            detector: Detector::new(region, options),
            made_for: Extent::new(region, options),
            edges: EdgePixels::with_capacity(n),
            work: Work::with_capacity(n, region.image_size()),
            segments: None,
        }
    }

    /// Whether it is of the right size for a region.
    pub(super) fn serves(&self, region: &Region, options: &EdgeOptions) -> bool {
        self.made_for == Extent::new(region, options)
    }
}
