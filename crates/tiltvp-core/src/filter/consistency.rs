//! The consistency of a filter: NEES, NIS, and the bands in which their means should lie.

use nalgebra::{Cholesky, SMatrix, SVector};

use super::chi_square::chi_square_quantile;

/// The interval that the mean of many chi-square values, those of a consistent filter, falls into with a given probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConsistencyBand {
    /// Below this the filter is too cautious.
    pub low: f64,
    /// Above this the filter is overconfident.
    pub high: f64,
}

impl ConsistencyBand {
    /// The band about `dof` for the mean of `samples` independent values of `dof` degrees of freedom each (Bar-Shalom, Li
    /// and Kirubarajan, Estimation with Applications to Tracking and Navigation, 5.4.2); a consistent filter misses it with
    /// probability `1 - probability`. `None` for no samples, no dimension, or a probability outside (0, 1), or so near to 1 that
    /// half of what it lacks is none of a float.
    ///
    /// NEES of successive steps are not independent: take one step of each of many runs.
    pub fn of_mean(probability: f64, dof: u32, samples: u32) -> Option<Self> {
        let total = dof.checked_mul(samples).filter(|total| *total > 0)?;
        if !(probability > 0.0 && probability < 1.0) {
            return None;
        }
        let tail = 0.5 * (1.0 - probability);
        let bound = |p| chi_square_quantile(p, total) / f64::from(samples);
        Some(Self { low: bound(tail), high: bound(1.0 - tail) }).filter(|band| band.high.is_finite())
    }

    /// Whether a mean lies in the band.
    pub fn holds(&self, mean: f64) -> bool {
        (self.low..=self.high).contains(&mean)
    }
}

/// `e^T P^-1 e`: the normalised estimation error squared (NEES) of an error and the covariance claimed for it, or the
/// normalised innovation squared (NIS) of an innovation and its covariance. `None` unless `P` is positive definite.
pub fn squared_mahalanobis<const N: usize>(error: &SVector<f64, N>, covariance: &SMatrix<f64, N, N>) -> Option<f64> {
    Cholesky::new(*covariance).map(|factor| error.dot(&factor.solve(error)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{Matrix2, Vector2};

    #[test]
    fn the_band_of_a_textbook() {
        // 50 runs of 2 dimensions: chi-square quantiles 74.22 and 129.56 of 100 degrees of freedom.
        let band = ConsistencyBand::of_mean(0.95, 2, 50).unwrap();
        assert_relative_eq!(band.low, 1.4844, max_relative = 1e-4);
        assert_relative_eq!(band.high, 2.5912, max_relative = 1e-4);
        assert!(band.holds(2.0) && !band.holds(2.6) && !band.holds(f64::NAN));
        assert!(ConsistencyBand::of_mean(0.95, 2, 0).is_none() && ConsistencyBand::of_mean(1.0, 2, 3).is_none());
        assert!(ConsistencyBand::of_mean(1.0 - 0.5 * f64::EPSILON, 2, 3).is_none());
    }

    #[test]
    fn squared_distance_in_standard_deviations() {
        let nees = squared_mahalanobis(&Vector2::new(2.0, 3.0), &Matrix2::new(4.0, 0.0, 0.0, 9.0));
        assert_relative_eq!(nees.unwrap(), 2.0);
        assert!(squared_mahalanobis(&Vector2::new(1.0, 0.0), &Matrix2::zeros()).is_none());
    }
}
