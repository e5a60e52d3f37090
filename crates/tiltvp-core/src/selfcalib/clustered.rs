//! The covariance of a mounting where the errors of a landmark's bearings have something in common.

use nalgebra::{DMatrix, Matrix3, RowVector3, SymmetricEigen, Vector3};

use super::graph::Graph;
use super::loss::LIMIT;
use super::schur::Eliminated;

/// Standard deviations of the products of successive residuals of a landmark beyond which these are not independent.
const SIGNIFICANT: f64 = 4.0;

/// The mounting's place among the unknowns of the dense block.
const MOUNTING: usize = 3;

impl Graph {
    /// The factor `F` by which errors in common widen the covariance `C` of the mounting to `F C F^T`; none that would narrow
    /// it, and no more than the identity where successive residuals of the landmarks are independent.
    ///
    /// With `u = C J^T w r` for what a bearing of residual `r`, Jacobian `J` and weight `w` adds to the answer, the bearings'
    /// part of `C` is replaced by the sum over landmarks of the squares of the sum of its `u` (the cluster-robust estimate).
    /// `covariance` is the inverse of the normal equations, of which the last pose is part or not.
    pub(super) fn widening(&self, eliminated: &Eliminated, covariance: &DMatrix<f64>) -> Matrix3<f64> {
        if !self.common_errors() {
            return Matrix3::identity();
        }
        let (width, fixed) = (self.width(), self.free.width());
        let kept = covariance.nrows() - width;
        let columns: [_; MOUNTING] = std::array::from_fn(|k| {
            let column = covariance.column(kept + k);
            let dense = column.rows(kept, width).into_owned();
            let last = (kept > 0).then(|| column.fixed_rows::<3>(0).into_owned());
            let poses = eliminated.follow(&dense, last, self.nodes.len());
            (dense, poses)
        });
        let own: Matrix3<f64> = covariance.fixed_view::<3, 3>(kept, kept).into();
        let rays = self.rays();
        let (mut together, mut alone) = (vec![Vector3::zeros(); self.landmarks.len()], Matrix3::zeros());
        for (i, node) in self.nodes.iter().enumerate() {
            self.linearised(node, &rays, |row| {
                let along = RowVector3::from_fn(|_, k| {
                    let (dense, poses) = &columns[k];
                    let by_fixed: f64 = (0..fixed).map(|c| row.by_fixed[c] * dense[c]).sum();
                    let by_landmark = row.by_landmark[0] * dense[row.at] + row.by_landmark[1] * dense[row.at + 1];
                    row.by_pose.dot(&poses[i]) + by_fixed + by_landmark
                });
                alone += along.transpose() * along * row.weight;
                together[(row.at - fixed) / 2] += along.transpose() * (row.weight * row.residual);
            });
        }
        let seen = together.iter().filter(|u| **u != Vector3::zeros()).count() as f64;
        let square = |u: &Vector3<f64>| u * u.transpose();
        let together = together.iter().map(square).sum::<Matrix3<f64>>() * (seen / (seen - 1.0).max(1.0));
        widened(&own, &(own - alone + together))
    }

    /// Whether successive residuals of the landmarks are alike.
    fn common_errors(&self) -> bool {
        let mut before: Vec<Option<f64>> = vec![None; self.landmarks.len()];
        let (mut sum, mut squares) = (0.0, 0.0);
        for (sight, residual) in self.nodes.iter().flat_map(|node| &node.sights).zip(self.residuals()) {
            let now = Some(residual).filter(|r| r.abs() < LIMIT);
            if let (Some(last), Some(now)) = (std::mem::replace(&mut before[sight.landmark], now), now) {
                sum += last * now;
                squares += (last * now).powi(2);
            }
        }
        sum > SIGNIFICANT * squares.sqrt()
    }
}

/// `F` such that `F C F^T` is `wide`, but in no direction narrower than `C`.
pub(super) fn widened(own: &Matrix3<f64>, wide: &Matrix3<f64>) -> Matrix3<f64> {
    let Some(factor) = own.cholesky() else { return Matrix3::identity() };
    let lower = factor.l();
    let Some(inverse) = lower.try_inverse() else { return Matrix3::identity() };
    let ratio = inverse * wide * inverse.transpose();
    let eigen = SymmetricEigen::new(0.5 * (ratio + ratio.transpose()));
    if !eigen.eigenvalues.iter().all(|value| value.is_finite()) {
        return Matrix3::identity();
    }
    let root = Matrix3::from_diagonal(&eigen.eigenvalues.map(|value| value.max(1.0).sqrt()));
    lower * eigen.eigenvectors * root * eigen.eigenvectors.transpose() * inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widens_where_it_should_and_never_narrows() {
        let own = Matrix3::new(4.0, 1.0, 0.5, 1.0, 2.0, 0.3, 0.5, 0.3, 1.0);
        let f = widened(&own, &(own * 4.0));
        assert!((f * own * f.transpose() - own * 4.0).amax() < 1e-12);
        let f = widened(&own, &(own * 0.25));
        assert!((f * own * f.transpose() - own).amax() < 1e-12);
        let more = own + Matrix3::from_diagonal(&Vector3::new(0.0, 3.0, 0.0));
        let f = widened(&own, &more);
        assert!((f * own * f.transpose() - more).amax() < 1e-12);
    }
}
