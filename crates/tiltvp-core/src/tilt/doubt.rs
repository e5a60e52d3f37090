//! What keeps an estimate from being sure of itself, in words.

use std::fmt;

/// What most likely keeps an estimate from being sure of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// The image circle is not where the calibration says.
    Decentred {
        /// By how much leans err if the calibration's centre is off as the circle is, in radians.
        off_rad: f64,
    },
    /// The pixels are coarse.
    Coarse {
        /// Pixels for each degree.
        per_deg: f64,
    },
    /// The view does not look as it does where up is as told.
    NotUp,
    /// The lean is beyond the largest one that is expected: edges beyond are rejected, so it may be larger.
    Beyond {
        /// The largest lean that is expected, in radians.
        limit_rad: f64,
    },
    /// The edges that agree are steps of the pixel grid, and no others tell the vertical.
    OnGrid {
        /// Share of the edge pixels that agree, in `[0, 1]`.
        share: f64,
    },
    /// The steps of the image are wide.
    Blurred {
        /// Standard deviation of the estimate that this makes, in radians, a side.
        sigma_rad: f64,
    },
    /// There are few edges.
    FewEdges {
        /// Edge pixels.
        pixels: usize,
    },
    /// So many pixels are edges that they are hardly of things.
    Noisy {
        /// Share of the pixels that are looked at, in `[0, 1]`.
        share: f64,
    },
    /// Of the edges few agree.
    FewAgree {
        /// Share of the edge pixels, in `[0, 1]`.
        share: f64,
    },
    /// The edges that agree stand in too few directions.
    OneSided {
        /// Ratio of the standard deviations in two directions.
        ratio: f64,
    },
    /// What agrees strays.
    Scattered {
        /// Standard deviation of the estimate, in radians.
        sigma_rad: f64,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Decentred { off_rad } => write!(
                f,
                "the image circle is beside the calibration's, whose centre may be off by what makes {:.1} degrees",
                off_rad.to_degrees()
            ),
            Self::Coarse { per_deg } => write!(f, "{per_deg:.1} pixels for each degree are coarse"),
            Self::NotUp => {
                write!(f, "what is light, and where edges stand, is unlike views with up as told: check the mounting")
            }
            Self::Beyond { limit_rad } => write!(
                f,
                "the lean is beyond the limit of {:.1} degrees and may be larger than it seems: raise tilt_max_rad",
                limit_rad.to_degrees()
            ),
            Self::OnGrid { share } => write!(
                f,
                "{:.0} % of the edge pixels that agree are steps of the pixel grid, as of blocks, borders and enlarged pixels: mask them, \
                 or compress less",
                100.0 * share
            ),
            Self::Blurred { sigma_rad } => write!(
                f,
                "the image is blurred, by which the tilt may be off by {:.1} degrees and more: focus, expose for less long, or take \
                 the method segments",
                sigma_rad.to_degrees()
            ),
            Self::FewEdges { pixels } => {
                write!(f, "{pixels} edge pixels are few: little contrast, dark, over-exposed or blurred")
            }
            Self::Noisy { share } => write!(
                f,
                "{:.0} % of the pixels are edges, by noise or texture: raise smoothing_px, or take the method segments",
                100.0 * share
            ),
            Self::FewAgree { share } => write!(
                f,
                "only {:.0} % of the edge pixels agree: check mounting, calibration, mask and tilt_max_rad",
                100.0 * share
            ),
            Self::OneSided { ratio } => {
                write!(
                    f,
                    "the edges stand in few directions: {ratio:.0} times the error along one that it has along the other"
                )
            }
            Self::Scattered { sigma_rad } => {
                write!(
                    f,
                    "the edges stray: a standard deviation of {:.1} degrees (noise, blur, clutter)",
                    sigma_rad.to_degrees()
                )
            }
        }
    }
}
