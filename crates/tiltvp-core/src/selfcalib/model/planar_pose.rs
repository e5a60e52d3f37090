//! Poses in the plane as vectors (x, y, heading): composition, its inverse, and Jacobians. Headings are not wrapped.

use nalgebra::{Matrix3, Vector3};

/// The pose that `b`, given in the frame of the pose `a`, has in the frame in which `a` is given.
pub(crate) fn compose(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let (sin, cos) = a.z.sin_cos();
    Vector3::new(a.x + cos * b.x - sin * b.y, a.y + sin * b.x + cos * b.y, a.z + b.z)
}

/// The pose `b` in the frame of the pose `a`: the inverse of [`compose`].
pub(crate) fn between(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let (sin, cos) = a.z.sin_cos();
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    Vector3::new(cos * dx + sin * dy, cos * dy - sin * dx, b.z - a.z)
}

/// The Jacobians of [`compose`] by its arguments.
pub(crate) fn compose_jacobians(a: &Vector3<f64>, b: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let (sin, cos) = a.z.sin_cos();
    let first = Matrix3::new(1.0, 0.0, -sin * b.x - cos * b.y, 0.0, 1.0, cos * b.x - sin * b.y, 0.0, 0.0, 1.0);
    (first, Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn composing_and_its_jacobians(a in prop::array::uniform3(-2.0..2.0f64), b in prop::array::uniform3(-2.0..2.0f64)) {
            let (a, b) = (Vector3::from(a), Vector3::from(b));
            prop_assert!((between(&a, &compose(&a, &b)) - b).amax() < 1e-12);
            let (first, second) = compose_jacobians(&a, &b);
            for axis in 0..3 {
                let mut d = Vector3::zeros();
                d[axis] = 1e-6;
                prop_assert!(((compose(&(a + d), &b) - compose(&(a - d), &b)) / 2e-6 - first.column(axis)).amax() < 1e-8);
                prop_assert!(((compose(&a, &(b + d)) - compose(&a, &(b - d))) / 2e-6 - second.column(axis)).amax() < 1e-8);
            }
        }
    }
}
