//! Attitudes from one image: of the corners that agree, and of most edges.

use nalgebra::{Matrix3, Matrix6};

use super::agreement::{agreement, as_scattered, attitude_near};
use super::estimator::CornerPoseEstimator;
use crate::corner::closed_form::resolve::{Alignment, ResolvedAttitude, View, resolve};
use crate::corner::estimate::{CornerEstimate, CornerVerdict, Hypothesis};
use crate::corner::feature::CornerFeature;
use crate::corner::frame::Frame;
use crate::corner::general::common_attitude::CommonAttitude;
use crate::error::Result;

impl CornerPoseEstimator {
    /// Attitudes from one image: of all features that agree with one another; none where the likeliest one's features contradict
    /// each other or gravity.
    pub(super) fn by_one(&self, common: Option<&CommonAttitude>, estimate: &mut CornerEstimate) -> Result<()> {
        let common = common.filter(|_| self.options.parallel_max_rad > 0.0);
        let members = self.parallel_to(common, &estimate.features[0]);
        let features: Vec<CornerFeature> = members.iter().map(|member| estimate.features[0][*member]).collect();
        let priors = self.priors(self.is_one_object());
        let Some(agreed) = agreement(&features, &self.options.angle, self.options.agree_max_rad, &priors)? else {
            return Ok(());
        };
        let view = |attitudes| View { attitudes, common_from_camera: Matrix3::identity() };
        let views: Vec<View<'_>> = agreed.attitudes.iter().map(view).collect();
        let alignment = if views.len() > 1 { Alignment::Manhattan } else { Alignment::Same };
        let resolved = resolve(&views, alignment, self.right_handed(), &priors)?;
        let covariance_of = |attitude: &ResolvedAttitude| {
            if self.is_one_object() { attitude.covariance } else { as_scattered(attitude, views.len()) }
        };
        let mut hypotheses: Vec<Hypothesis> = resolved
            .iter()
            .filter_map(|resolved| {
                let chosen = agreed.attitudes.first()?.get(*resolved.choice.first()?)?;
                let mut covariance = Matrix6::zeros();
                covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&covariance_of(resolved));
                Some(Hypothesis {
                    camera_from_object: self.named(resolved.common_from_object),
                    edges: chosen.edges,
                    vertex_m: None,
                    covariance,
                    probability: resolved.probability,
                    right_handed: chosen.is_right_handed(),
                    misfit: (resolved.chi_square / (3 * (views.len() - 1)).max(1) as f64).sqrt(),
                })
            })
            .collect();
        let Some(pose) = hypotheses.first_mut() else { return Ok(()) };
        let corners: Vec<&CornerFeature> = agreed.members.iter().map(|member| &features[*member]).collect();
        let may_be = self.take_common(pose, common, &corners);
        if may_be && pose.misfit <= self.options.misfit_max && self.is_upright(pose) {
            let chosen_left = agreed.members.iter().map(|member| members[*member]).collect();
            (estimate.hypotheses, estimate.chosen_left) = (hypotheses, chosen_left);
        }
        Ok(())
    }

    /// The attitude of most edges of one image, at the L-junction with the longest rays, where no corner of three edges tells one.
    pub(super) fn by_l_junction(&mut self, frame: &Frame<'_>, common: &CommonAttitude, estimate: &mut CornerEstimate) {
        if !self.is_told_by_most(common) {
            return;
        }
        if self.is_left_open(&common.covariance) {
            estimate.verdict = CornerVerdict::LeftOpen;
            return;
        }
        let [features, _] = self.l_junctions([frame, frame], &common.camera_from_object);
        let Some(best) = features.into_iter().max_by(|a, b| a.support_score().total_cmp(&b.support_score())) else {
            return;
        };
        let attitude = self.named(self.upright(common.camera_from_object));
        let Some(near) = attitude_near(&best, &self.options.angle, &attitude, self.options.agree_max_rad) else {
            return;
        };
        let mut pose = Hypothesis {
            camera_from_object: attitude,
            edges: near.edges,
            vertex_m: None,
            covariance: Matrix6::zeros(),
            probability: 1.0,
            right_handed: near.is_right_handed(),
            misfit: 0.0,
        };
        if self.take_common(&mut pose, Some(common), &[&best]) && !self.stands_alone(&pose, 1) {
            estimate.chosen_left = vec![estimate.features[0].len()];
            estimate.features[0].push(best);
            estimate.hypotheses = vec![pose];
            estimate.verdict = CornerVerdict::Found;
        }
    }
}
