//! A cosine fitted to the edge offsets by repeated trimming (Fleer 2017, section 2.1).

use std::sync::Arc;

use nalgebra::Vector2;

use super::image_space::{ImageSpace, ImageSpaceOptions};
use super::method::{Fitter, Prepared, Setting, TiltMethod};
use super::offsets::Offsets;
use crate::edges::{EdgeOptions, EdgePixels, Prefilter};
use crate::error::Result;
use crate::options;
use crate::options::Between;
use crate::robust::{RejectRefitOptions, reject_refit};
use crate::tilt::fit::Fit;
use crate::tilt::tables::PixelTables;
use crate::tilt::trust::{Logit, Trust};
use crate::tilt::work::Work;

options! {
    /// Options of the image-space method by repeated trimming; defaults are those of Fleer 2017, table 3.
    pub struct ImageSpaceRejectRefitOptions {
        /// Share of normal residuals kept each round; eq. 34 with `Q` read as the share kept.
        keep_fraction: f64 = 0.8 => Between(0.0, 1.0), "a share strictly between 0 and 1";
        /// Most rounds of rejecting and refitting, `N_E`; 0 is plain least squares.
        max_iterations: u32 = 15;
        /// Which offsets take part, and what their shift means.
        [flat] space: ImageSpaceOptions = ImageSpaceOptions::default();
    }
}

/// Change of the shift in pixels below which trimming has converged (Fleer 2017, section 2.1.4).
const SHIFT_TOLERANCE_PX: f64 = 0.1;

/// How a fit tells whether it is of the vertical: `tiltvp measure trust --weights` prints it.
static TRUST: Trust = Trust {
    vertical: Logit { constant: 12.07, weights: [-3.386, 1.413, 0.3265, 2.693, 0.2243, -0.007_856, -0.3203, 0.0] },
    up: None,
};

impl TiltMethod for ImageSpaceRejectRefitOptions {
    fn edges(&self) -> EdgeOptions {
        EdgeOptions { gradient_min: 200.0, ..EdgeOptions::default() }
    }

    fn prepare(&self, setting: &Setting<'_>) -> Result<Prepared> {
        Ok(Prepared::Pixels(Arc::new(ImageSpaceRejectRefit {
            space: ImageSpace::new(setting, &self.space)?,
            trimming: RejectRefitOptions {
                keep_fraction: self.keep_fraction,
                max_iterations: self.max_iterations,
                tolerance: SHIFT_TOLERANCE_PX,
                rms_min: 0.0,
            },
        })))
    }
}

/// The method ready for images.
#[derive(Debug)]
struct ImageSpaceRejectRefit {
    space: ImageSpace,
    trimming: RejectRefitOptions,
}

impl Fitter for ImageSpaceRejectRefit {
    fn prefilter(&self) -> Option<&Prefilter> {
        Some(self.space.prefilter())
    }

    fn trust(&self) -> Option<&'static Trust> {
        Some(&TRUST)
    }

    fn fit(&self, edges: &EdgePixels, pixels: &PixelTables, work: &mut Work) -> Fit {
        self.space.rows(edges, work);
        let Work { rows, weights, .. } = &mut *work;
        let report = reject_refit(&Offsets::new(rows, &[]), &self.trimming, &Vector2::zeros(), weights);
        self.space.conclude(&report, pixels, work)
    }
}
