//! The pose that all rays of all cameras agree on best: joint least squares over the planes of the edges.

use nalgebra::{Cholesky, Matrix2, Matrix3, Matrix6, Rotation3, SMatrix, Vector3, Vector6};

use super::attitude::IncludedAngle;
use super::parallels::CommonAttitude;
use super::prior::rotation_vector;
use super::vertex::CornerFeature;
use crate::geometry::{RigidMotion, tangent_basis};

/// A corner in space: attitude and vertex, with covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FusedPose {
    /// The rotation from the object's frame to the rig's.
    pub rig_from_object: Matrix3<f64>,
    /// The vertex in the rig's frame, metres.
    pub vertex_m: Vector3<f64>,
    /// Covariance of the rotation vector (rig frame, radians) and of the vertex (metres), in this order.
    pub covariance: Matrix6<f64>,
    /// The included angle of the horizontal edges, moved as far as the rays ask for and its standard deviation allows.
    pub angle: IncludedAngle,
    /// Sum of the squared misses of the rays and of the included angle: chi-square of six degrees of freedom per camera less
    /// six.
    pub chi_square: f64,
    /// Gauss-Newton steps that were made.
    pub steps: usize,
}

/// The most Gauss-Newton steps.
const STEPS_MAX: usize = 8;

/// The step, in radians and in shares of the distance, below which it has converged.
const CONVERGED: f64 = 1e-10;

/// Variance below which rounding is what is left, square radians.
const VARIANCE_MIN: f64 = 1e-30;

/// Moves a pose to the least squares of the rays of all cameras, each by its covariance, and of the included angle if it has
/// a standard deviation above 0; `side` is 1 if the edge z is on the side of the object's z axis (a right-handed corner),
/// else -1.
///
/// The plane of an edge `E` through the vertex `P`, both in a camera's frame, has the normal `P x E`. With the rays'
/// covariances right this reaches the Cramer-Rao bound.
///
/// `None` for fewer than two cameras, and where the rays leave a direction open.
pub fn fuse_rays(
    cameras: &[(&CornerFeature, RigidMotion)],
    angle: &IncludedAngle,
    side: f64,
    rig_from_object: &Matrix3<f64>,
    vertex_m: &Vector3<f64>,
) -> Option<FusedPose> {
    fuse_rays_with(cameras, angle, side, rig_from_object, vertex_m, None)
}

/// The same with an attitude that is known from elsewhere, which counts three more degrees of freedom.
pub(super) fn fuse_rays_with(
    cameras: &[(&CornerFeature, RigidMotion)],
    angle: &IncludedAngle,
    side: f64,
    rig_from_object: &Matrix3<f64>,
    vertex_m: &Vector3<f64>,
    known_attitude: Option<&CommonAttitude>,
) -> Option<FusedPose> {
    if cameras.len() < 2 {
        return None;
    }
    let (mut rotation, mut vertex, mut gamma) = (*rig_from_object, *vertex_m, angle.gamma_rad);
    let weights = weights(cameras)?;
    let known = (angle.sigma_rad == 0.0).then_some(0.0);
    for steps in 0..=STEPS_MAX {
        let (sin_gamma, cos_gamma) = gamma.sin_cos();
        let edges = [Vector3::x(), Vector3::y(), Vector3::new(cos_gamma, 0.0, side * sin_gamma)];
        let (mut information, mut pull, mut chi_square) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        let mut opening = Opening::default();
        if let Some(known) = known_attitude {
            let weight = known.covariance.try_inverse()?;
            let off = rotation_vector(&(rotation * known.camera_from_object.transpose()));
            let mut own = information.fixed_view_mut::<3, 3>(0, 0);
            own += weight;
            let mut own = pull.fixed_rows_mut::<3>(0);
            own += weight * off;
            chi_square += off.dot(&(weight * off));
        }
        for ((feature, camera_from_rig), weights) in cameras.iter().zip(&weights) {
            let point = camera_from_rig.point(&vertex);
            for (index, ((ray, weight), edge)) in feature.rays().iter().zip(weights).zip(&edges).enumerate() {
                let edge = camera_from_rig.rotation * (rotation * edge);
                let plane = point.cross(&edge);
                let length = plane.norm();
                let normal = plane / length;
                // Against the plane measured: 2 x 3 of a small change of `plane`.
                let basis = tangent_basis(&ray.normal).transpose() / length;
                let by_plane: SMatrix<f64, 2, 3> = basis - basis * normal * normal.transpose();
                let turned = by_plane * (Matrix3::from_diagonal_element(point.dot(&edge)) - edge * point.transpose());
                let moved = by_plane * -edge.cross_matrix();
                let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
                by_pose.fixed_view_mut::<2, 3>(0, 0).copy_from(&(turned * camera_from_rig.rotation));
                by_pose.fixed_view_mut::<2, 3>(0, 3).copy_from(&(moved * camera_from_rig.rotation));
                let miss = tangent_basis(&ray.normal).transpose() * normal;
                let weighted = by_pose.transpose() * weight;
                information += weighted * by_pose;
                pull += weighted * miss;
                if known.is_none() && index == 2 {
                    let wider = rotation * Vector3::new(-sin_gamma, 0.0, side * cos_gamma);
                    let by_gamma = by_plane * point.cross(&(camera_from_rig.rotation * wider));
                    opening.shared += weighted * by_gamma;
                    opening.information += by_gamma.dot(&(weight * by_gamma));
                    opening.pull += by_gamma.dot(&(weight * miss));
                }
                // The other side of the circle is as far as can be.
                chi_square += if normal.dot(&ray.normal) > 0.0 { miss.dot(&(weight * miss)) } else { f64::INFINITY };
            }
        }
        let mut variance = 0.0;
        if known.is_none() {
            let (off, prior) = (gamma - angle.gamma_rad, angle.sigma_rad.powi(-2));
            opening.information += prior;
            opening.pull += off * prior;
            chi_square += off * off * prior;
            variance = opening.information.recip();
            information -= opening.shared * opening.shared.transpose() * variance;
            pull -= opening.shared * (opening.pull * variance);
        }
        // Metres against radians: the distance brings the two to one scale.
        let scale = vertex.norm();
        let units = Vector6::new(1.0, 1.0, 1.0, scale, scale, scale);
        let scaled = Matrix6::from_diagonal(&units) * information * Matrix6::from_diagonal(&units);
        let inverse = Cholesky::new(scaled)?.inverse();
        let step = -(inverse * pull.component_mul(&units));
        if !chi_square.is_finite() || !step.iter().all(|x| x.is_finite()) {
            return None;
        }
        if step.norm() <= CONVERGED || steps == STEPS_MAX {
            let covariance = Matrix6::from_diagonal(&units) * inverse * Matrix6::from_diagonal(&units);
            let own = opening.shared * variance;
            let sigma_rad = known.unwrap_or_else(|| (variance + own.dot(&(covariance * own))).sqrt());
            let angle = IncludedAngle { gamma_rad: gamma, sigma_rad };
            return Some(FusedPose {
                rig_from_object: rotation,
                vertex_m: vertex,
                covariance,
                angle,
                chi_square,
                steps,
            });
        }
        gamma -= variance * (opening.pull + opening.shared.dot(&step.component_mul(&units)));
        rotation = Rotation3::new(step.fixed_rows::<3>(0).into_owned()).matrix() * rotation;
        vertex += step.fixed_rows::<3>(3) * scale;
    }
    None
}

/// What the rays say of the included angle: its own information, that shared with the pose, and where it is pulled to.
#[derive(Debug, Clone, Copy, Default)]
struct Opening {
    information: f64,
    shared: Vector6<f64>,
    pull: f64,
}

/// The inverse covariances of the rays of each camera.
fn weights(cameras: &[(&CornerFeature, RigidMotion)]) -> Option<Vec<[Matrix2<f64>; 3]>> {
    let floor = Matrix2::from_diagonal_element(VARIANCE_MIN);
    let of = |feature: &CornerFeature| {
        let mut weights = [Matrix2::zeros(); 3];
        for (weight, ray) in weights.iter_mut().zip(feature.rays()) {
            *weight = (ray.covariance + floor).try_inverse()?;
        }
        Some(weights)
    };
    cameras.iter().map(|(feature, _)| of(feature)).collect()
}
