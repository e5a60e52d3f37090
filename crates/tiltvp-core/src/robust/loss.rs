//! How much an observation counts, given its residual.

use tiltvp_kernels::rows::{self, Real};

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
    /// Observations with a residual above the threshold do not count, this time.
    Within {
        /// The largest residual that counts.
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
    /// The gate as the kernels have it.
    pub(super) fn of_rows<T: Real>(self) -> rows::Gate<T> {
        match self {
            Self::Open => rows::Gate::Open,
            Self::Hard { threshold } => rows::Gate::Hard { reach: T::reach(threshold) },
            Self::Within { threshold } => rows::Gate::Within { reach: T::reach(threshold) },
            Self::Soft { scale } => rows::Gate::Soft { inverse: T::from_f64(inverse_square(scale)) },
        }
    }

    /// The factor by which the gate multiplies the weight of a residual.
    pub fn weight(self, residual: f64) -> f64 {
        match self {
            Self::Open => 1.0,
            Self::Hard { threshold } | Self::Within { threshold } => {
                f64::from(u8::from(is_within(residual, threshold)))
            }
            Self::Soft { scale } => (1.0 - residual * residual * inverse_square(scale)).max(0.0).powi(8),
        }
    }

    /// The derivative of `residual * weight(residual)`, which is what a fit feels of a small change of its model: negative in
    /// the flanks of the soft gate, so that clutter spread evenly over the gate adds up to nothing.
    pub fn slope(self, residual: f64) -> f64 {
        match self {
            Self::Open => 1.0,
            Self::Hard { threshold } | Self::Within { threshold } => {
                f64::from(u8::from(is_within(residual, threshold)))
            }
            Self::Soft { scale } => {
                let t = (1.0 - residual * residual * inverse_square(scale)).max(0.0);
                t.powi(7) * (17.0 * t - 16.0)
            }
        }
    }
}

/// Whether a residual is at most the threshold, by their squares, as the kernels have it.
fn is_within(residual: f64, threshold: f64) -> bool {
    residual * residual <= threshold * threshold
}

/// One over the square of the residual from which on a soft gate leaves nothing.
pub(super) fn inverse_square(scale: f64) -> f64 {
    1.0 / (16.0 * scale * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_is_the_derivative_of_the_weighted_residual() {
        let h = 1e-6;
        for gate in [Gate::Open, Gate::Hard { threshold: 0.5 }, Gate::Soft { scale: 0.2 }] {
            for i in -100..100 {
                let r = 0.01 * f64::from(i) + 0.005;
                let numeric = ((r + h) * gate.weight(r + h) - (r - h) * gate.weight(r - h)) / (2.0 * h);
                assert!((gate.slope(r) - numeric).abs() < 1e-6, "{gate:?} at {r}: {} {numeric}", gate.slope(r));
            }
        }
    }
}
