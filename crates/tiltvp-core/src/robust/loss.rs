//! How much an observation counts, given its residual.

use super::marginal::{CELLS, MARGINAL, cell, slope_at, weight_most};

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
    /// Weights are multiplied by those of MAGSAC++ for one degree of freedom (Barath et al. 2020): the density of residuals
    /// marginalised over noise of any scale, zero beyond the threshold.
    Marginal {
        /// The residual within which 99 % of the inliers of the largest scale lie.
        threshold: f64,
    },
    /// Weights are multiplied by a Gaussian of compact support, `max(0, 1 - r^2 / (16 scale^2))^8`, which follows
    /// `exp(-r^2 / (2 scale^2))` and vanishes beyond four scales.
    Soft {
        /// Standard deviation of the Gaussian.
        scale: f64,
    },
}

/// How the kernels evaluate a gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A threshold whose rejections last.
    Hard,
    /// The other side of [`Hard`](Self::Hard): what it newly rejects.
    Rejected,
    /// A threshold.
    Within,
    /// The weights of a table.
    Marginal,
    /// A power of a parabola.
    Soft,
    /// None.
    Open,
}

impl Gate {
    /// The limit, and `1 / reach^2`, in which the kernels evaluate the gate.
    pub(super) fn coefficients(self) -> (f64, f64) {
        match self {
            Self::Open => (f64::INFINITY, 0.0),
            Self::Hard { threshold } | Self::Within { threshold } => (threshold, 0.0),
            Self::Marginal { threshold } => (threshold, 1.0 / (threshold * threshold)),
            Self::Soft { scale } => (f64::INFINITY, 1.0 / (16.0 * scale * scale)),
        }
    }

    /// The kernel that evaluates the gate.
    pub(super) fn shape(self) -> Shape {
        match self {
            Self::Hard { .. } => Shape::Hard,
            Self::Within { .. } => Shape::Within,
            Self::Marginal { .. } => Shape::Marginal,
            Self::Soft { .. } => Shape::Soft,
            Self::Open => Shape::Open,
        }
    }
}

impl Gate {
    /// The factor by which the gate multiplies the weight of a residual.
    pub fn weight(self, residual: f64) -> f64 {
        let (limit, inverse) = self.coefficients();
        let squared = residual * residual;
        if matches!(self, Self::Marginal { .. }) {
            return f64::from(MARGINAL.weight[cell(((squared * inverse) as f32).sqrt())]);
        }
        if squared > limit * limit { 0.0 } else { (1.0 - squared * inverse).max(0.0).powi(8) }
    }

    /// The derivative of `residual * weight(residual)`, which is what a fit feels of a small change of its model: negative in
    /// the flanks of the soft gate, so that clutter spread evenly over the gate adds up to nothing.
    pub fn slope(self, residual: f64) -> f64 {
        let (limit, inverse) = self.coefficients();
        let squared = residual * residual;
        if matches!(self, Self::Marginal { .. }) {
            let part = (residual.abs() * inverse.sqrt()).max(0.5 / CELLS as f64);
            return if part < 1.0 { slope_at(part) / weight_most() } else { 0.0 };
        }
        let t = (1.0 - squared * inverse).max(0.0);
        if squared > limit * limit { 0.0 } else { t.powi(7) * (17.0 * t - 16.0) }
    }
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
