//! Options of the tilt estimator; the paper's defaults are those of its table 3.

use std::f64::consts::PI;

use super::methods::{Method, RefineOptions};
use crate::edges::{EdgeOptions, Mask};
use crate::error::Result;
use crate::options;

options! {
    /// Everything that can be chosen about a [`TiltEstimator`](super::TiltEstimator).
    pub struct TiltOptions {
        /// Which pixels are edges.
        [flat] edges: EdgeOptions = EdgeOptions { smoothing_px: 0.6, ..EdgeOptions::default() };
        /// Largest lean expected, in radians: a larger one that is told here and found is doubted. Edges that would need a larger one,
        /// of the refined method by more than `scale_rad`, are rejected first, but none that 10 degrees of the refined method, 12 of
        /// segments and 7 of vector consensus allow, which None stands for; the image-space methods have `offset_max_px` instead,
        /// and this, where given, raises it to the shift of that lean. Above 20 degrees the method segments looks for the vertical
        /// anywhere.
        tilt_max_rad: Option<f64> = None
            => |_: &TiltOptions, x| x > 0.0 && x <= PI,
            "an angle above 0 and at most pi, below pi/2 but for the method segments";
        /// Pixels that show the world and not the robot; none for all.
        mask: Option<Mask> = None;
        /// Only one row in so many is looked at: less time, and less sure an answer.
        row_stride: u32 = 1 => 1.0..=f64::from(u32::MAX), "a number of rows, at least 1";
        /// Seed of the random samples.
        seed: u64 = 0;
        /// The method and what belongs to it alone.
        [flat] method: Method = Method::Refined(RefineOptions::default());
    }
}

impl TiltOptions {
    /// The defaults of a method.
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) with the list of methods if there is none of that name.
    pub fn for_method(name: &str) -> Result<Self> {
        let method = Method::from_name(name)?;
        Ok(Self { edges: method.chosen().edges(), method, ..Self::default() })
    }
}
