//! The covariance of the mounting where a landmark's bearings share errors: cluster-robust (Liang and Zeger 1986), and that of errors
//! that fade from one bearing to the next.

use nalgebra::{DMatrix, Matrix3, RowVector3, SymmetricEigen, U3, Vector3};

use super::problem::BundleProblem;
use super::schur::ReducedSystem;
use crate::selfcalib::model::OUTLIER_SIGMAS;

/// Standard deviations beyond which the sum of the products of successive residuals is not due to chance: 3 in 100,000 drives
/// with white noise, so that their covariances stay as they are.
const CORRELATED_SIGMAS: f64 = 4.0;

/// The number of parameters of the mounting, the first of the shared ones.
const MOUNTING_WIDTH: usize = 3;

impl BundleProblem {
    /// The factor `F` that widens the covariance `C` of the mounting to `F C F^T`, which is in no direction narrower. The identity where
    /// successive residuals of the landmarks are independent.
    ///
    /// A bearing with residual `r`, Jacobian `J` and weight `w` moves the solution by `u = C J^T w r`. The part of `C` that comes
    /// from bearings is replaced by the sum over landmarks of `(sum u) (sum u)^T`, the sum being over the bearings of one
    /// landmark. Where landmarks are few, the solution follows errors that last, and residuals show little of them: to `C` is also added
    /// the sum of `(C J_i^T w_i) (C J_j^T w_j)^T rho^|i - j|` over pairs of bearings of one landmark, that of errors of which `rho` stays
    /// from one to the next. The wider of the two counts. `covariance` is the inverse of the normal equations, with or without the last
    /// pose.
    pub(crate) fn covariance_widening(&self, system: &ReducedSystem, covariance: &DMatrix<f64>) -> Matrix3<f64> {
        let Some(staying) = self.share_that_stays() else { return Matrix3::identity() };
        let (width, calibration_width) = (self.width(), self.free.width());
        let kept = covariance.nrows() - width;
        let columns: [_; MOUNTING_WIDTH] = std::array::from_fn(|k| {
            let column = covariance.column(kept + k);
            let shared = column.rows(kept, width).into_owned();
            let last = (kept > 0).then(|| column.fixed_rows::<3>(0).into_owned());
            let poses = system.pose_derivatives(&shared, last, self.keyframes.len());
            (shared, poses)
        });
        let own: Matrix3<f64> = covariance.fixed_view::<3, 3>(kept, kept).into();
        let points = self.homogeneous_landmarks();
        let (mut together, mut alone) = (vec![Vector3::zeros(); self.landmarks.len()], Matrix3::zeros());
        // Of each landmark the sum over its bearings so far, of which less stays the longer they are past.
        let (mut past, mut pairs) = (vec![RowVector3::zeros(); self.landmarks.len()], Matrix3::zeros());
        for i in 0..self.keyframes.len() {
            let neighbour = self.neighbour(i);
            self.for_each_bearing_row(i, &points, |row| {
                let along = RowVector3::from_fn(|_, k| {
                    let (shared, poses) = &columns[k];
                    let by_calibration: f64 = (0..calibration_width).map(|c| row.by_calibration[c] * shared[c]).sum();
                    let by_landmark = row.by_landmark[0] * shared[row.at] + row.by_landmark[1] * shared[row.at + 1];
                    let by_neighbour = neighbour.map_or(0.0, |other| row.by_neighbour.dot(&poses[other]));
                    row.by_pose.dot(&poses[i]) + by_neighbour + by_calibration + by_landmark
                });
                alone += along.transpose() * along * row.weight;
                let landmark = (row.at - calibration_width) / 2;
                together[landmark] += along.transpose() * (row.weight * row.residual);
                let now = along * row.weight;
                let pair = now.transpose() * past[landmark];
                pairs += pair + pair.transpose();
                past[landmark] = (past[landmark] + now) * staying;
            });
        }
        let seen = together.iter().filter(|u| **u != Vector3::zeros()).count() as f64;
        let square = |u: &Vector3<f64>| u * u.transpose();
        let together = together.iter().map(square).sum::<Matrix3<f64>>() * (seen / (seen - 1.0).max(1.0));
        let clusters = own - alone + together;
        widening_factor(&widened(&own, &clusters), &(own + pairs)) * widening_factor(&own, &clusters)
    }

    /// The share of a bearing's error that stays to the next of its landmark. None if successive residuals are not positively correlated.
    ///
    /// It is told by how much residuals change, `E (r' - r)^2 = 2 (1 - rho)` in standard deviations: the solution follows what lasts, not
    /// what changes.
    fn share_that_stays(&self) -> Option<f64> {
        let mut before: Vec<Option<f64>> = vec![None; self.landmarks.len()];
        let (mut sum, mut squares, mut changes, mut pairs) = (0.0, 0.0, 0.0, 0.0);
        for (observation, residual) in
            self.keyframes.iter().flat_map(|keyframe| &keyframe.observations).zip(self.residuals())
        {
            let now = Some(residual).filter(|r| r.abs() < OUTLIER_SIGMAS);
            if let (Some(last), Some(now)) = (std::mem::replace(&mut before[observation.landmark], now), now) {
                sum += last * now;
                squares += (last * now).powi(2);
                changes += (now - last).powi(2);
                pairs += 1.0;
            }
        }
        (sum > CORRELATED_SIGMAS * squares.sqrt()).then(|| (1.0 - 0.5 * changes / pairs).clamp(0.0, 1.0))
    }
}

/// A covariance that is `wide`, but in no direction narrower than `own`.
pub(crate) fn widened(own: &Matrix3<f64>, wide: &Matrix3<f64>) -> Matrix3<f64> {
    let factor = widening_factor(own, wide);
    factor * own * factor.transpose()
}

/// The largest ratio of standard deviations of `wide` to those of `own`, of all directions: at least 1.
pub(crate) fn largest_ratio(own: &Matrix3<f64>, wide: &Matrix3<f64>) -> f64 {
    Whitened::new(own, wide).map_or(1.0, |of| of.eigen.eigenvalues.max().max(1.0).sqrt())
}

/// `F` such that `F C F^T` is `wide`, but in no direction narrower than `C`.
fn widening_factor(own: &Matrix3<f64>, wide: &Matrix3<f64>) -> Matrix3<f64> {
    let Some(Whitened { lower, inverse, eigen }) = Whitened::new(own, wide) else { return Matrix3::identity() };
    let root = Matrix3::from_diagonal(&eigen.eigenvalues.map(|value| value.max(1.0).sqrt()));
    lower * eigen.eigenvectors * root * eigen.eigenvectors.transpose() * inverse
}

/// A covariance in units of another one.
struct Whitened {
    /// The Cholesky factor of the other one, and its inverse.
    lower: Matrix3<f64>,
    inverse: Matrix3<f64>,
    eigen: SymmetricEigen<f64, U3>,
}

impl Whitened {
    fn new(own: &Matrix3<f64>, wide: &Matrix3<f64>) -> Option<Self> {
        let lower = own.cholesky()?.l();
        let inverse = lower.try_inverse()?;
        let ratio = inverse * wide * inverse.transpose();
        let eigen = SymmetricEigen::new(0.5 * (ratio + ratio.transpose()));
        eigen.eigenvalues.iter().all(|value| value.is_finite()).then_some(Self { lower, inverse, eigen })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widens_where_it_should_and_never_narrows() {
        let own = Matrix3::new(4.0, 1.0, 0.5, 1.0, 2.0, 0.3, 0.5, 0.3, 1.0);
        assert!((widened(&own, &(own * 4.0)) - own * 4.0).amax() < 1e-12);
        assert!((largest_ratio(&own, &(own * 4.0)) - 2.0).abs() < 1e-12);
        assert!((widened(&own, &(own * 0.25)) - own).amax() < 1e-12);
        assert_eq!(largest_ratio(&own, &(own * 0.25)), 1.0);
        let more = own + Matrix3::from_diagonal(&Vector3::new(0.0, 3.0, 0.0));
        assert!((widened(&own, &more) - more).amax() < 1e-12);
    }
}
