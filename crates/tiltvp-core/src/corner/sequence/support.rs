//! The support of a pose by the other corners of a frame: those whose rays run along the same axes.

use nalgebra::{Matrix3, Vector3};

use super::agreement::SAME_VERTEX_RAD;
use crate::corner::estimate::Hypothesis;
use crate::corner::feature::CornerFeature;
use crate::geometry::RigidMotion;

/// How far a corner's rays may be from the axes to count half: the sine of 1 degree. Doubled, the vertical of an office
/// is 0.107 instead of 0.082 degrees off.
const HALF_SINE: f64 = 0.0175;

/// The score of a pose that no other corner agrees with; one that all agree with scores 1 more, so that agreement can
/// at most double a score. Doubled, the vertical of an office is 0.107 instead of 0.082 degrees off.
const ALONE: f64 = 1.0;

/// One corner that may support a pose.
struct Supporter {
    side: usize,
    vertex: Vector3<f64>,
    /// Normals of its rays, left camera's frame.
    normals: [Vector3<f64>; 3],
    weight: f64,
}

/// The corners of both images.
pub(crate) struct CornerSupport {
    corners: Vec<Supporter>,
    right_from_left: RigidMotion,
}

impl CornerSupport {
    pub(crate) fn new(features: &[Vec<CornerFeature>; 2], left_from_right: &RigidMotion) -> Self {
        let of = |side: usize, rotation: Matrix3<f64>| {
            features[side].iter().map(move |corner| Supporter {
                side,
                vertex: corner.vertex(),
                normals: corner.rays().map(|ray| rotation * ray.normal),
                weight: corner.support_score(),
            })
        };
        let corners = of(0, Matrix3::identity()).chain(of(1, left_from_right.rotation)).collect();
        Self { corners, right_from_left: left_from_right.inverse() }
    }

    /// [`ALONE`] and the share of the other corners, weighted by their length score, whose rays run along the axes of a pose.
    pub(crate) fn of(&self, pose: &Hypothesis) -> f64 {
        let Some(vertex_m) = pose.vertex_m else { return 1.0 };
        let own = [vertex_m, self.right_from_left.point(&vertex_m)];
        let (mut agreeing, mut all) = (0.0, 0.0);
        // The pose's own vertex adds nothing new.
        for corner in self.corners.iter().filter(|corner| corner.vertex.angle(&own[corner.side]) > SAME_VERTEX_RAD) {
            let off = |normal: &Vector3<f64>| pose.camera_from_object.tr_mul(normal).abs().min();
            let most = corner.normals.iter().map(off).fold(0.0, f64::max);
            agreeing += corner.weight / (1.0 + (most / HALF_SINE).powi(2));
            all += corner.weight;
        }
        ALONE + if all > 0.0 { agreeing / all } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Rotation3};

    fn corner(rotation: &Matrix3<f64>, vertex: Vector3<f64>) -> CornerFeature {
        let toward = [0, 1, 2].map(|axis| vertex + 0.3 * rotation.column(axis).into_owned());
        CornerFeature::from_bearings(&vertex, &toward).unwrap()
    }

    fn pose(rotation: Matrix3<f64>, vertex: Vector3<f64>) -> Hypothesis {
        Hypothesis {
            camera_from_object: rotation,
            edges: [0, 1, 2].map(|axis| rotation.column(axis).into_owned()),
            vertex_m: Some(vertex),
            covariance: Matrix6::identity(),
            probability: 1.0,
            right_handed: true,
            misfit: 0.0,
        }
    }

    #[test]
    fn parallel_corners_support_a_pose_and_its_own_does_not() {
        let left_from_right = RigidMotion { rotation: Matrix3::identity(), translation_m: Vector3::x() * 0.12 };
        let rotation = *Rotation3::from_euler_angles(0.4, 0.5, 0.1).matrix();
        let (own, other) = (Vector3::new(0.1, 0.0, 2.0), Vector3::new(-0.5, 0.2, 1.5));
        let features = [
            vec![corner(&rotation, own), corner(&rotation, other)],
            vec![corner(&rotation, other - Vector3::x() * 0.12)],
        ];
        let corners = CornerSupport::new(&features, &left_from_right);
        let turned = |degrees: f64| {
            let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), degrees.to_radians());
            corners.of(&pose(turn.matrix() * rotation, own))
        };
        assert!((turned(0.0) - (ALONE + 1.0)).abs() < 1e-9);
        assert!(turned(1.0) < turned(0.3) && turned(10.0) < ALONE + 0.1);
        let alone = [vec![corner(&rotation, own)], Vec::new()];
        assert_eq!(CornerSupport::new(&alone, &left_from_right).of(&pose(rotation, own)), ALONE + 1.0);
    }
}
