//! Options of the straight edges.

use std::f64::consts::FRAC_PI_2;

use crate::edges::{EdgeOptions, Mask};
use crate::options;

options! {
    /// What a straight edge is.
    #[derive(Copy)]
    pub struct SegmentOptions {
        /// Gradient magnitude from which a chain may start, for the Scharr kernel on 8-bit grey levels; it goes on down to
        /// `gradient_min`.
        gradient_start: f64 = 128.0
            => 0.0..=1e6, "a gradient magnitude from 0 to 1e6";
        /// How far in pixels a chain may stray from the great circle through its ends before it is cut.
        stray_max_px: f64 = 0.8 => 0.05..=100.0, "a distance from 0.05 to 100 pixels";
        /// Greatest root mean square distance of the pixels of a segment from its great circle, in pixels.
        rms_max_px: f64 = 0.7 => 0.01..=100.0, "a distance from 0.01 to 100 pixels";
        /// Least number of pixels of a segment.
        support_min_px: u32 = 12 => 4.0..=1e6, "a whole number from 4 to 1000000";
        /// Widest gap between two pieces of one great circle that are joined, in lengths of the longer one; 0 joins none.
        gap_max: f64 = 1.0 => 0.0..=100.0, "a number of lengths from 0 to 100";
    }
}

options! {
    /// Options of a detector of straight edges.
    pub struct SegmentDetectorOptions {
        /// Which pixels are looked at: by default all of the image, down to weak gradients, after smoothing by 0.7 pixels.
        [flat except "elevation_min_rad" "elevation_max_rad"] edges: EdgeOptions = EdgeOptions {
            gradient_min: 64.0,
            smoothing_px: 0.7,
            elevation_min_rad: -FRAC_PI_2,
            elevation_max_rad: FRAC_PI_2,
            margin_px: 2.0,
        };
        /// Pixels that show the world; none for all.
        mask: Option<Mask> = None;
        /// What a straight edge is.
        [flat] segments: SegmentOptions = SegmentOptions::default();
    }
}
