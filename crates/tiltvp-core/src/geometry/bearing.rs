//! Unit bearings: the angle between two, and the plane tangent to the sphere at one: basis, exponential, logarithm.

use nalgebra::{Matrix2, Matrix3x2, Rotation3, Vector2, Vector3};

/// The angle between two vectors of any length, in `[0, pi]` radians, exact at both ends.
///
/// Uses `2 atan2(|u - v|, |u + v|)` of the normalised vectors, which keeps its accuracy near 0 and pi where `acos` loses it.
pub fn angle_between(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let (a, b) = (a.normalize(), b.normalize());
    2.0 * (a - b).norm().atan2((a + b).norm())
}

/// The largest coordinates, either way, between which squares lose no digits: the squares of numbers from 1e-150 to 1e150 are
/// far from the ends of the floats, 1e-308 and 1e308.
const SQUARES: std::ops::RangeInclusive<f64> = 1e-150..=1e150;

/// The same vector, or where squares would lose digits one along it, and how many times shorter that is; NaN along zeros.
#[inline]
pub(crate) fn squarable(v: &Vector3<f64>) -> (Vector3<f64>, f64) {
    let largest = v.amax();
    if SQUARES.contains(&largest) { (*v, 1.0) } else { (v / largest, largest) }
}

/// The unit vector along a vector of any length; none of zeros and of what is not finite.
pub fn unit(v: &Vector3<f64>) -> Option<Vector3<f64>> {
    squarable(v).0.try_normalize(0.0).filter(|unit| unit.iter().all(|x| x.is_finite()))
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

/// The exponential map: the unit bearing at the end of a great-circle arc of `|step|` radians from the unit bearing `n`; `step` is
/// in the basis of [`tangent_basis`].
pub fn tangent_exp(n: &Vector3<f64>, step: &Vector2<f64>) -> Vector3<f64> {
    let length = step.norm();
    if length == 0.0 {
        return *n;
    }
    let along = tangent_basis(n) * (step / length);
    (n * length.cos() + along * length.sin()).normalize()
}

/// The logarithm map: the step from the unit bearing `n` to the unit bearing `to`, in the basis of [`tangent_basis`] at `n`. It is
/// the inverse of [`tangent_exp`] up to a length of pi. To the opposite bearing every direction leads; the first of the basis
/// is taken.
pub fn tangent_log(n: &Vector3<f64>, to: &Vector3<f64>) -> Vector2<f64> {
    let angle = angle_between(n, to);
    match (tangent_basis(n).transpose() * to).try_normalize(f64::MIN_POSITIVE) {
        Some(direction) => direction * angle,
        None if angle < 1.0 => Vector2::zeros(),
        None => Vector2::new(angle, 0.0),
    }
}

/// The rotation that takes tangent vectors at `from` to tangent vectors at `to` along the great circle between the two unit
/// bearings, from the basis of [`tangent_basis`] at the one to that at the other.
pub fn tangent_transport(from: &Vector3<f64>, to: &Vector3<f64>) -> Matrix2<f64> {
    let rotation = Rotation3::rotation_between(from, to).unwrap_or_else(Rotation3::identity);
    let turned = tangent_basis(to).transpose() * rotation.matrix() * tangent_basis(from);
    // Opposite bearings have no shortest arc; the identity is as good a rotation as any.
    if turned.determinant() > 0.5 { turned } else { Matrix2::identity() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bearing() -> impl Strategy<Value = Vector3<f64>> {
        (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
            .prop_filter_map("zero", |(x, y, z)| Vector3::new(x, y, z).try_normalize(1e-6))
    }

    proptest! {
        #[test]
        fn tangent_basis_is_right_handed_and_orthonormal(n in bearing()) {
            let basis = tangent_basis(&n);
            let (e1, e2) = (basis.column(0).into_owned(), basis.column(1).into_owned());
            prop_assert!((e1.norm() - 1.0).abs() < 1e-9 && (e2.norm() - 1.0).abs() < 1e-9);
            prop_assert!((e1.cross(&e2) - n).norm() < 1e-9);
        }

        #[test]
        fn exponential_and_logarithm_are_inverse(n in bearing(), x in -2.0..2.0f64, y in -2.0..2.0f64) {
            let step = Vector2::new(x, y);
            let there = tangent_exp(&n, &step);
            prop_assert!((there.norm() - 1.0).abs() < 1e-14);
            prop_assert!((angle_between(&n, &there) - step.norm()).abs() < 1e-9);
            prop_assert!((tangent_log(&n, &there) - step).norm() < 1e-7);
        }

        #[test]
        fn transport_is_a_rotation_that_keeps_the_arc(n in bearing(), to in bearing()) {
            prop_assume!(n.dot(&to) > -0.99);
            let transport = tangent_transport(&n, &to);
            prop_assert!((transport * transport.transpose() - Matrix2::identity()).norm() < 1e-9);
            // The direction of the arc at its end is the transported direction at its start.
            prop_assert!((transport * tangent_log(&n, &to) + tangent_log(&to, &n)).norm() < 1e-7);
        }

        #[test]
        fn angle_is_symmetric_and_bounded(a in bearing(), b in bearing()) {
            let angle = angle_between(&a, &b);
            prop_assert!((0.0..=std::f64::consts::PI).contains(&angle));
            prop_assert!((angle.cos() - a.dot(&b)).abs() < 1e-12);
            prop_assert_eq!(angle, angle_between(&b, &a));
        }
    }

    #[test]
    fn vectors_of_any_length_have_a_unit() {
        for length in [5e-324, 1e-310, 1e-162, 1e-150, 1.0, 1e150, 1e200, 1e308] {
            let found = unit(&Vector3::new(length, -length, 0.0)).expect("a unit vector");
            assert!((found - Vector3::new(0.5f64.sqrt(), -0.5f64.sqrt(), 0.0)).amax() < 1e-15, "{length}: {found}");
        }
        for wrong in [0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(unit(&Vector3::new(wrong, 0.0, 0.0)), None);
        }
    }
}
