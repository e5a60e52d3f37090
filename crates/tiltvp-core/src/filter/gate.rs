//! Gates: how far a measurement may be from its prediction, and how likely an error is to stay within a radius.

use std::sync::LazyLock;

use nalgebra::{Matrix2, SymmetricEigen};

use super::chi_square::chi_square_quantile;
use crate::error::{Error, Result};

/// A limit on the normalised innovation squared of `dof` dimensions that a true measurement passes with a given probability.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ChiSquareGate {
    limit: f64,
}

impl ChiSquareGate {
    /// The gate that a measurement of `dof` dimensions passes with `probability` if its covariance is right.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] named `gate_probability` unless it is strictly between 0 and 1, [`Error::InvalidArgument`]
    /// for no dimension.
    pub fn new(probability: f64, dof: u32) -> Result<Self> {
        if dof == 0 {
            return Err(Error::argument("dof", dof, "at least one dimension"));
        }
        if !(probability > 0.0 && probability < 1.0) {
            return Err(Error::option("gate_probability", probability, "a probability strictly between 0 and 1"));
        }
        Ok(Self { limit: chi_square_quantile(probability, dof) })
    }

    /// The largest normalised innovation squared that passes.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// Whether a normalised innovation squared passes; NaN does not.
    pub fn passes(&self, nis: f64) -> bool {
        nis <= self.limit
    }
}

/// Angles of the mean in [`probability_within`], over a quarter of a turn. The trapezoidal rule of a smooth periodic function
/// converges exponentially: `probability_of_round_flat_and_long_covariances` holds it to 1e-9 in the worst case.
const ANGLES: u32 = 64;

/// Sines and cosines of the angles.
static DIRECTIONS: LazyLock<[(f64, f64); ANGLES as usize]> = LazyLock::new(|| {
    std::array::from_fn(|i| (std::f64::consts::FRAC_PI_2 * (i as f64 + 0.5) / f64::from(ANGLES)).sin_cos())
});

/// The probability that a normal error in the plane with this covariance is shorter than `radius`, in the same unit.
///
/// With the error written as `C^(1/2) r (cos t, sin t)`, `t` is uniform and `r^2 / 2` exponential, so that
///
/// ```text
/// P = mean over t of 1 - exp(-radius^2 / (2 (l1 cos^2 t + l2 sin^2 t)))
/// ```
///
/// with the eigenvalues `l1`, `l2` of `C`. 0 for a covariance that is infinite or no covariance.
pub fn probability_within(covariance: &Matrix2<f64>, radius: f64) -> f64 {
    if !covariance.iter().all(|x| x.is_finite()) || radius.is_nan() || radius <= 0.0 {
        return 0.0;
    }
    let values = SymmetricEigen::new(0.5 * (covariance + covariance.transpose())).eigenvalues;
    if values.min() < -1e-12 * values.max().abs() {
        return 0.0;
    }
    let at = |(sin, cos): &(f64, f64)| {
        let variance = (values[0] * cos * cos + values[1] * sin * sin).max(0.0);
        -(-0.5 * radius * radius / variance).exp_m1()
    };
    DIRECTIONS.iter().map(at).sum::<f64>() / f64::from(ANGLES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn gates_of_one_to_three_dimensions() {
        for (dof, limit) in [(1, 6.634_896_601), (2, 9.210_340_372), (3, 11.344_866_730)] {
            let gate = ChiSquareGate::new(0.99, dof).unwrap();
            assert_abs_diff_eq!(gate.limit(), limit, epsilon = 1e-6);
            assert!(gate.passes(limit - 1e-6) && !gate.passes(limit + 1e-6) && !gate.passes(f64::NAN));
        }
        assert!(
            ChiSquareGate::new(1.0, 2).is_err()
                && ChiSquareGate::new(f64::NAN, 2).is_err()
                && ChiSquareGate::new(0.9, 0).is_err()
        );
    }

    #[test]
    fn probability_of_round_flat_and_long_covariances() {
        let round = probability_within(&(Matrix2::identity() * 4.0), 3.0);
        assert_abs_diff_eq!(round, 1.0 - (-9.0f64 / 8.0).exp(), epsilon = 1e-14);
        // One dimension only: erf(1 / sqrt 2) within one standard deviation.
        let line = probability_within(&Matrix2::new(1.0, 0.0, 0.0, 0.0), 1.0);
        assert_abs_diff_eq!(line, 0.682_689_492_137, epsilon = 1e-9);
        let turned = probability_within(&Matrix2::new(2.0, 1.0, 1.0, 2.0), 1.0);
        assert_abs_diff_eq!(turned, probability_within(&Matrix2::new(3.0, 0.0, 0.0, 1.0), 1.0), epsilon = 1e-13);
        assert_eq!(probability_within(&Matrix2::repeat(f64::INFINITY), 1.0), 0.0);
        assert_eq!(probability_within(&Matrix2::new(1.0, 0.0, 0.0, -1.0), 1.0), 0.0);
        assert_eq!(probability_within(&Matrix2::zeros(), 1.0), 1.0);
    }
}
