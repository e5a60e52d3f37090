//! The place of a corner before one camera whose height above it is known.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::agreement::attitude_near;
use super::estimator::CornerPoseEstimator;
use crate::corner::closed_form::attitude::with_vertex;
use crate::corner::estimate::{CornerEstimate, Hypothesis, PlaceVerdict};
use crate::corner::feature::CornerFeature;

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
    let attitude: Matrix3<f64> = pose.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let by_bearing = (Matrix3::identity() - bearing * down.transpose() / drop) * distance_m;
    let by_attitude = -bearing * down.cross(&bearing).transpose() * (distance_m / drop);
    let by_height = bearing * (height_sigma_m / drop);
    let seen = corner.pencil.vertex_covariance;
    // The attitude errs with the bearing of its own vertex; a mean of several corners does by this one's share of it.
    let (own, with) = with_vertex(corner, &pose.edges, gamma_sigma_rad)?;
    let together = attitude * own.try_inverse()? * with;
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
