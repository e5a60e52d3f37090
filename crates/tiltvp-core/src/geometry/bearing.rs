//! Unit bearings: the angle between two, and a basis of the plane tangent to the sphere at one.

use nalgebra::{Matrix3x2, Vector3};

/// The angle between two vectors of any length, in `[0, pi]` radians, exact at both ends.
///
/// Uses `2 atan2(|u - v|, |u + v|)` of the normalised vectors, which keeps its accuracy near 0 and pi where `acos` loses it.
pub fn angle_between(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let (a, b) = (a.normalize(), b.normalize());
    2.0 * (a - b).norm().atan2((a + b).norm())
}

/// Two unit vectors `e1`, `e2` that span the plane orthogonal to a unit bearing `n`, with `e1 x e2 = n`.
///
/// For `n` close to `+z` they are close to `x` and `y`: `e1` and `e2` are the images of `x` and `y` under the smallest
/// rotation that takes `z` to `n`. At `n = -z`, where that rotation is not unique, they are `x` and `-y`.
pub fn tangent_basis(n: &Vector3<f64>) -> Matrix3x2<f64> {
    if n.z < -1.0 + 1e-12 {
        return Matrix3x2::new(1.0, 0.0, 0.0, -1.0, 0.0, 0.0);
    }
    let a = 1.0 / (1.0 + n.z);
    let b = -n.x * n.y * a;
    Matrix3x2::new(1.0 - n.x * n.x * a, b, b, 1.0 - n.y * n.y * a, -n.x, -n.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = Vector3<f64>> {
        (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
            .prop_filter_map("zero", |(x, y, z)| Vector3::new(x, y, z).try_normalize(1e-6))
    }

    proptest! {
        #[test]
        fn tangent_basis_is_right_handed_and_orthonormal(n in unit()) {
            let basis = tangent_basis(&n);
            let (e1, e2) = (basis.column(0).into_owned(), basis.column(1).into_owned());
            prop_assert!((e1.norm() - 1.0).abs() < 1e-9 && (e2.norm() - 1.0).abs() < 1e-9);
            prop_assert!((e1.cross(&e2) - n).norm() < 1e-9);
        }

        #[test]
        fn angle_is_symmetric_and_bounded(a in unit(), b in unit()) {
            let angle = angle_between(&a, &b);
            prop_assert!((0.0..=std::f64::consts::PI).contains(&angle));
            prop_assert!((angle.cos() - a.dot(&b)).abs() < 1e-12);
            prop_assert_eq!(angle, angle_between(&b, &a));
        }
    }
}
