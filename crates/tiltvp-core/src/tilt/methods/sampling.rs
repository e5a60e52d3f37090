//! What the sampling methods share: the memory of the sampling loop, and the order of promising edge pixels.

use crate::edges::EdgePixels;
use crate::robust::{RansacScratch, SampleOrder, Sampling};

/// Pixels of one edge repeat one another: one in two to the power of this, scattered over the image, comes before the rest.
/// `just measure-sampling` shows what samples in this order are worth.
const SPREAD_BITS: u32 = 4;

/// A factor that puts a row behind all others: squared gradients of 8-bit images are at most `2 (16 * 255)^2 = 3.3e7`, and those
/// of whole grey levels at least 1.
const LATER: f32 = 1e-18;

/// The golden ratio as a fraction of 2^32: products with successive numbers are spread evenly (Knuth 1973, section 6.4).
const GOLDEN: u32 = 0x9e37_79b1;

/// The memory of random sampling, grown once.
#[derive(Debug, Clone, Default)]
pub(in crate::tilt) struct SamplingScratch {
    /// How promising each row is, where samples are drawn in that order.
    pub(super) quality: Vec<f32>,
    pub(super) ransac: RansacScratch,
}

impl SamplingScratch {
    /// Makes room for up to `capacity` rows, and rates the rows by their squared gradients if samples are drawn in that order.
    /// `places` are those of the rows among the edge pixels.
    pub(super) fn prepare(&mut self, sampling: &Sampling, edges: &EdgePixels, places: &[u32], capacity: usize) {
        self.quality.clear();
        self.ransac.reserve(sampling, capacity);
        if sampling.order == SampleOrder::Uniform {
            return;
        }
        self.quality.reserve(capacity);
        let (slots, gx, gy) = (edges.slot(), edges.gx(), edges.gy());
        let quality = |place: &u32| {
            let place = *place as usize;
            let first = slots[place].wrapping_mul(GOLDEN) >> (32 - SPREAD_BITS) == 0;
            (gx[place].powi(2) + gy[place].powi(2)) * if first { 1.0 } else { LATER }
        };
        self.quality.extend(places.iter().map(quality));
    }
}
