//! What the tilt filter says: what it did with an estimate, and what it holds to be true.

use std::fmt;

use nalgebra::Matrix2;

use super::super::confidence;
use crate::geometry::Tilt;

/// What the filter did with an estimate, with the numbers it went by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// It agrees with the prediction and was fused.
    Accepted {
        /// Normalised innovation squared, of two degrees of freedom.
        nis: f64,
        /// The largest that passes.
        limit: f64,
    },
    /// So many rejected estimates have agreed with each other that the floor's tilt was forgotten and this one fused.
    Jumped {
        /// Normalised innovation squared before the floor's tilt was forgotten.
        nis: f64,
        /// The largest that passes.
        limit: f64,
        /// Rejected estimates in a row that agree, this one included.
        agreeing: u32,
    },
    /// There is no tilt in it, or none with a finite covariance.
    NoTilt,
    /// It is that of the image before, to the last bit, though the wheels have rolled: a sensor gives no image twice.
    Repeated {
        /// How far they have rolled, in metres, since the first of these estimates.
        rolled_m: f64,
        /// The farthest that an estimate may stay the same.
        limit_m: f64,
    },
    /// It does not trust itself.
    LowConfidence {
        /// Its confidence.
        confidence: f64,
        /// The least that is looked at.
        limit: f64,
    },
    /// It is too far from the prediction.
    OutsideGate {
        /// Normalised innovation squared.
        nis: f64,
        /// The largest that passes.
        limit: f64,
        /// Estimates rejected in a row, this one included.
        rejected: u32,
    },
    /// It is too far from the prediction, as were so many before it that the floor's tilt is taken to be unknown.
    Lost {
        /// Normalised innovation squared.
        nis: f64,
        /// The largest that passes.
        limit: f64,
        /// Estimates rejected in a row, this one included.
        rejected: u32,
    },
}

impl Verdict {
    /// The verdict in a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Accepted { .. } => "accepted",
            Self::Jumped { .. } => "jumped",
            Self::NoTilt => "no-tilt",
            Self::Repeated { .. } => "repeated",
            Self::LowConfidence { .. } => "low-confidence",
            Self::OutsideGate { .. } => "outside-gate",
            Self::Lost { .. } => "lost",
        }
    }

    /// Whether the estimate was fused.
    pub fn accepted(self) -> bool {
        matches!(self, Self::Accepted { .. } | Self::Jumped { .. })
    }

    /// The normalised innovation squared, if it came to that.
    pub fn nis(self) -> Option<f64> {
        match self {
            Self::Accepted { nis, .. }
            | Self::Jumped { nis, .. }
            | Self::OutsideGate { nis, .. }
            | Self::Lost { nis, .. } => Some(nis),
            Self::NoTilt | Self::Repeated { .. } | Self::LowConfidence { .. } => None,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Accepted { nis, limit } => write!(f, "accepted (NIS {nis:.2}, limit {limit:.2})"),
            Self::Jumped { nis, limit, agreeing } => {
                write!(f, "followed a jump: {agreeing} estimates in a row agree (NIS {nis:.2}, limit {limit:.2})")
            }
            Self::NoTilt => write!(f, "an estimate without a tilt, or with an infinite covariance"),
            Self::Repeated { rolled_m, limit_m } => write!(
                f,
                "the same to the last bit as before, while the wheels rolled {rolled_m:.3} m, at most {limit_m:.3} m \
                 expected: does the camera give one image again and again?"
            ),
            Self::LowConfidence { confidence, limit } => {
                write!(f, "confidence {confidence:.3}, at least {limit:.3} expected")
            }
            Self::OutsideGate { nis, limit, rejected } => {
                write!(f, "outside the gate: NIS {nis:.2}, limit {limit:.2} ({rejected} in a row)")
            }
            Self::Lost { nis, limit, rejected } => {
                write!(f, "lost: {rejected} estimates in a row outside the gate (NIS {nis:.2}, limit {limit:.2})")
            }
        }
    }
}

/// A tilt as the filter holds it to be, with how sure it is; no tilt where it abstains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilteredTilt {
    /// The lean, `None` if the standard deviation is beyond the limit.
    pub tilt: Option<Tilt>,
    /// Covariance in squared radians of the ground normal in its tangent plane, in the basis of
    /// [`tangent_basis`](crate::geometry::tangent_basis); finite also where the filter abstains.
    pub covariance_rad2: Matrix2<f64>,
    /// Probability, in `[0, 1]`, that the error is below two degrees if it is normal with that covariance.
    pub confidence: f64,
    /// One standard deviation in radians in any one direction: the root of half the covariance's trace.
    pub sigma_rad: f64,
    /// The largest standard deviation of an answer, in radians.
    pub sigma_max_rad: f64,
}

impl FilteredTilt {
    pub(super) fn new(tilt: Tilt, covariance_rad2: Matrix2<f64>, sigma_max_rad: f64) -> Self {
        let sigma_rad = (0.5 * covariance_rad2.trace()).max(0.0).sqrt();
        Self {
            tilt: (sigma_rad <= sigma_max_rad).then_some(tilt),
            covariance_rad2,
            confidence: confidence::confidence(&covariance_rad2),
            sigma_rad,
            sigma_max_rad,
        }
    }
}

/// The standard deviation beside its limit, in a sentence.
impl fmt::Display for FilteredTilt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verb = if self.tilt.is_some() { "within" } else { "beyond" };
        let (sigma, limit) = (self.sigma_rad.to_degrees(), self.sigma_max_rad.to_degrees());
        write!(f, "standard deviation {sigma:.2} degrees, {verb} the limit of {limit:.2} degrees")
    }
}
