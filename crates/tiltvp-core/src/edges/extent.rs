//! What tells the memory for one region's images from that for another's.

use std::ops::Range;

use super::options::EdgeOptions;
use super::region::Region;

/// What the memory for a region's images depends on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Extent {
    pixels: usize,
    columns: Range<usize>,
    smoothing_px: f64,
    first: (u16, u16),
    last: (u16, u16),
}

impl Extent {
    pub(crate) fn new(region: &Region, options: &EdgeOptions) -> Self {
        let (pixels, last) = (region.len(), region.len().saturating_sub(1));
        let (first, last) = (region.place(0), region.place(last));
        Self { pixels, columns: region.columns(), smoothing_px: options.smoothing_px, first, last }
    }
}
