//! The pose of a pair as the paper has it: the interpretation on which both views agree, and the vertex between the lines of sight.

use nalgebra::{Matrix3, Matrix6};

use super::estimator::CornerPoseEstimator;
use crate::corner::closed_form::attitude::corner_attitudes;
use crate::corner::closed_form::resolve::{Alignment, View, resolve};
use crate::corner::estimate::{CornerEstimate, Hypothesis};
use crate::corner::triangulation::midpoint;
use crate::error::Result;
use crate::geometry::RigidMotion;

/// Degrees of freedom of what two views of one corner disagree in: three of the attitude, and one of the lines of sight, which do
/// not meet.
const FREEDOM: f64 = 4.0;

impl CornerPoseEstimator {
    /// The poses of the one corner of either image. The attitude is the left view's own (eq. 48), of the interpretation that the
    /// right view confirms (III-D, method 1; what is known beforehand is method 2); the vertex is midway between both lines of
    /// sight (III-F).
    pub(super) fn by_paper(&self, estimate: &mut CornerEstimate) -> Result<()> {
        let (Some((_, left_from_right)), [Some(left), Some(right)]) =
            (&self.right, [0, 1].map(|side: usize| estimate.features[side].first()))
        else {
            return Ok(());
        };
        let of_left = corner_attitudes(left, &self.options.angle)?;
        let of_right = corner_attitudes(right, &self.options.angle)?;
        let views = [
            View { attitudes: &of_left, common_from_camera: Matrix3::identity() },
            View { attitudes: &of_right, common_from_camera: left_from_right.rotation },
        ];
        let seen = [left.vertex_observation(RigidMotion::identity()), right.vertex_observation(*left_from_right)];
        let (nearest, farthest) = (self.options.distance_min_m, self.options.distance_max_m);
        let Some(vertex) = midpoint(&seen).filter(|vertex| (nearest..=farthest).contains(&vertex.point_m.norm()))
        else {
            return Ok(());
        };
        let resolved = resolve(&views, Alignment::Same, self.right_handed(), &self.priors(true))?;
        if resolved
            .first()
            .is_none_or(|best| ((best.chi_square + vertex.chi_square) / FREEDOM).sqrt() > self.options.misfit_max)
        {
            return Ok(());
        }
        estimate.hypotheses = resolved
            .iter()
            .filter_map(|resolved| {
                let chosen = of_left.get(*resolved.choice.first()?)?;
                let mut covariance = Matrix6::zeros();
                covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&chosen.covariance);
                covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&vertex.covariance_m2);
                Some(Hypothesis {
                    camera_from_object: chosen.camera_from_object,
                    edges: chosen.edges,
                    vertex_m: Some(vertex.point_m),
                    covariance,
                    probability: resolved.probability,
                    right_handed: chosen.is_right_handed(),
                    misfit: ((resolved.chi_square + vertex.chi_square) / FREEDOM).sqrt(),
                })
            })
            .collect();
        (estimate.chosen_left, estimate.chosen_right) = (vec![0], Some(0));
        Ok(())
    }
}
