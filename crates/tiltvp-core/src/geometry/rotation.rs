//! The check that a matrix is a rotation.

use nalgebra::Matrix3;

use crate::error::{Error, Result};

/// Norm of `R^T R - I` up to which a matrix is a rotation: single precision, as files of other tools have it, leaves 1e-7.
const ROTATION_TOLERANCE: f64 = 1e-6;

/// Refuses a mounting `robot_from_camera` that is no rotation.
///
/// # Errors
/// [`Error::InvalidArgument`] unless the matrix is a rotation to about 1e-6.
pub fn validate_rotation(matrix: &Matrix3<f64>) -> Result<()> {
    check_rotation("robot_from_camera", matrix)
}

/// Refuses an argument of any name that is no rotation.
pub(crate) fn check_rotation(name: &'static str, matrix: &Matrix3<f64>) -> Result<()> {
    let off = (matrix.transpose() * matrix - Matrix3::identity()).norm();
    if off < ROTATION_TOLERANCE && matrix.determinant() > 0.0 {
        return Ok(());
    }
    let got = if matrix.iter().all(|x| x.is_finite()) {
        format!("a matrix with determinant {:.6} and |R^T R - I| = {off:.2e}", matrix.determinant())
    } else {
        "a matrix that is not finite".to_owned()
    };
    Err(Error::argument(name, got, "a rotation: orthonormal columns, determinant 1"))
}
