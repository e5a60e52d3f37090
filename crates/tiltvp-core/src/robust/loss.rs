//! How much an observation counts, given its residual.

/// The gate that a residual must pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gate {
    /// Every observation counts with its own weight.
    Open,
    /// Observations with a residual above the threshold are rejected for good.
    Hard {
        /// The largest residual that is kept.
        threshold: f64,
    },
    /// Weights are multiplied by a Gaussian of compact support, `max(0, 1 - r^2 / (16 scale^2))^8`, which follows
    /// `exp(-r^2 / (2 scale^2))` and vanishes beyond four scales.
    Soft {
        /// Standard deviation of the Gaussian.
        scale: f64,
    },
}

impl Gate {
    /// The `(limit^2, 1 / reach^2, soft)` in which the kernels evaluate the gate.
    pub(super) fn coefficients(self) -> (f64, f64) {
        match self {
            Self::Open => (f64::INFINITY, 0.0),
            Self::Hard { threshold } => (threshold * threshold, 0.0),
            Self::Soft { scale } => (f64::INFINITY, 1.0 / (16.0 * scale * scale)),
        }
    }

    /// Whether the gate rejects for good.
    pub(super) fn is_hard(self) -> bool {
        matches!(self, Self::Hard { .. })
    }
}

impl Gate {
    /// The factor by which the gate multiplies the weight of a residual.
    pub fn weight(self, residual: f64) -> f64 {
        let (limit, inverse) = self.coefficients();
        let squared = residual * residual;
        if squared > limit { 0.0 } else { (1.0 - squared * inverse).max(0.0).powi(8) }
    }
}
