//! The two parts of a lean put together: the floor's, seen in the frame of the wheels, and the robot's own on top of it.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::geometry::{Tilt, tangent_basis};

/// The rotation `B(m)` from the frame of the wheels to the robot's: the smallest that takes `z` to `m`.
pub(super) fn robot_from_wheels(mounting: &Vector3<f64>) -> Matrix3<f64> {
    Tilt::from_normal(mounting).unwrap_or(Tilt::UPRIGHT).leaning_from_upright()
}

/// The ground normal in the robot's frame, `n = B(m) f`.
pub(super) fn normal_of(floor: &Vector3<f64>, mounting: &Vector3<f64>) -> Vector3<f64> {
    (robot_from_wheels(mounting) * floor).normalize()
}

/// The Jacobians of [`normal_of`] by small walks of the floor's part and of the mounting, in the tangent bases at `f`, `m`
/// and `n`.
///
/// With `a = 1 / (1 + m_z)` and `q = m_x f_x + m_y f_y`, the formula of the tangent basis gives
///
/// ```text
/// n_xy = f_xy + m_xy (f_z - a q),   n_z = m_z f_z - q
/// ```
pub(super) fn jacobians(floor: &Vector3<f64>, mounting: &Vector3<f64>) -> (Matrix2<f64>, Matrix2<f64>) {
    let normal = normal_of(floor, mounting);
    let at_normal = tangent_basis(&normal).transpose();
    let by_floor = at_normal * robot_from_wheels(mounting) * tangent_basis(floor);
    let (f, m): (Vector2<f64>, Vector2<f64>) = (floor.xy(), mounting.xy());
    let a = 1.0 / (1.0 + mounting.z).max(f64::EPSILON);
    let q = m.dot(&f);
    let plane = Matrix2::identity() * (floor.z - a * q) - m * f.transpose() * a;
    let by_z = m * (q * a * a);
    let derivative =
        Matrix3::new(plane[(0, 0)], plane[(0, 1)], by_z.x, plane[(1, 0)], plane[(1, 1)], by_z.y, -f.x, -f.y, floor.z);
    (by_floor, at_normal * derivative * tangent_basis(mounting))
}

/// What two measurement covariances have in common: the largest covariance of the form below both that shares their
/// principal axes, `min(A, B)` where they commute.
pub(super) fn common_part(a: &Matrix2<f64>, b: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let lower = a.cholesky()?.l();
    let inverse = lower.try_inverse()?;
    let relative = inverse * b * inverse.transpose();
    let eigen = (0.5 * (relative + relative.transpose())).symmetric_eigen();
    let axes = lower * eigen.eigenvectors;
    Some(axes * Matrix2::from_diagonal(&eigen.eigenvalues.map(|value| value.min(1.0))) * axes.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::positive_semidefinite;
    use crate::geometry::{tangent_exp, tangent_log};
    use proptest::prelude::*;

    fn lean() -> impl Strategy<Value = Vector3<f64>> {
        (0.0..0.5f64, -3.0..3.0f64).prop_map(|(alpha, beta)| Tilt::from_alpha_beta(alpha, beta).normal())
    }

    proptest! {
        #[test]
        fn jacobians_are_those_of_central_differences(floor in lean(), mounting in lean()) {
            let normal = normal_of(&floor, &mounting);
            let (by_floor, by_mounting) = jacobians(&floor, &mounting);
            let step = 1e-6;
            for axis in 0..2 {
                let mut walk = Vector2::zeros();
                walk[axis] = step;
                let way = |f: &Vector3<f64>, m: &Vector3<f64>| tangent_log(&normal, &normal_of(f, m));
                let floors = way(&tangent_exp(&floor, &walk), &mounting) - way(&tangent_exp(&floor, &-walk), &mounting);
                let mounts = way(&floor, &tangent_exp(&mounting, &walk)) - way(&floor, &tangent_exp(&mounting, &-walk));
                prop_assert!((floors / (2.0 * step) - by_floor.column(axis)).norm() < 1e-7);
                prop_assert!((mounts / (2.0 * step) - by_mounting.column(axis)).norm() < 1e-7);
            }
        }

        #[test]
        fn the_common_part_is_below_both(
            a in 0.1..3.0f64, b in 0.1..3.0f64, c in 0.1..3.0f64, d in 0.1..3.0f64, e in -0.9..0.9f64, f in -0.9..0.9f64,
        ) {
            let of = |x: f64, y: f64, r: f64| Matrix2::new(x * x, r * x * y, r * x * y, y * y);
            let (one, other) = (of(a, b, e), of(c, d, f));
            let common = common_part(&one, &other).unwrap();
            prop_assert!(positive_semidefinite(&(one - common)) || (one - common).amax() < 1e-12);
            prop_assert!(positive_semidefinite(&(other - common)) || (other - common).amax() < 1e-12);
            prop_assert!((common - common_part(&other, &one).unwrap()).amax() < 1e-9);
        }
    }

    #[test]
    fn the_common_part_of_round_covariances_is_the_smaller() {
        let (small, large) = (Matrix2::identity(), Matrix2::identity() * 3.0);
        assert!((common_part(&small, &large).unwrap() - small).amax() < 1e-12);
        assert!((common_part(&large, &small).unwrap() - small).amax() < 1e-12);
    }
}
