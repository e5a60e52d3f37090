//! The place of a corner before one camera whose height above it is known.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::agreement::attitude_near;
use super::estimator::CornerPoseEstimator;
use crate::corner::closed_form::attitude::with_vertex;
use crate::corner::estimate::{CornerEstimate, Hypothesis, PlaceVerdict};
use crate::corner::feature::CornerFeature;
use crate::filter::symmetric;

/// The largest standard deviation of a distance as a share of it. Covariances are to first order; the next order is as much
/// again of what they say, 1 % of the distance here. Larger ones are those of corners at the height of the camera.
pub(super) const SHARE_MAX: f64 = 0.1;

impl CornerPoseEstimator {
    /// Gives the poses from one image the place that the known height above the vertex tells, each its own, and says why the first
    /// has none: where the vertex is not below the camera as far as that is known, where nothing told which edge is the vertical
    /// one or none rises from a corner, where the height tells too little, and beyond the limits of the distance.
    pub(super) fn place_by_height(&self, estimate: &mut CornerEstimate) -> PlaceVerdict {
        let down = self.told_down();
        if !self.is_one_object() {
            let Some(down) = &down else { return PlaceVerdict::NotUpright };
            if !self.take_standing(estimate, down) {
                return PlaceVerdict::NotStanding;
            }
        }
        let (Some(height_m), Some(corner)) =
            (self.options.camera_height_m, estimate.chosen_left.first().and_then(|i| estimate.features[0].get(*i)))
        else {
            return PlaceVerdict::NoScale;
        };
        if down.is_some_and(|down| down.dot(&corner.vertex()) <= 0.0) {
            return PlaceVerdict::NotBelow;
        }
        let mut verdicts = Vec::with_capacity(estimate.hypotheses.len());
        for pose in &mut estimate.hypotheses {
            let height = (height_m, self.options.camera_height_sigma_m);
            let found = placed(pose, corner, height, self.options.angle.sigma_rad);
            let reach = self.options.distance_min_m..=self.options.distance_max_m;
            verdicts.push(match found {
                None => PlaceVerdict::Uncertain,
                Some((vertex_m, _)) if !reach.contains(&vertex_m.norm()) => PlaceVerdict::OutOfReach,
                Some((vertex_m, covariance)) => {
                    (pose.vertex_m, pose.covariance) = (Some(vertex_m), covariance);
                    PlaceVerdict::Told
                }
            });
        }
        verdicts.first().copied().unwrap_or(PlaceVerdict::Told)
    }

    /// Makes the poses those of the best corner that may stand on the floor, if there is one: its upright edge rises from the vertex. A
    /// corner whose upright edge goes down has something below it.
    fn take_standing(&self, estimate: &mut CornerEstimate, down: &Vector3<f64>) -> bool {
        let features = &estimate.features[0];
        let Some(at) = estimate.chosen_left.iter().position(|corner| rises(&features[*corner], down)) else {
            return false;
        };
        if at == 0 {
            return true;
        }
        estimate.chosen_left[..=at].rotate_right(1);
        let (standing, angle) = (&features[estimate.chosen_left[0]], &self.options.angle);
        for pose in &mut estimate.hypotheses {
            let near = attitude_near(standing, angle, &pose.camera_from_object, self.options.agree_max_rad);
            if let Some(own) = near {
                (pose.edges, pose.right_handed) = (own.edges, own.is_right_handed());
            }
        }
        true
    }
}

/// Whether the upright edge of a corner, the one that is the most parallel to the direction down, goes up from its vertex.
fn rises(corner: &CornerFeature, down: &Vector3<f64>) -> bool {
    let vertex = corner.pencil.vertex;
    let falls = (down - vertex * down.dot(&vertex)).normalize();
    let along = corner.pencil.along.map(|along| along.dot(&falls));
    along.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).is_some_and(|upright| upright < 0.0)
}

/// The vertex at the distance `h / (v . u)` along its bearing `v`, with `u` the direction down, and the covariance of attitude and
/// vertex to first order in the errors of the bearing, of the attitude and of the height.
fn placed(
    pose: &Hypothesis,
    corner: &CornerFeature,
    (height_m, height_sigma_m): (f64, f64),
    gamma_sigma_rad: f64,
) -> Option<(Vector3<f64>, Matrix6<f64>)> {
    let bearing = corner.vertex();
    let upright = pose.camera_from_object.column(1).into_owned();
    let down = if upright.dot(&bearing) < 0.0 { -upright } else { upright };
    let drop = down.dot(&bearing);
    let distance_m = height_m / drop;
    let attitude = pose.attitude_covariance();
    let by_bearing = (Matrix3::identity() - bearing * down.transpose() / drop) * distance_m;
    let by_attitude = -bearing * down.cross(&bearing).transpose() * (distance_m / drop);
    let by_height = bearing * (height_sigma_m / drop);
    let seen = corner.pencil.vertex_covariance;
    let (own, with) = with_vertex(corner, &pose.edges, gamma_sigma_rad)?;
    let together = share_of_own(&attitude, &own)? * with;
    let mixed = by_attitude * together * by_bearing.transpose();
    let place = by_bearing * seen * by_bearing.transpose()
        + by_attitude * attitude * by_attitude.transpose()
        + mixed
        + mixed.transpose()
        + by_height * by_height.transpose();
    let cross = attitude * by_attitude.transpose() + together * by_bearing.transpose();
    let known = bearing.dot(&(place * bearing)).sqrt() <= SHARE_MAX * distance_m;
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&attitude);
    covariance.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross);
    covariance.fixed_view_mut::<3, 3>(3, 0).copy_from(&cross.transpose());
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&place);
    (known && covariance.iter().all(|x| x.is_finite())).then_some((bearing * distance_m, covariance))
}

/// By how much an attitude errs with what the rays of one corner alone tell, from the covariances of both: a mean of several corners by this
/// one's share of it, and by all of it where the attitude is worth less than these rays, as then its other errors are not theirs.
fn share_of_own(attitude: &Matrix3<f64>, own: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let factor = own.cholesky()?.l();
    let whitener = factor.try_inverse()?;
    let mut shares = symmetric(&(whitener * attitude * whitener.transpose())).symmetric_eigen();
    shares.eigenvalues.apply(|share| *share = share.min(1.0));
    Some(factor * shares.recompose() * whitener)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Rotation3};

    use super::*;
    use crate::corner::closed_form::attitude::{IncludedAngle, corner_attitudes};
    use crate::corner::ray::FittedRay;

    /// Of an attitude as its rays tell it, of one known better, and of those known worse in all directions and in one.
    #[test]
    fn a_place_by_height_has_a_covariance_however_well_the_attitude_is_known() {
        let turn = Rotation3::from_euler_angles(0.5, 0.3, 0.2);
        let vertex = Vector3::new(0.1, 0.8, 2.0);
        let rays = [0, 1, 2].map(|axis| {
            let end = vertex + turn * Vector3::ith(axis, 0.3);
            let (normal, covariance) = (vertex.cross(&end).normalize(), Matrix2::identity() * 1e-8);
            FittedRay { normal, covariance, toward: end.normalize(), support: 50, residual_rms_rad: 1e-4 }
        });
        let corner = CornerFeature::from_rays(rays).unwrap();
        let found = corner_attitudes(&corner, &IncludedAngle::RIGHT).unwrap();
        for own in found.iter() {
            let about_up = own.edges[1] * own.edges[1].transpose() * 1e-3;
            for attitude in
                [own.covariance, own.covariance * 0.1, own.covariance * 6.25, own.covariance * 0.1 + about_up]
            {
                let mut covariance = Matrix6::zeros();
                covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&attitude);
                let pose = Hypothesis {
                    camera_from_object: own.camera_from_object,
                    edges: own.edges,
                    vertex_m: None,
                    covariance,
                    probability: 1.0,
                    right_handed: true,
                    misfit: 0.0,
                };
                let (_, covariance) = placed(&pose, &corner, (1.2, 0.0), 0.0).unwrap();
                let units = Matrix6::from_diagonal(&covariance.diagonal().map(|variance| variance.sqrt().recip()));
                let least = (units * covariance * units).symmetric_eigenvalues().min();
                assert!(least > -1e-9, "{least}: {covariance}");
            }
        }
    }
}
