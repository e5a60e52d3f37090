//! The correction of an extended Kalman filter of any size, in the error state: gate first, then correct.

use nalgebra::{Cholesky, Const, DMatrix, SMatrix, SVector, SymmetricEigen};

/// An innovation, measured minus predicted, with its covariance.
#[derive(Debug, Clone)]
pub struct Innovation<const N: usize, const M: usize> {
    covariance: SMatrix<f64, N, N>,
    jacobian: SMatrix<f64, M, N>,
    noise: SMatrix<f64, M, M>,
    /// Measured minus predicted.
    pub innovation: SVector<f64, M>,
    factor: Cholesky<f64, Const<M>>,
}

impl<const N: usize, const M: usize> Innovation<N, M> {
    /// From the covariance `P` of the error state, the Jacobian `H` of the measurement by the error state, the covariance
    /// `R` of the measurement, and the innovation `y`. `None` unless `S = H P H^T + R` is positive definite.
    pub fn new(
        covariance: SMatrix<f64, N, N>,
        jacobian: SMatrix<f64, M, N>,
        noise: SMatrix<f64, M, M>,
        innovation: SVector<f64, M>,
    ) -> Option<Self> {
        let innovation_covariance = symmetric(&(jacobian * covariance * jacobian.transpose() + noise));
        let factor = Cholesky::new(innovation_covariance)?;
        Some(Self { covariance, jacobian, noise, innovation, factor })
    }

    /// The normalised innovation squared `y^T S^-1 y`: chi-square of `M` degrees of freedom for a consistent filter.
    pub fn nis(&self) -> f64 {
        self.innovation.dot(&self.factor.solve(&self.innovation))
    }

    /// The mean of the error state and its covariance after the measurement, in Joseph's form.
    pub fn correct(&self) -> (SVector<f64, N>, SMatrix<f64, N, N>) {
        let gain = self.factor.solve(&(self.jacobian * self.covariance)).transpose();
        let keep = SMatrix::<f64, N, N>::identity() - gain * self.jacobian;
        let after = keep * self.covariance * keep.transpose() + gain * self.noise * gain.transpose();
        (gain * self.innovation, symmetric(&after))
    }
}

/// The symmetric part of a matrix.
pub fn symmetric<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    0.5 * (matrix + matrix.transpose())
}

/// Whether a matrix can be a covariance: finite, symmetric and without negative variances, to rounding.
pub fn positive_semidefinite<const N: usize>(matrix: &SMatrix<f64, N, N>) -> bool {
    let scale = matrix.amax();
    if !scale.is_finite() || !matrix.iter().all(|x| x.is_finite()) {
        return false;
    }
    if (matrix - matrix.transpose()).amax() > 1e-9 * scale {
        return false;
    }
    principal_axes(matrix).eigenvalues.iter().all(|value| *value >= -1e-9 * scale)
}

/// The least variance, as a share of the largest entry, that [`restored`] takes for rounding of none: a thousandth of what
/// [`positive_semidefinite`] does, so that a covariance that is restored is one wherever it is carried next.
const RESTORED: f64 = 1e-12;

/// The covariance that a matrix is but for rounding. Where that has left a negative variance along a principal axis, it is zero;
/// what is one, or is not finite, stays as it is.
pub fn restored<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let raised = matrix + SMatrix::identity() * (RESTORED * matrix.amax());
    if matrix.amax() == 0.0 || !matrix.iter().all(|x| x.is_finite()) || Cholesky::new(raised).is_some() {
        return *matrix;
    }
    let mut axes = principal_axes(matrix);
    axes.eigenvalues.apply(|value| *value = value.max(0.0));
    symmetric(&SMatrix::from_column_slice(axes.recompose().as_slice()))
}

/// In the dynamic form: nalgebra's fixed one has no bound for every N. Entries below what rounding leaves of rounding are zero: its
/// rotations underflow where entries are 1e-139 of others.
fn principal_axes<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SymmetricEigen<f64, nalgebra::Dyn> {
    let least = f64::EPSILON * f64::EPSILON * matrix.amax();
    let seen = symmetric(matrix).map(|x| if x.abs() < least { 0.0 } else { x });
    SymmetricEigen::new(DMatrix::from_column_slice(N, N, seen.as_slice()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{Matrix1x2, Matrix2, Vector1};

    #[test]
    fn one_of_two_states_is_measured() {
        let covariance = Matrix2::new(4.0, 1.0, 1.0, 2.0);
        let seen = Innovation::new(covariance, Matrix1x2::new(1.0, 0.0), SMatrix::from_element(4.0), Vector1::new(2.0))
            .unwrap();
        assert_relative_eq!(seen.nis(), 0.5);
        let (step, after) = seen.correct();
        assert_relative_eq!(step, SVector::from([1.0, 0.25]));
        assert_relative_eq!(after, Matrix2::new(2.0, 0.5, 0.5, 1.875), max_relative = 1e-12);
        assert!(positive_semidefinite(&after));
    }

    #[test]
    fn a_covariance_of_variances_of_all_sizes_is_one() {
        let cross = -3.5274e-139;
        let mut graded =
            nalgebra::Matrix6::from_diagonal(&nalgebra::Vector6::new(0.03, 0.03, 0.0, 0.0, -cross, -cross));
        for (i, j, x) in
            [(0, 1, -4.3e-19), (0, 3, -8.9e-145), (1, 3, -1.9e-146), (0, 4, cross), (1, 4, 2.3e-156), (1, 5, cross)]
        {
            (graded[(i, j)], graded[(j, i)]) = (x, x);
        }
        assert!(positive_semidefinite(&graded));
        assert!(!positive_semidefinite(&(graded - nalgebra::Matrix6::from_diagonal_element(1e-9))));
    }

    #[test]
    fn what_rounding_has_taken_is_given_back() {
        let whole = Matrix2::new(4.0, 1.0, 1.0, 2.0);
        assert_eq!(restored(&whole), whole);
        assert_eq!(restored(&Matrix2::<f64>::zeros()), Matrix2::zeros());
        assert!(restored(&Matrix2::new(f64::INFINITY, 0.0, 0.0, 1.0))[(0, 0)].is_infinite());
        // Of full correlation, with a trace more than there can be.
        for unit in [1e-200, 1.0, 1e200] {
            let torn = Matrix2::new(1.0, 1.0 + 4e-10, 1.0 + 4e-10, 1.0) * unit;
            let mended = restored(&torn);
            assert!(mended.symmetric_eigenvalues().min() > -1e-15 * unit && (mended - torn).amax() < 1e-9 * unit);
        }
    }

    #[test]
    fn what_is_no_covariance() {
        assert!(!positive_semidefinite(&Matrix2::new(1.0, 2.0, 2.0, 1.0)));
        assert!(!positive_semidefinite(&Matrix2::new(1.0, 0.5, 0.0, 1.0)));
        assert!(!positive_semidefinite(&Matrix2::new(f64::NAN, 0.0, 0.0, 1.0)));
        assert!(positive_semidefinite(&Matrix2::<f64>::zeros()));
        let no_noise =
            Innovation::new(Matrix2::zeros(), Matrix2::identity(), Matrix2::zeros(), SVector::from([1.0, 0.0]));
        assert!(no_noise.is_none());
    }
}
