//! How far edges of both images are turned against each other beside the calibration, and what poses are worth then.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3};

use super::height::SHARE_MAX;
use crate::corner::closed_form::prior::rotation_vector;
use crate::corner::general::attitude_of_most::MOST;
use crate::corner::general::common_attitude::{ERRING_TOGETHER, StraightEdge, common_attitude};
use crate::corner::triangulation::{BearingObservation, triangulate};
use crate::geometry::RigidMotion;

/// The 95 % quantile of chi-square of 3. Where the attitudes of both images are farther apart, the calibration is off
/// or the images are of two times. Of 119 pairs of ten rendered rooms with right calibration none has more than 1.3.
const DOUBT_CHI_SQUARE: f64 = 7.8;

/// The attitude from both images lies between those of either, and may be off by half of how far these are apart.
const BETWEEN: f64 = 0.5;

/// The rotation vector from the attitude of the right image's straight edges to that of the left one's, along the same
/// axes, both in the left camera's frame; none where that may be noise, or where most edges of an image run otherwise.
/// Both images show the same edges, so that what errs together turns both alike.
pub(super) fn turned_apart(
    [left, right]: &[Vec<StraightEdge>; 2],
    camera_from_object: &Matrix3<f64>,
) -> Option<Vector3<f64>> {
    let of_most = |lines: &[StraightEdge]| {
        common_attitude(lines, camera_from_object).filter(|common| common.support >= MOST * lines.len() as f64)
    };
    let (left, right) = (of_most(left)?, of_most(right)?);
    let covariance = (left.covariance + right.covariance) / ERRING_TOGETHER;
    let turn = rotation_vector(&(left.camera_from_object * right.camera_from_object.transpose()));
    let by_noise = turn.dot(&(covariance.try_inverse()? * turn));
    (by_noise > DOUBT_CHI_SQUARE).then_some(turn)
}

/// What covariances of attitude and vertex do not say of a pair that is turned apart: the attitude may be off by half
/// of that, the vertex by as much as it moves if the right camera is turned back. None where it moves by more than the
/// largest share of its distance, or behind a camera.
pub(super) fn untold_by_turn(
    turn: &Vector3<f64>,
    [left, right]: &[BearingObservation; 2],
    vertex_m: &Vector3<f64>,
) -> Option<Matrix6<f64>> {
    let rotation = Rotation3::new(*turn).matrix() * right.rig_from_camera.rotation;
    let turned = BearingObservation { rig_from_camera: RigidMotion { rotation, ..right.rig_from_camera }, ..*right };
    let moved_m = triangulate(&[*left, turned])?.point_m - vertex_m;
    if moved_m.norm() > SHARE_MAX * vertex_m.norm() {
        return None;
    }
    let attitude = turn * BETWEEN;
    let mut untold = Matrix6::zeros();
    untold.fixed_view_mut::<3, 3>(0, 0).copy_from(&(attitude * attitude.transpose()));
    untold.fixed_view_mut::<3, 3>(3, 3).copy_from(&(moved_m * moved_m.transpose()));
    Some(untold)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Matrix2;

    use super::*;
    use crate::corner::general::common_attitude::tests::lines;

    #[test]
    fn a_turn_that_noise_does_not_make_is_told() {
        let left = *Rotation3::from_euler_angles(0.4, 0.5, 0.1).matrix();
        let told = |turn: Vector3<f64>| {
            let right = Rotation3::new(-turn).matrix() * left;
            turned_apart(&[&left, &right].map(|attitude| lines(attitude, 12, &[0.001, -0.001])), &left)
        };
        assert_eq!((told(Vector3::zeros()), told(Vector3::y() * 1e-3)), (None, None));
        let turn = Vector3::y() * 0.01;
        assert!((told(turn).unwrap() - turn).norm() < 1e-3, "{:?}", told(turn));
        let few = [12, 3].map(|count| lines(&left, count, &[0.0]));
        assert_eq!(turned_apart(&few, &left), None);
    }

    #[test]
    fn a_place_is_worth_what_a_turn_back_of_the_right_camera_moves_it() {
        let vertex = Vector3::new(0.0, 0.0, 2.0);
        let apart_m = RigidMotion { rotation: Matrix3::identity(), translation_m: Vector3::x() * 0.12 };
        let both = [RigidMotion::identity(), apart_m].map(|rig_from_camera| BearingObservation {
            bearing: (vertex - rig_from_camera.translation_m).normalize(),
            covariance: Matrix2::identity() * 1e-8,
            rig_from_camera,
        });
        let untold_by = |turn_rad: f64| untold_by_turn(&(Vector3::y() * turn_rad), &both, &vertex);
        let untold = untold_by(1e-3).unwrap();
        assert!((untold[(1, 1)].sqrt() - 0.5e-3).abs() < 1e-12);
        // A turn t about the vertical moves what is at the distance Z by Z^2 t / b.
        let moved_m = 2.0 * 2.0 * 1e-3 / 0.12;
        assert!((untold[(5, 5)].sqrt() / moved_m - 1.0).abs() < 0.03, "{untold}");
        assert_eq!((untold_by(0.02), untold_by(-0.08)), (None, None));
    }
}
