//! Options of the method of straight edges.

use crate::options;
use crate::options::Between;
use crate::segments::SegmentOptions;

options! {
    /// Options of the method of straight edges.
    #[derive(Copy)]
    pub struct SegmentsOptions {
        /// What a straight edge is: from 8 pixels on, for at the rim of an upward view doors are no longer.
        [flat] segments: SegmentOptions = SegmentOptions { support_min_px: 8, ..SegmentOptions::default() };
        /// Standard deviation in radians by which the edges of vertical things miss the vertical.
        scatter_rad: f64 = 0.3f64.to_radians() => Between(0.0, 1.0), "an angle strictly between 0 and 1 radian";
        /// The most segments that are weighed, the longest ones.
        segments_max: usize = 160 => 2.0..=1e6, "a whole number from 2 to 1000000";
    }
}

/// Standard deviation in radians of what no image tells, a side: half the median error on every second location of 108 panoramas.
pub(super) const FLOOR_RAD: f64 = 0.1f64.to_radians();
