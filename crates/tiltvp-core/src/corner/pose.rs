//! The pose of a corner before a pair of cameras: attitudes of both, resolved; the vertex triangulated; all rays fused.

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3};

use super::closed_form::attitude::{CornerAttitude, IncludedAngle, corner_attitudes};
use super::closed_form::prior::AttitudePrior;
use super::closed_form::resolve::{Alignment, View, resolve};
use super::closed_form::standard_model::CornerCase;
use super::feature::CornerFeature;
use super::fusion::fuse_rays;
use super::triangulation::triangulate;
use crate::error::{Error, Result};
use crate::geometry::RigidMotion;

/// What is known of a corner before it is looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerOptions {
    /// The angle between the horizontal edges.
    pub angle: IncludedAngle,
    /// Whether the edges x, y, z are a right-handed triple, where the object is known, which separates the interpretations.
    pub right_handed: Option<bool>,
    /// Knowledge of the attitude, in the left camera's frame.
    pub priors: Vec<AttitudePrior>,
    /// Whether all six rays are fused by least squares, which reaches the Cramer-Rao bound; else the attitudes' mean by
    /// their covariances and the triangulated vertex stand as they are.
    pub fuse: bool,
}

impl Default for CornerOptions {
    fn default() -> Self {
        Self { angle: IncludedAngle::RIGHT, right_handed: None, priors: Vec::new(), fuse: true }
    }
}

/// One pose of a corner before a pair of cameras.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerPose {
    /// The rotation from the object's frame to the left camera's; see
    /// [`CornerAttitude::camera_from_object`](super::CornerAttitude).
    pub camera_from_object: Matrix3<f64>,
    /// The vertex, which is the object's origin, in the left camera's frame, metres.
    pub vertex_m: Vector3<f64>,
    /// Covariance of the attitude's rotation vector (left camera's frame, radians) and of the vertex (metres).
    pub covariance: Matrix6<f64>,
    /// The probability that it is this pose and none of the others that the rays admit, in [0, 1].
    pub probability: f64,
    /// Whether it is the second of the two interpretations (fig. 3c) in the left image.
    pub mirrored: bool,
    /// How the edges of the imaginary box stand to the left camera's line of sight.
    pub case: CornerCase,
    /// Whether the edges x, y, z are a right-handed triple.
    pub right_handed: bool,
    /// The squared misses of the rays, each by its covariance: chi-square of six degrees of freedom.
    pub chi_square: f64,
    /// Whether all six rays were fused; where not, the covariances between attitude and vertex are left out.
    pub fused: bool,
}

impl CornerPose {
    /// Where the left camera is in the object's frame, `-R^T P`, metres.
    pub fn camera_in_object_m(&self) -> Vector3<f64> {
        -(self.camera_from_object.transpose() * self.vertex_m)
    }

    /// The covariance of [`camera_in_object_m`](Self::camera_in_object_m), square metres.
    pub fn camera_in_object_covariance_m2(&self) -> Matrix3<f64> {
        let back = self.camera_from_object.transpose();
        let mut by_pose = SMatrix::<f64, 3, 6>::zeros();
        by_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&(back * -self.vertex_m.cross_matrix()));
        by_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&-back);
        by_pose * self.covariance * by_pose.transpose()
    }
}

/// That two cameras are not at one place, from which nothing has a distance.
///
/// # Errors
/// [`Error::InvalidArgument`](crate::Error::InvalidArgument) where they are.
pub(crate) fn check_baseline(left_from_right: &RigidMotion) -> Result<()> {
    if left_from_right.translation_m.norm() <= 0.0 {
        return Err(Error::argument("left_from_right", "no baseline", "two cameras at different places"));
    }
    Ok(())
}

/// Every pose that explains the features of both cameras, the likeliest first; their probabilities add up to 1, but for those below 1e-9
/// that are left out.
///
/// Empty where either feature is no corner of that angle (or hand), and where the vertex is not before both cameras.
///
/// # Errors
/// [`Error::InvalidArgument`](crate::Error::InvalidArgument) for an included angle, priors or a mounting that are none, and for cameras at one
/// place.
pub fn corner_poses(
    left: &CornerFeature,
    right: &CornerFeature,
    left_from_right: &RigidMotion,
    options: &CornerOptions,
) -> Result<Vec<CornerPose>> {
    check_baseline(left_from_right)?;
    let of_left = corner_attitudes(left, &options.angle)?;
    let of_right = corner_attitudes(right, &options.angle)?;
    let views = [
        View { attitudes: &of_left, common_from_camera: Matrix3::identity() },
        View { attitudes: &of_right, common_from_camera: left_from_right.rotation },
    ];
    let resolved = resolve(&views, Alignment::Same, options.right_handed, &options.priors)?;
    let seen = [left.vertex_observation(RigidMotion::identity()), right.vertex_observation(*left_from_right)];
    let Some(vertex) = triangulate(&seen) else { return Ok(Vec::new()) };
    let cameras = [(left, RigidMotion::identity()), (right, left_from_right.inverse())];
    let poses = resolved.iter().filter_map(|resolved| {
        let chosen: &CornerAttitude = of_left.get(*resolved.choice.first()?)?;
        let side = if chosen.is_right_handed() { 1.0 } else { -1.0 };
        let start = &resolved.common_from_object;
        let fused = if options.fuse { fuse_rays(&cameras, &options.angle, side, start, &vertex.point_m) } else { None };
        let mut apart = Matrix6::zeros();
        apart.fixed_view_mut::<3, 3>(0, 0).copy_from(&resolved.covariance);
        apart.fixed_view_mut::<3, 3>(3, 3).copy_from(&vertex.covariance_m2);
        let chi_square = resolved.chi_square + vertex.chi_square + left.chi_square() + right.chi_square();
        Some(CornerPose {
            camera_from_object: fused.map_or(*start, |fused| fused.rig_from_object),
            vertex_m: fused.map_or(vertex.point_m, |fused| fused.vertex_m),
            covariance: fused.map_or(apart, |fused| fused.covariance),
            probability: resolved.probability,
            mirrored: chosen.mirrored,
            case: chosen.case,
            right_handed: chosen.is_right_handed(),
            chi_square: fused.map_or(chi_square, |fused| fused.chi_square),
            fused: fused.is_some(),
        })
    });
    Ok(poses.collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;

    /// A small turn or step of the object moves the camera in the object's frame as the covariance says.
    #[test]
    fn the_camera_stands_in_the_object_where_the_object_stands_before_it() {
        let camera_m = Vector3::new(0.7, -0.4, -2.0);
        let rotation = Rotation3::from_euler_angles(0.3, -0.5, 1.1);
        let pose = |turn: Vector3<f64>, step_m: Vector3<f64>, covariance: Matrix6<f64>| CornerPose {
            camera_from_object: *(Rotation3::new(turn) * rotation).matrix(),
            vertex_m: rotation * -camera_m + step_m,
            covariance,
            probability: 1.0,
            mirrored: false,
            case: CornerCase::AllAway,
            right_handed: true,
            chi_square: 0.0,
            fused: true,
        };
        let at = |turn, step_m| pose(turn, step_m, Matrix6::zeros()).camera_in_object_m();
        let still = Vector3::zeros();
        assert!((at(still, still) - camera_m).norm() < 1e-12);
        for (place, sigma) in [(0, 1e-5), (4, 1e-5)] {
            let moved = Vector3::ith(place % 3, sigma);
            let off = if place < 3 { at(moved, still) } else { at(still, moved) } - camera_m;
            let mut covariance = Matrix6::zeros();
            covariance[(place, place)] = sigma * sigma;
            let told = pose(still, still, covariance).camera_in_object_covariance_m2();
            assert!((told - off * off.transpose()).amax() < 1e-4 * told.amax(), "{told} {off}");
        }
    }
}
