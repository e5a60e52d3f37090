//! A cosine fitted to the edge offsets by random sampling (Fleer 2017, section 2.1).

use std::sync::Arc;

use super::image_space::{ImageSpace, ImageSpaceOptions};
use super::method::{Fitter, Prepared, Setting, TiltMethod};
use super::offsets::Offsets;
use crate::edges::{EdgeOptions, EdgePixels, Prefilter};
use crate::error::Result;
use crate::options;
use crate::options::POSITIVE;
use crate::robust::{RansacOptions, Sampling, ransac};
use crate::tilt::fit::Fit;
use crate::tilt::tables::PixelTables;
use crate::tilt::trust::{Logit, Trust};
use crate::tilt::work::Work;

options! {
    /// Options of the image-space method by random sampling; defaults are those of Fleer 2017, table 3.
    pub struct ImageSpaceRansacOptions {
        /// Largest residual of an inlier in pixels, `delta_s,max` of eq. 32.
        threshold_px: f64 = 10.0 => POSITIVE, "a positive number of pixels";
        /// Which offsets take part, and what their shift means.
        [flat] space: ImageSpaceOptions = ImageSpaceOptions::default();
        /// How samples are drawn, improved and scored.
        [flat] sampling: Sampling = Sampling::default();
    }
}

/// How a fit tells whether it is of the vertical: `tiltvp measure trust --weights` prints it.
static TRUST: Trust = Trust {
    vertical: Logit { constant: 13.21, weights: [-2.814, 3.473, 5.022, -0.8808, -0.3197, -0.015_63, -0.025_72, 0.0] },
    up: None,
};

impl TiltMethod for ImageSpaceRansacOptions {
    fn edges(&self) -> EdgeOptions {
        EdgeOptions { gradient_min: 150.0, ..EdgeOptions::default() }
    }

    fn prepare(&self, setting: &Setting<'_>) -> Result<Prepared> {
        Ok(Prepared::Pixels(Arc::new(ImageSpaceRansac {
            space: ImageSpace::new(setting, &self.space)?,
            ransac: RansacOptions {
                seed: setting.seed,
                sampling: self.sampling,
                ..RansacOptions::with_threshold(self.threshold_px)
            },
        })))
    }
}

/// The method ready for images.
#[derive(Debug)]
struct ImageSpaceRansac {
    space: ImageSpace,
    ransac: RansacOptions,
}

impl Fitter for ImageSpaceRansac {
    fn prefilter(&self) -> Option<&Prefilter> {
        Some(self.space.prefilter())
    }

    fn trust(&self) -> Option<&'static Trust> {
        Some(&TRUST)
    }

    fn fit(&self, edges: &EdgePixels, pixels: &PixelTables, work: &mut Work) -> Fit {
        self.space.rows(edges, work);
        let Work { rows, weights, places, sampling, .. } = &mut *work;
        sampling.prepare(&self.ransac.sampling, edges, places, weights.capacity());
        let problem = Offsets::new(rows, &sampling.quality);
        let report = ransac(&problem, &self.ransac, weights, &mut sampling.ransac);
        self.space.conclude(&report, pixels, work)
    }
}
