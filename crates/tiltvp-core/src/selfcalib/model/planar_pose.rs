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

/// The Jacobians of [`between`] by its arguments; `b` is its value.
pub(crate) fn between_jacobians(a: &Vector3<f64>, b: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let (sin, cos) = a.z.sin_cos();
    let first = Matrix3::new(-cos, -sin, b.y, sin, -cos, -b.x, 0.0, 0.0, -1.0);
    (first, Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0))
}

/// The Jacobians of [`compose`] by its arguments.
pub(crate) fn compose_jacobians(a: &Vector3<f64>, b: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let (sin, cos) = a.z.sin_cos();
    let first = Matrix3::new(1.0, 0.0, -sin * b.x - cos * b.y, 0.0, 1.0, cos * b.x - sin * b.y, 0.0, 0.0, 1.0);
    (first, Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0))
}

/// The way of the middle of the axle along the arc of a motion, straight ahead and to the left, and the turn, with the Jacobian by the motion.
/// Divided by the time it takes it is the velocity in the frame of the robot, the same all along the arc.
pub(crate) fn along_arc(motion: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let (sin, cos) = (0.5 * motion.z).sin_cos();
    let (x, y) = (cos * motion.x + sin * motion.y, cos * motion.y - sin * motion.x);
    let by_motion = Matrix3::new(cos, sin, 0.5 * y, -sin, cos, -0.5 * x, 0.0, 0.0, 1.0);
    (Vector3::new(x, y, motion.z), by_motion)
}

/// The inverse of [`along_arc`] with its Jacobian: the motion along an arc of so much.
pub(crate) fn arc(along: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let (sin, cos) = (0.5 * along.z).sin_cos();
    let (x, y) = (cos * along.x - sin * along.y, sin * along.x + cos * along.y);
    (Vector3::new(x, y, along.z), Matrix3::new(cos, -sin, -0.5 * y, sin, cos, 0.5 * x, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn along_arcs_and_back(motion in prop::array::uniform3(-2.0..2.0f64)) {
            let motion = Vector3::from(motion);
            let (along, there) = along_arc(&motion);
            let (back, here) = arc(&along);
            prop_assert!((back - motion).amax() < 1e-12 && (there * here - Matrix3::identity()).amax() < 1e-12);
            for axis in 0..3 {
                let mut d = Vector3::zeros();
                d[axis] = 1e-6;
                let difference = (along_arc(&(motion + d)).0 - along_arc(&(motion - d)).0) / 2e-6;
                prop_assert!((difference - there.column(axis)).amax() < 1e-8);
            }
        }

        #[test]
        fn composing_its_inverse_and_their_jacobians(a in prop::array::uniform3(-2.0..2.0f64), b in prop::array::uniform3(-2.0..2.0f64)) {
            let (a, b) = (Vector3::from(a), Vector3::from(b));
            prop_assert!((between(&a, &compose(&a, &b)) - b).amax() < 1e-12);
            let (first, second) = compose_jacobians(&a, &b);
            for axis in 0..3 {
                let mut d = Vector3::zeros();
                d[axis] = 1e-6;
                prop_assert!(((compose(&(a + d), &b) - compose(&(a - d), &b)) / 2e-6 - first.column(axis)).amax() < 1e-8);
                prop_assert!(((compose(&a, &(b + d)) - compose(&a, &(b - d))) / 2e-6 - second.column(axis)).amax() < 1e-8);
            }
            let (first, second) = between_jacobians(&a, &between(&a, &b));
            for axis in 0..3 {
                let mut d = Vector3::zeros();
                d[axis] = 1e-6;
                prop_assert!(((between(&(a + d), &b) - between(&(a - d), &b)) / 2e-6 - first.column(axis)).amax() < 1e-8);
                prop_assert!(((between(&a, &(b + d)) - between(&a, &(b - d))) / 2e-6 - second.column(axis)).amax() < 1e-8);
            }
        }
    }
}
