//! Rigid motions of space: a rotation and a translation, named destination first.

use nalgebra::{Matrix3, Matrix4, Vector3};

use super::rotation::check_rotation;
use crate::error::{Error, Result};

/// `p_to = rotation p_from + translation`: `to_from`, as `left_from_right`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion {
    /// Takes directions of the source frame to the destination frame.
    pub rotation: Matrix3<f64>,
    /// The origin of the source frame in the destination frame, metres.
    pub translation_m: Vector3<f64>,
}

impl RigidMotion {
    /// No motion.
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), translation_m: Vector3::zeros() }
    }

    /// From a rotation and a translation; `name` is the caller's name of the motion, for the error.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless the rotation is one to about 1e-6 and the translation finite.
    pub fn new(name: &'static str, rotation: Matrix3<f64>, translation_m: Vector3<f64>) -> Result<Self> {
        check_rotation(name, &rotation)?;
        if !translation_m.iter().all(|x| x.is_finite()) {
            let [x, y, z]: [f64; 3] = translation_m.into();
            return Err(Error::argument(name, format!("the translation ({x}, {y}, {z})"), "finite metres"));
        }
        Ok(Self { rotation, translation_m })
    }

    /// From a homogeneous 4 x 4 matrix.
    ///
    /// # Errors
    /// As [`new`](Self::new), and unless the last row is (0, 0, 0, 1).
    pub fn from_matrix(name: &'static str, matrix: &Matrix4<f64>) -> Result<Self> {
        if matrix.row(3) != nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0) {
            let row = matrix.row(3);
            let got = format!("the last row ({}, {}, {}, {})", row[0], row[1], row[2], row[3]);
            return Err(Error::argument(name, got, "a rigid motion, whose last row is (0, 0, 0, 1)"));
        }
        Self::new(name, matrix.fixed_view::<3, 3>(0, 0).into_owned(), matrix.fixed_view::<3, 1>(0, 3).into_owned())
    }

    /// The inverse motion.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation_m: -(rotation * self.translation_m) }
    }

    /// The point in the destination frame.
    pub fn point(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point_m + self.translation_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn there_and_back() {
        let motion = RigidMotion::new(
            "left_from_right",
            *Rotation3::from_euler_angles(0.1, 0.2, 0.3).matrix(),
            Vector3::new(0.12, 0.0, -0.5),
        )
        .unwrap();
        let point = Vector3::new(1.0, 2.0, 3.0);
        assert!((motion.inverse().point(&motion.point(&point)) - point).norm() < 1e-14);
        let mut matrix = Matrix4::identity();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&motion.rotation);
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&motion.translation_m);
        assert_eq!(RigidMotion::from_matrix("left_from_right", &matrix).unwrap(), motion);
    }

    #[test]
    fn what_is_no_motion() {
        let error = RigidMotion::new("left_from_right", Matrix3::identity() * 2.0, Vector3::zeros()).unwrap_err();
        assert!(error.to_string().starts_with("left_from_right: "), "{error}");
        assert!(RigidMotion::new("a", Matrix3::identity(), Vector3::new(f64::NAN, 0.0, 0.0)).is_err());
        assert!(RigidMotion::from_matrix("a", &(Matrix4::identity() * 1.5)).is_err());
        assert!(RigidMotion::from_matrix("a", &Matrix4::identity()).is_ok());
    }
}
