//! Options of the tilt estimator; the paper's defaults are those of its table 3.

use super::correction::Correction;
use super::refine::RefineOptions;
use super::trained::TrainedCorrection;
use crate::edges::{EdgeOptions, Mask, NormalKind};
use crate::error::{Error, Result};
use crate::robust::Sampling;

/// `s_max` of the paper in pixels, and its lens' pixels per radian about the vertical.
const PAPER_OFFSET_MAX_PX: f64 = 40.0;
const PAPER_SCALE_PX: f64 = 139.7;

/// The largest edge offset that means as large a lean as the paper's, for a lens of so many pixels per radian about the
/// vertical, to a millionth of a pixel.
pub(super) fn offset_max_px_of(scale_px: f64) -> f64 {
    (PAPER_OFFSET_MAX_PX * scale_px / PAPER_SCALE_PX * 1e6).round() / 1e6
}

/// The methods by name, the default first.
pub const METHODS: [&str; 4] = ["refined", "image-space-ransac", "image-space-reject-refit", "vector-consensus"];

/// How the tilt is estimated from the edge pixels.
#[derive(Debug, Clone, PartialEq)]
pub enum Method {
    /// Paper 000 section 2.1 with random sampling.
    ImageSpaceRansac {
        /// Largest residual of an inlier in pixels, `delta_s,max` of eq. 32. Default 10.
        threshold_px: f64,
        /// Largest edge offset in pixels that passes the prefilter, `s_max`. Default, where there is none: the paper's 40 for
        /// its lens of 139.7 pixels per radian about the vertical, and in proportion for others.
        offset_max_px: Option<f64>,
        /// From the shift to the angle.
        correction: Correction,
        /// How samples are drawn, improved, scored and verified. Default the paper's way.
        sampling: Sampling,
    },
    /// Paper 000 section 2.1 with repeated trimming.
    ImageSpaceRejectRefit {
        /// Share of normal residuals kept each round; eq. 34 with `Q` read as the share kept. Default 0.8.
        keep_fraction: f64,
        /// Most rounds of rejecting and refitting, `N_E`; 0 is plain least squares. Default 15.
        max_iterations: u32,
        /// Largest edge offset in pixels that passes the prefilter, `s_max`. Default, where there is none: the paper's 40 for
        /// its lens of 139.7 pixels per radian about the vertical, and in proportion for others.
        offset_max_px: Option<f64>,
        /// From the shift to the angle.
        correction: Correction,
    },
    /// Paper 000 section 2.2.
    VectorConsensus {
        /// Largest angle in radians between an inlier's great circle and the vertical, `delta_o,max` of eq. 40. Default 5 degrees.
        threshold_rad: f64,
        /// Whether normals are made the paper's way or the exact way. Default the paper's.
        normal: NormalKind,
        /// From the raw angle to the angle: the factor `a'` of eq. 45, or another. Default the factor 1.
        correction: TrainedCorrection,
        /// How samples are drawn, improved, scored and verified. Default the paper's way.
        sampling: Sampling,
    },
    /// Ours: tangent normals weighted by their gradients, trimmed from the upright prior, then a fading soft gate.
    Refined(RefineOptions),
}

impl Method {
    /// Whether the angle errs by no more than the edges or the training set tell: the geometry is exact for every lens, or a
    /// posterior knows what it is not.
    pub(super) fn tells_its_error(&self) -> bool {
        match self {
            Self::Refined(_) => true,
            Self::VectorConsensus { normal, correction, .. } => {
                *normal == NormalKind::Tangent || matches!(correction, TrainedCorrection::Posterior(_))
            }
            Self::ImageSpaceRansac { correction, .. } | Self::ImageSpaceRejectRefit { correction, .. } => {
                matches!(correction, Correction::Trained(TrainedCorrection::Posterior(_)))
            }
        }
    }

    /// The name under which users ask for the method.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Refined(_) => METHODS[0],
            Self::ImageSpaceRansac { .. } => METHODS[1],
            Self::ImageSpaceRejectRefit { .. } => METHODS[2],
            Self::VectorConsensus { .. } => METHODS[3],
        }
    }

    /// What the image-space methods have in common: the correction and the largest edge offset.
    pub(super) fn offsets(&self) -> Option<(&Correction, Option<f64>)> {
        match self {
            Self::ImageSpaceRansac { correction, offset_max_px, .. }
            | Self::ImageSpaceRejectRefit { correction, offset_max_px, .. } => Some((correction, *offset_max_px)),
            Self::VectorConsensus { .. } | Self::Refined(_) => None,
        }
    }
}

/// Everything that can be chosen about a [`TiltEstimator`](super::TiltEstimator).
#[derive(Debug, Clone, PartialEq)]
pub struct TiltOptions {
    /// The method and what belongs to it alone.
    pub method: Method,
    /// Which pixels are edges.
    pub edges: EdgeOptions,
    /// Largest lean expected, in radians: edges that would need a larger one are rejected first. Default 12 degrees for
    /// the refined method and 7 for vector consensus; the image-space methods have `offset_max_px` instead, and this, where
    /// given, sets it to the shift of that lean.
    pub tilt_max_rad: Option<f64>,
    /// Pixels that show the world and not the robot. Default all.
    pub mask: Option<Mask>,
    /// Every so-manieth row of the image is looked at: less time, and less sure an answer. Default 1.
    pub row_stride: u32,
    /// Seed of the random samples. Default 0.
    pub seed: u64,
}

impl TiltOptions {
    /// The defaults of a method.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the list of methods if there is none of that name.
    pub fn for_method(name: &str) -> Result<Self> {
        let (method, gradient_min, smoothing_px) = match name {
            "image-space-ransac" => {
                let (correction, sampling) = (Correction::default(), Sampling::default());
                (Method::ImageSpaceRansac { threshold_px: 10.0, offset_max_px: None, correction, sampling }, 150.0, 0.0)
            }
            "image-space-reject-refit" => {
                let correction = Correction::default();
                let method = Method::ImageSpaceRejectRefit {
                    keep_fraction: 0.8,
                    max_iterations: 15,
                    offset_max_px: None,
                    correction,
                };
                (method, 200.0, 0.0)
            }
            "vector-consensus" => {
                let (threshold_rad, sampling) = (5f64.to_radians(), Sampling::default());
                let correction = TrainedCorrection::Factor(1.0);
                (
                    Method::VectorConsensus { threshold_rad, normal: NormalKind::Gradient, correction, sampling },
                    600.0,
                    0.0,
                )
            }
            "refined" => (Method::Refined(RefineOptions::default()), 150.0, 0.6),
            _ => {
                return Err(Error::option(
                    "method",
                    format!("\"{name}\""),
                    "\"refined\", \"image-space-ransac\", \"image-space-reject-refit\" or \"vector-consensus\"",
                ));
            }
        };
        Ok(Self {
            method,
            edges: EdgeOptions { gradient_min, smoothing_px, ..EdgeOptions::default() },
            tilt_max_rad: None,
            mask: None,
            row_stride: 1,
            seed: 0,
        })
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        let positive = |name, value: f64, expected| {
            if value > 0.0 && value.is_finite() { Ok(()) } else { Err(Error::option(name, value, expected)) }
        };
        self.edges.validate()?;
        if self.row_stride == 0 {
            return Err(Error::option("row_stride", self.row_stride, "a number of rows, at least 1"));
        }
        if let Some(tilt_max) = self.tilt_max_rad
            && !(tilt_max > 0.0 && tilt_max < std::f64::consts::FRAC_PI_2)
        {
            return Err(Error::option("tilt_max_rad", tilt_max, "an angle strictly between 0 and pi/2"));
        }
        match &self.method {
            Method::ImageSpaceRansac { threshold_px, offset_max_px, correction, sampling } => {
                sampling.validate()?;
                positive("threshold_px", *threshold_px, "a positive number of pixels")?;
                positive("offset_max_px", offset_max_px.unwrap_or(1.0), "a positive number of pixels")?;
                correction.validate()
            }
            Method::ImageSpaceRejectRefit { keep_fraction, offset_max_px, correction, .. } => {
                if !(*keep_fraction > 0.0 && *keep_fraction < 1.0) {
                    return Err(Error::option("keep_fraction", keep_fraction, "a share strictly between 0 and 1"));
                }
                positive("offset_max_px", offset_max_px.unwrap_or(1.0), "a positive number of pixels")?;
                correction.validate()
            }
            Method::VectorConsensus { threshold_rad, correction, sampling, .. } => {
                sampling.validate()?;
                if !(*threshold_rad > 0.0 && *threshold_rad < std::f64::consts::FRAC_PI_2) {
                    return Err(Error::option("threshold_rad", threshold_rad, "an angle strictly between 0 and pi/2"));
                }
                correction.validate()
            }
            Method::Refined(options) => options.validate(),
        }
    }

    /// How the sampling methods sample; the others do not.
    pub(super) fn sampling(&self) -> Option<Sampling> {
        match &self.method {
            Method::ImageSpaceRansac { sampling, .. } | Method::VectorConsensus { sampling, .. } => Some(*sampling),
            Method::ImageSpaceRejectRefit { .. } | Method::Refined(_) => None,
        }
    }

    /// The prefilter's angle of the methods that work with normals.
    pub(super) fn normal_tilt_max_rad(&self) -> f64 {
        let default_deg: f64 = if matches!(self.method, Method::VectorConsensus { .. }) { 7.0 } else { 12.0 };
        self.tilt_max_rad.unwrap_or(default_deg.to_radians())
    }
}
