//! Poses from pairs of corners, one of each image.

use std::f64::consts::{FRAC_PI_2, SQRT_2};

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::agreement::{apart, renamed};
use super::estimator::CornerPoseEstimator;
use super::transfer::upright;
use super::turned_apart::untold_by_turn;
use crate::corner::closed_form::attitude::{IncludedAngle, corner_attitudes};
use crate::corner::closed_form::prior::AttitudePrior;
use crate::corner::detector::CornerDetector;
use crate::corner::estimate::Hypothesis;
use crate::corner::feature::CornerFeature;
use crate::corner::fusion::{FusedPose, KnownAttitude, fuse_rays, fuse_rays_with};
use crate::corner::general::common_attitude::CommonAttitude;
use crate::corner::triangulation::triangulate;
use crate::error::Result;
use crate::geometry::RigidMotion;

/// How far apart attitudes of different hypotheses are, radians: 2 degrees. Fits from two starts end far closer,
/// different interpretations far apart.
const SAME_POSE_RAD: f64 = 0.035;

/// By which factor chi-square of two vertices may exceed that of a corner that is believed: it is exact to first order only.
const VERTEX_SLACK: f64 = 2.0;

/// The standard deviation of a place between two edges, as a share of how far they are apart.
const DOUBLE_SIGMA: f64 = 0.5;

/// How far aside in the image a vertex may be without its rays telling, as a standard deviation in pixels: edges are rounded, and others run
/// a few millimetres beside them. Without it 7.6 % of the places in rooms of seeds 10600 to 10629 have an NEES above 22.5, with it 1.8 %; with
/// 0.2 and 0.4 pixels 1.8 and 1.3 %.
const VERTEX_SIGMA_PX: f64 = 0.3;

/// The standard deviation of an included angle of which nothing is known, radians.
const ANY_ANGLE_RAD: f64 = 1.0;

/// How far the included angle that rays tell may be from that of the options, in standard deviations: one in 100 of those that are right
/// is farther off.
const ANGLE_OFF_SIGMAS: f64 = 2.6;

/// The least probability of a hypothesis that is returned.
const PROBABILITY_MIN: f64 = 1e-9;

impl CornerPoseEstimator {
    /// Every pose that the rays of one corner in both images admit, the likeliest first. The attitudes of either image start the
    /// fit to all six rays, so that a view that alone is weak (two rays in line) does no harm. None of vertices that miss each other by
    /// more than those of a pair of `misfit_most` do.
    pub(super) fn pair_poses(
        &self,
        [left, right]: [&CornerFeature; 2],
        (detector, left_from_right): (&CornerDetector, &RigidMotion),
        priors: &[AttitudePrior],
        common: Option<&CommonAttitude>,
        misfit_most: f64,
    ) -> Result<Vec<Hypothesis>> {
        let cameras = [(left, RigidMotion::identity()), (right, left_from_right.inverse())];
        let seen = [left.vertex_observation(RigidMotion::identity()), right.vertex_observation(*left_from_right)];
        let Some(vertex) = triangulate(&seen) else { return Ok(Vec::new()) };
        // All rays together miss by no less than the vertices alone. Most pairs are of different corners, and end here.
        let freedom = Freedom::of([left, right]);
        let most = common.map_or(freedom.alone, |common| freedom.with_attitude * common.scatter.powi(2));
        if vertex.chi_square > VERTEX_SLACK * most * misfit_most.powi(2) {
            return Ok(Vec::new());
        }
        let turn = common.and_then(|common| common.turned_apart);
        let Some(mut untold) =
            turn.map_or(Some(Matrix6::zeros()), |turn| untold_by_turn(&turn, &seen, &vertex.point_m))
        else {
            return Ok(Vec::new());
        };
        let mut found: Vec<(f64, Hypothesis)> = Vec::new();
        for (corner, rotation) in [(left, Matrix3::identity()), (right, left_from_right.rotation)] {
            for own in corner_attitudes(corner, &self.options.angle)?.iter() {
                let right_handed = own.is_right_handed();
                if self.right_handed().is_some_and(|wanted| wanted != right_handed) {
                    continue;
                }
                let (start, side) = (rotation * own.camera_from_object, if right_handed { 1.0 } else { -1.0 });
                let Some(fused) = fuse_rays(&cameras, &self.options.angle, side, &start, &vertex.point_m) else {
                    continue;
                };
                if self.is_of_another_angle(&cameras, side, &fused) {
                    continue;
                }
                let Some((fused, misfit, inflation)) = self.with_common(&cameras, side, &fused, common, freedom) else {
                    continue;
                };
                let as_seen = fused.rig_from_object;
                let fused = FusedPose { rig_from_object: self.upright(fused.rig_from_object), ..fused };
                let known = |(_, other): &(f64, Hypothesis)| {
                    apart(&other.camera_from_object, &fused.rig_from_object) < SAME_POSE_RAD
                };
                if found.iter().any(known) {
                    continue;
                }
                let spread = fused.covariance.fixed_view::<3, 3>(0, 0).into_owned();
                let prior: f64 = priors.iter().map(|p| p.ln_likelihood(&fused.rig_from_object, &spread)).sum();
                // Real edges miss by more than their covariances; the likelihoods allow for as much as the limit.
                let scale = (0.25 * self.options.misfit_max).max(1.0).powi(2);
                let (sin, cos) = self.options.angle.gamma_rad.sin_cos();
                let edges = [Vector3::x(), Vector3::y(), Vector3::new(cos, 0.0, side * sin)];
                let pose = Hypothesis {
                    camera_from_object: fused.rig_from_object,
                    edges: edges.map(|edge| as_seen * edge),
                    vertex_m: Some(fused.vertex_m),
                    covariance: fused.covariance * inflation,
                    probability: 0.0,
                    right_handed,
                    misfit,
                };
                found.push((prior - 3.0 * misfit * misfit / scale, pose));
            }
        }
        if found.is_empty() {
            return Ok(Vec::new());
        }
        let mut of_place = untold.fixed_view_mut::<3, 3>(3, 3);
        of_place += self.aside_m2([(&self.left, left), (detector, right)], &vertex.point_m);
        for (_, pose) in &mut found {
            pose.covariance += untold;
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best = found.first().map_or(0.0, |(most, _)| *most);
        let total: f64 = found.iter().map(|(ln, _)| (ln - best).exp()).sum();
        let named = |(ln, pose): (f64, Hypothesis)| Hypothesis {
            camera_from_object: self.named(pose.camera_from_object),
            probability: (ln - best).exp() / total,
            ..pose
        };
        Ok(found.into_iter().map(named).filter(|pose| pose.probability >= PROBABILITY_MIN).collect())
    }

    /// The pose with the common attitude, if it is near to that; its misfit in standard deviations of the rays; and the factor by which its
    /// covariance is larger than it seems.
    fn with_common(
        &self,
        cameras: &[(&CornerFeature, RigidMotion)],
        side: f64,
        own: &FusedPose,
        common: Option<&CommonAttitude>,
        freedom: Freedom,
    ) -> Option<(FusedPose, f64, f64)> {
        if let Some(common) = common.and_then(|common| self.parallel(common, own)) {
            return fuse_with(cameras, &self.options.angle, side, own, &common, freedom.with_attitude);
        }
        let misfit = (own.chi_square / freedom.alone).sqrt();
        // Covariances do not include edges that do not quite meet, or belong to more than one object.
        let inflation = if self.is_one_object() { 1.0 } else { (misfit * misfit).max(1.0) };
        Some((*own, misfit, inflation))
    }

    /// Whether the rays of both images contradict the included angle: they fit any other far better, or better a right one, which
    /// corners of rooms have.
    fn is_of_another_angle(&self, cameras: &[(&CornerFeature, RigidMotion)], side: f64, pose: &FusedPose) -> bool {
        let told = self.options.angle;
        let with = |angle: &IncludedAngle| {
            let fused = fuse_rays(cameras, angle, side, &pose.rig_from_object, &pose.vertex_m);
            fused.map_or(f64::INFINITY, |fused| fused.chi_square)
        };
        let far_better = |any: f64| {
            let scatter = (any / (Freedom::ALONE - 1.0)).max(1.0);
            pose.chi_square - any > ANGLE_OFF_SIGMAS.powi(2) * scatter
        };
        let may_be_right = (FRAC_PI_2 - told.gamma_rad).abs() <= ANGLE_OFF_SIGMAS * told.sigma_rad;
        told != IncludedAngle::RIGHT
            && (far_better(with(&IncludedAngle { sigma_rad: ANY_ANGLE_RAD, ..told }))
                || (!may_be_right && with(&IncludedAngle::RIGHT) < pose.chi_square))
    }

    /// How far a place may be across the line of sight without its rays telling, square metres. Where edges are double the place is known
    /// no better than they are apart: aside, as the distance is that of either.
    fn aside_m2(&self, seen: [(&CornerDetector, &CornerFeature); 2], point_m: &Vector3<f64>) -> Matrix3<f64> {
        let double_rad = seen
            .into_iter()
            .zip(&self.scratch)
            .map(|((detector, corner), scratch)| detector.double_edges_rad(corner, scratch))
            .fold(0.0, f64::max);
        let towards = point_m.normalize();
        let untold_rad = match self.left.camera().project_jacobian(&towards) {
            Some((_, by_bearing)) if !self.is_one_object() => VERTEX_SIGMA_PX * SQRT_2 / by_bearing.norm(),
            _ => 0.0,
        };
        (Matrix3::identity() - towards * towards.transpose())
            * ((DOUBLE_SIGMA * double_rad).hypot(untold_rad) * point_m.norm()).powi(2)
    }

    /// The attitude that all edges of the frame have in common, named as a corner's own one that is near to it.
    fn parallel(&self, common: &CommonAttitude, own: &FusedPose) -> Option<CommonAttitude> {
        let named = renamed(&common.camera_from_object, &own.rig_from_object);
        let near = apart(&named, &own.rig_from_object) <= self.options.parallel_max_rad;
        near.then_some(CommonAttitude { camera_from_object: named, ..*common })
    }

    /// The same attitude with its axes in another order if another one than the second is nearest to the vertical: with right
    /// angles any edge of a corner may be the upright one.
    pub(crate) fn upright(&self, attitude: Matrix3<f64>) -> Matrix3<f64> {
        match self.vertical() {
            Some(vertical) if !self.is_one_object() && self.options.angle == IncludedAngle::RIGHT => {
                upright(&attitude, &vertical)
            }
            _ => attitude,
        }
    }
}

/// A corner's pose with the attitude that is known from other edges; its misfit in standard deviations of the rays, which
/// scatter as the other edges do; and the factor by which the covariance is larger than it seems.
fn fuse_with(
    cameras: &[(&CornerFeature, RigidMotion)],
    angle: &IncludedAngle,
    side: f64,
    own: &FusedPose,
    common: &CommonAttitude,
    freedom: f64,
) -> Option<(FusedPose, f64, f64)> {
    let start = &common.camera_from_object;
    let variance = common.scatter * common.scatter;
    let fuse = |inflation: f64| {
        let known = KnownAttitude { rig_from_object: *start, covariance: common.covariance / inflation };
        fuse_rays_with(cameras, angle, side, start, &own.vertex_m, Some(&known))
    };
    // Rays that miss by more than their covariances count less.
    let inflation = |fused: &FusedPose| (fused.chi_square / freedom).max(variance);
    let first = inflation(&fuse(variance)?);
    let fused = fuse(first)?;
    Some((fused, (fused.chi_square / freedom / variance).sqrt(), inflation(&fused)))
}

/// Degrees of freedom of a pair of corners.
#[derive(Debug, Clone, Copy)]
struct Freedom {
    /// Two of each ray that is seen, less six of the pose.
    alone: f64,
    /// The same with three of a known attitude.
    with_attitude: f64,
}

impl Freedom {
    /// Of three edges in two images.
    const ALONE: f64 = 6.0;

    fn of(corners: [&CornerFeature; 2]) -> Self {
        let rays: usize = corners.map(CornerFeature::seen_edges).iter().sum();
        let alone = 2.0 * rays as f64 - 6.0;
        Self { alone, with_attitude: alone + 3.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Model, Pinhole};
    use crate::corner::estimator_options::EstimatorOptions;
    use crate::corner::options::DetectorOptions;

    #[test]
    fn a_place_is_known_no_better_aside_than_edges_are_sharp() {
        let camera =
            Camera::new(1280, 720, Model::Pinhole(Pinhole::new([700.0; 2], [639.5, 359.5], &[]).unwrap())).unwrap();
        let sigma_m = |method: &str, towards: Vector3<f64>| {
            let detector =
                CornerDetector::new(camera.clone(), DetectorOptions::for_method(method).unwrap(), None).unwrap();
            let estimator = CornerPoseEstimator::new(detector.clone(), None, EstimatorOptions::default()).unwrap();
            let vertex = Vector3::new(0.0, 0.0, 2.0);
            let toward = [Vector3::x(), Vector3::y(), Vector3::new(-1.0, -1.0, -1.0)].map(|edge| vertex + 0.3 * edge);
            let corner = CornerFeature::from_bearings(&vertex, &toward).unwrap();
            let aside_m2 = estimator.aside_m2([(&detector, &corner), (&detector, &corner)], &vertex);
            towards.dot(&(aside_m2 * towards)).sqrt()
        };
        let wanted_m = VERTEX_SIGMA_PX / 700.0 * 2.0;
        assert!((sigma_m("general", Vector3::x()) - wanted_m).abs() < 1e-9);
        assert!((sigma_m("general", Vector3::y()) - wanted_m).abs() < 1e-9);
        assert_eq!(sigma_m("general", Vector3::z()), 0.0);
        assert_eq!(sigma_m("coloured", Vector3::x()), 0.0);
    }
}
