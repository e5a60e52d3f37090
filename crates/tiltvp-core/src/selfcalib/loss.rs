//! How much residuals count that are larger than noise explains, of bearings and of motions, and how well all of them fit.

/// How bearings far from their prediction count; thresholds are standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum Loss {
    /// Beyond it linearly (Huber).
    Linear(f64),
    /// Beyond it not at all.
    Cut(f64),
}

impl Loss {
    /// Half the square of a whitened residual, less beyond the threshold.
    pub(super) fn cost(self, r: f64) -> f64 {
        let r = r.abs();
        match self {
            Self::Linear(k) if r > k => k * (r - 0.5 * k),
            Self::Cut(k) if r > k => 0.5 * k * k,
            _ => 0.5 * r * r,
        }
    }

    /// The slope of the cost over the residual.
    pub(super) fn weight(self, r: f64) -> f64 {
        match self {
            Self::Linear(k) if r.abs() > k => k / r.abs(),
            Self::Cut(k) if r.abs() > k => 0.0,
            _ => 1.0,
        }
    }
}

/// Standard deviations beyond which a bearing is an outlier.
pub(super) const LIMIT: f64 = 4.5;

/// How motions far from what the wheels tell count: beyond so many standard deviations logarithmically, since wheels slip.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Slip(pub(super) f64);

impl Slip {
    /// Wheels that never slip.
    pub(super) const NEVER: Self = Self(f64::INFINITY);

    /// Half the squared Mahalanobis distance, less beyond the threshold.
    pub(super) fn cost(self, squared: f64) -> f64 {
        let limit = self.0 * self.0;
        if squared > limit { 0.5 * limit * (1.0 + (squared / limit).ln()) } else { 0.5 * squared }
    }

    /// The factor of the motion's information.
    pub(super) fn weight(self, squared: f64) -> f64 {
        let limit = self.0 * self.0;
        if squared > limit { limit / squared } else { 1.0 }
    }
}

/// How well a problem fits where it was linearised.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Fit {
    /// Half the sum of the squared, whitened residuals.
    pub(super) cost: f64,
    /// Bearings.
    pub(super) bearings: usize,
    /// Those of them with whitened residuals beyond [`LIMIT`].
    pub(super) beyond: usize,
}

impl Fit {
    /// Counts a bearing's residual.
    pub(super) fn note(&mut self, residual: f64, loss: Loss) {
        self.cost += loss.cost(residual);
        self.bearings += 1;
        self.beyond += usize::from(residual.abs() > LIMIT);
    }
}

impl std::ops::AddAssign for Fit {
    fn add_assign(&mut self, other: Self) {
        self.cost += other.cost;
        self.bearings += other.bearings;
        self.beyond += other.beyond;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_weight_is_the_slope(r in 0.01..20.0f64) {
            let h = 1e-6;
            for loss in [Loss::Linear(2.0), Loss::Cut(2.0)] {
                prop_assume!((r - 2.0).abs() > 1e-3);
                let slope = (loss.cost(r + h) - loss.cost(r - h)) / (2.0 * h);
                prop_assert!((slope - loss.weight(r) * r).abs() < 1e-6);
            }
            let slip = Slip(5.0);
            let slope = (slip.cost((r + h).powi(2)) - slip.cost((r - h).powi(2))) / (2.0 * h);
            prop_assert!((slope - slip.weight(r * r) * r).abs() < 1e-5);
        }
    }
}
