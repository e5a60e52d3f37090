//! What the image-space methods share: the gain of each pixel, the prefilter, and the tilt of a shift (Fleer 2017, section 2.1).

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};
use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use super::method::Setting;
use super::offsets::offsets;
use crate::edges::{EdgePixels, Prefilter};
use crate::error::{Error, Result};
use crate::geometry::Tilt;
use crate::options;
use crate::options::POSITIVE;
use crate::robust::FitReport;
use crate::tilt::correction::{Correction, Gains, VanishingPoint, closed_form_gains};
use crate::tilt::fit::{Evidence, Fit, Lean, STRAY_RAD};
use crate::tilt::tables::PixelTables;
use crate::tilt::trained::TrainedCorrection;
use crate::tilt::work::{Inliers, Work};

/// `s_max` in pixels of Fleer 2017, table 3.
const PAPER_OFFSET_MAX_PX: f64 = 40.0;

/// Pixels per radian about the vertical of the paper's lens: half a turn on a disc 439 pixels wide (section 2.3), `439 / pi`.
const PAPER_SCALE_PX: f64 = 139.7;

/// Least cosine of the angle between the optical axis and the vertical, 45 degrees: beyond it a lean is no shift of the image
/// even to first order.
const AXIS_COSINE_MIN: f64 = FRAC_1_SQRT_2;

/// The largest edge offset that means as large a lean as the paper's, for a lens of so many pixels per radian about the
/// vertical, to a millionth of a pixel.
fn offset_max_px_of(scale_px: f64) -> f64 {
    (PAPER_OFFSET_MAX_PX * scale_px / PAPER_SCALE_PX * 1e6).round() / 1e6
}

options! {
    /// Which edge offsets the image-space methods take, and how their shift becomes an angle.
    pub struct ImageSpaceOptions {
        /// Largest edge offset in pixels that passes the prefilter, `s_max`; none for 40 pixels of a lens of 139.7 pixels per
        /// radian about the vertical, and in proportion for others.
        offset_max_px: Option<f64> = None => POSITIVE, "a positive number of pixels";
        /// From the shift to the angle: `"closed-form"` by the gain of each pixel, None by the lens' scale at the vanishing
        /// point, a factor in pixels per radian, a line, or a posterior.
        correction: Correction = Correction::ClosedForm
            => POSITIVE, "\"closed-form\", None, a positive factor, an AffineCorrection or a PosteriorCorrection";
    }
    check correction_is_valid
}

fn correction_is_valid(options: &ImageSpaceOptions) -> Result<()> {
    options.correction.validate()
}

/// Edge offsets from the upright vanishing point, and the way from a shift to a tilt.
#[derive(Debug)]
pub(super) struct ImageSpace {
    vertical: VanishingPoint,
    gains: Arc<Gains>,
    correction: TrainedCorrection,
    offset_max_px: f64,
    prefilter: Prefilter,
    evidence: Evidence,
}

impl ImageSpace {
    /// The tables for a correction and a largest offset, where one is given.
    pub(super) fn new(setting: &Setting<'_>, options: &ImageSpaceOptions) -> Result<Self> {
        let ImageSpaceOptions { correction, offset_max_px } = options;
        let vertical = vertical_of(setting)?;
        let (origin, pixels) = (setting.origin, setting.pixels);
        let shared = &pixels.shared.image_space;
        let gains = if *correction == Correction::ClosedForm {
            Arc::clone(shared.gains.get_or_init(|| {
                Arc::new(closed_form_gains(&origin.camera, &origin.robot_from_camera, &pixels.region, vertical))
            }))
        } else {
            Arc::new(Gains { relative: Vec::new(), mean: vertical.scale })
        };
        let correction = match correction {
            Correction::Trained(trained) => trained.clone(),
            Correction::None | Correction::ClosedForm => TrainedCorrection::Factor(gains.mean),
        };
        if let (Some(offset_px), Some(_)) = (offset_max_px, setting.tilt_max_rad) {
            return Err(Error::option("offset_max_px", *offset_px, "none beside tilt_max_rad, which raises its own"));
        }
        let own_max_px = offset_max_px.unwrap_or_else(|| offset_max_px_of(vertical.scale));
        let largest_px = match setting.tilt_max_rad {
            // Its own may be a lean beyond a right angle by a small factor.
            Some(tilt) if correction.apply(own_max_px) < FRAC_PI_2 => correction.shift_of(tilt).max(own_max_px),
            Some(tilt) => correction.shift_of(tilt),
            None => own_max_px,
        };
        if correction.apply(largest_px) >= FRAC_PI_2 {
            return Err(lean_out_of_reach(&correction, largest_px, offset_max_px.is_some()));
        }
        let at = (vertical.pixel.x, vertical.pixel.y);
        let prefilter = shared.prefilter.get_or_init(|| Prefilter::of_offsets(&pixels.region, at, largest_px));
        Ok(Self {
            vertical: vertical.clone(),
            gains,
            offset_max_px: largest_px,
            prefilter: prefilter.with_limit(largest_px),
            evidence: Evidence {
                scale: STRAY_RAD * correction.factor(),
                weighted: false,
                approximate: !correction.tells_its_error(),
            },
            correction,
        })
    }

    pub(super) fn prefilter(&self) -> &Prefilter {
        &self.prefilter
    }

    /// Writes the rows of the edge pixels that pass the prefilter, with unit weights.
    pub(super) fn rows(&self, edges: &EdgePixels, work: &mut Work) {
        offsets(edges, &self.vertical, &self.gains.relative, self.offset_max_px, work);
    }

    /// The tilt of the shift that a fit has found among the rows, with what is known of its error.
    pub(super) fn conclude(&self, report: &FitReport<Vector2<f64>>, pixels: &PixelTables, work: &mut Work) -> Fit {
        work.inliers = Inliers::None;
        let shift = report.model.unwrap_or_default();
        let (l, corrected) = (shift.norm(), self.correction.at(shift.norm()));
        let alpha = corrected.alpha_rad;
        if alpha >= FRAC_PI_2 {
            return Fit::out_of_reach(alpha, report);
        }
        work.inliers = Inliers::weighted_if(report.model.is_some());
        let lean = if l > 0.0 { self.vertical.lean(&(shift / l)) } else { Vector2::zeros() };
        let lean = lean.try_normalize(1e-9).unwrap_or_default() * alpha.sin();
        let tilt = report.model.and_then(|_| Tilt::from_normal(&Vector3::new(lean.x, lean.y, alpha.cos())));
        let lean = Lean::new(&self.correction, corrected, shift, *self.vertical.direction());
        let model = [shift.x, shift.y, 1.0];
        Fit {
            tilt,
            covariance: tilt.and_then(|tilt| self.evidence.covariance(model, &lean, &tilt, pixels, work)),
            inliers: report.inliers,
            shift_px: report.model.map(|_| l),
            ..Fit::without_tilt(report)
        }
    }
}

/// Where the vertical is seen, for a lens that takes a lean for a shift of the image.
fn vertical_of<'a>(setting: &Setting<'a>) -> Result<&'a VanishingPoint> {
    let refused = |expected| Err(Error::option("method", setting.method, expected));
    let Some(vertical) = &setting.pixels.vertical else {
        return refused("a camera that can see the zenith or the nadir; use \"refined\" for others");
    };
    if setting.origin.robot_from_camera[(2, 2)].abs() < AXIS_COSINE_MIN {
        return refused(
            "a camera whose optical axis is within 45 degrees of the vertical: these methods take a lean for a shift of the \
             image; use \"refined\" for others",
        );
    }
    Ok(vertical)
}

/// The refusal of a largest offset that would be a lean of pi/2 or more.
fn lean_out_of_reach(correction: &TrainedCorrection, offset_max_px: f64, given: bool) -> Error {
    if given {
        return Error::option(
            "offset_max_px",
            offset_max_px,
            "fewer pixels: an offset that the correction makes a lean below pi/2 (the paper's 40 are for 139.7 pixels per \
             radian; without a number it follows the lens)",
        );
    }
    Error::option(
        "correction",
        correction.factor(),
        "a factor with which the largest offset is a lean below pi/2; the raw shift is shift_px of the estimate",
    )
}
