//! The pose that all rays of all cameras agree on best: joint least squares over the planes of the edges.

use nalgebra::{Cholesky, Matrix2, Matrix3, Matrix6, Rotation3, SMatrix, Vector3, Vector6};

use super::closed_form::attitude::IncludedAngle;
use super::closed_form::prior::rotation_vector;
use super::feature::CornerFeature;
use super::ray::{FittedRay, PlaneMiss};
use crate::geometry::RigidMotion;

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

/// The most Gauss-Newton steps. Convergence is quadratic from the closed form; a hypothesis that needs more does not
/// fit: of 20,000 pairs of corners in rendered images 1,800 ended here, those below the limit of chi-square within 1e-6 of rest.
const STEPS_MAX: usize = 8;

/// The step, in radians and in shares of the distance, below which it has converged: a thousandth of what a perfect
/// image resolves (1e-7).
const CONVERGED: f64 = 1e-10;

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

/// An attitude that is known from elsewhere, in the rig's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct KnownAttitude {
    pub(super) rig_from_object: Matrix3<f64>,
    /// Covariance of the rotation vector of its error, square radians.
    pub(super) covariance: Matrix3<f64>,
}

/// The same with a known attitude, which adds three degrees of freedom.
pub(super) fn fuse_rays_with(
    cameras: &[(&CornerFeature, RigidMotion)],
    angle: &IncludedAngle,
    side: f64,
    rig_from_object: &Matrix3<f64>,
    vertex_m: &Vector3<f64>,
    known_attitude: Option<&KnownAttitude>,
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
        let mut system = LinearSystem::default();
        if let Some(known) = known_attitude {
            system.add_attitude(known, &rotation)?;
        }
        // How the third edge turns when gamma opens.
        let opens = known.is_none().then(|| rotation * Vector3::new(-sin_gamma, 0.0, side * cos_gamma));
        for ((feature, camera_from_rig), weights) in cameras.iter().zip(&weights) {
            let point = camera_from_rig.point(&vertex);
            for (index, ((ray, weight), edge)) in feature.rays().iter().zip(weights).zip(&edges).enumerate() {
                let edge = camera_from_rig.rotation * (rotation * edge);
                let opens = opens.filter(|_| index == 2);
                system.add_ray(ray, weight, &point, &edge, &camera_from_rig.rotation, opens);
            }
        }
        let LinearSystem { mut information, mut pull, mut chi_square, angle: mut opening } = system;
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

/// The normal equations of one Gauss-Newton step.
#[derive(Debug, Clone, Copy)]
struct LinearSystem {
    information: Matrix6<f64>,
    pull: Vector6<f64>,
    chi_square: f64,
    angle: AngleInformation,
}

impl Default for LinearSystem {
    fn default() -> Self {
        let angle = AngleInformation::default();
        Self { information: Matrix6::zeros(), pull: Vector6::zeros(), chi_square: 0.0, angle }
    }
}

/// The normal equations' part of the included angle: its own information, that shared with the pose, and its right-hand side.
#[derive(Debug, Clone, Copy, Default)]
struct AngleInformation {
    information: f64,
    shared: Vector6<f64>,
    pull: f64,
}

impl LinearSystem {
    /// Adds a known attitude; none if its covariance has no inverse.
    fn add_attitude(&mut self, known: &KnownAttitude, rotation: &Matrix3<f64>) -> Option<()> {
        let weight = known.covariance.try_inverse()?;
        let off = rotation_vector(&(rotation * known.rig_from_object.transpose()));
        let mut own = self.information.fixed_view_mut::<3, 3>(0, 0);
        own += weight;
        let mut own = self.pull.fixed_rows_mut::<3>(0);
        own += weight * off;
        self.chi_square += off.dot(&(weight * off));
        Some(())
    }

    /// Adds a ray of a camera that has the vertex at `point` and the ray's edge along `edge`, both in its own frame; `opens` is
    /// how the edge turns with the included angle (rig frame), if that is to be estimated.
    fn add_ray(
        &mut self,
        ray: &FittedRay,
        weight: &Matrix2<f64>,
        point: &Vector3<f64>,
        edge: &Vector3<f64>,
        camera_from_rig: &Matrix3<f64>,
        opens: Option<Vector3<f64>>,
    ) {
        let PlaneMiss { miss, by_plane, chi_square } = ray.missed_by(&point.cross(edge), weight);
        let turned = by_plane * (Matrix3::from_diagonal_element(point.dot(edge)) - edge * point.transpose());
        let moved = by_plane * -edge.cross_matrix();
        let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
        by_pose.fixed_view_mut::<2, 3>(0, 0).copy_from(&(turned * camera_from_rig));
        by_pose.fixed_view_mut::<2, 3>(0, 3).copy_from(&(moved * camera_from_rig));
        let weighted = by_pose.transpose() * weight;
        self.information += weighted * by_pose;
        self.pull += weighted * miss;
        if let Some(opens) = opens {
            let by_gamma = by_plane * point.cross(&(camera_from_rig * opens));
            self.angle.shared += weighted * by_gamma;
            self.angle.information += by_gamma.dot(&(weight * by_gamma));
            self.angle.pull += by_gamma.dot(&(weight * miss));
        }
        self.chi_square += chi_square;
    }
}

/// The inverse covariances of the rays of each camera.
fn weights(cameras: &[(&CornerFeature, RigidMotion)]) -> Option<Vec<[Matrix2<f64>; 3]>> {
    let of = |feature: &CornerFeature| {
        let mut weights = [Matrix2::zeros(); 3];
        for (weight, ray) in weights.iter_mut().zip(feature.rays()) {
            *weight = ray.information()?;
        }
        Some(weights)
    };
    cameras.iter().map(|(feature, _)| of(feature)).collect()
}
