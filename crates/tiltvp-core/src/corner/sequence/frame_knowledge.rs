//! What an inertial sensor knows of a frame.

use nalgebra::{Matrix2, Matrix3, Vector3};

use crate::corner::closed_form::prior::{AttitudePrior, VerticalSense};
use crate::error::{Error, Result};
use crate::filter::positive_semidefinite;
use crate::geometry::{check_rotation, tangent_basis, tangent_log};

/// Standard deviation of an attitude that its covariance does not tell, radians: the attitudes of a real cabinet scatter by 0.7
/// degrees about the truth, where edges are not quite straight or parallel.
pub(super) const UNTOLD_RAD: f64 = 0.7 * std::f64::consts::PI / 180.0;

/// The 99.9 % quantile of chi-square of 2: an upright edge that is farther from gravity's direction is none.
const UPRIGHT_CHI_SQUARE: f64 = 13.8;

/// What is known of one frame beside its images, in the left camera's frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameKnowledge {
    /// Which way is down.
    pub gravity: Option<GravityDirection>,
    /// How the camera has turned since the frame before.
    pub turn: Option<CameraTurn>,
}

/// The direction down, as from an accelerometer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GravityDirection {
    /// Unit vector that points down, left camera's frame.
    pub down: Vector3<f64>,
    /// Standard deviation in any one direction, radians.
    pub sigma_rad: f64,
}

/// How a camera has turned from one frame to the next, as from the rates of a gyroscope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraTurn {
    /// The rotation that takes vectors of the camera's frame now to that at the frame before.
    pub before_from_now: Matrix3<f64>,
    /// Covariance of the rotation vector of its error, camera's frame now, square radians.
    pub covariance: Matrix3<f64>,
}

impl GravityDirection {
    pub(super) fn prior(&self) -> AttitudePrior {
        AttitudePrior::Gravity { down: self.down, sigma_rad: self.sigma_rad, sense: VerticalSense::Either }
    }

    /// Whether the upright axis of an attitude is along this direction, either way, by what both are known to.
    pub(super) fn is_along(&self, camera_from_object: &Matrix3<f64>, covariance: &Matrix3<f64>) -> bool {
        let vertical = camera_from_object.column(1).into_owned();
        let off = tangent_log(&self.down, &(vertical * vertical.dot(&self.down).signum()));
        let turn = tangent_basis(&self.down).transpose() * vertical.cross_matrix();
        let own = turn * covariance * turn.transpose();
        let spread = own + Matrix2::from_diagonal_element(self.sigma_rad.powi(2) + UNTOLD_RAD.powi(2));
        spread.cholesky().is_some_and(|factor| off.dot(&factor.solve(&off)) <= UPRIGHT_CHI_SQUARE)
    }
}

impl FrameKnowledge {
    /// # Errors
    /// [`Error::InvalidArgument`] for a direction that is no unit vector, a standard deviation that
    /// is not positive, and matrices that are no rotation or no covariance.
    pub fn validate(&self) -> Result<()> {
        if let Some(gravity) = &self.gravity {
            gravity.prior().validate()?;
        }
        if let Some(turn) = &self.turn {
            check_rotation("before_from_now", &turn.before_from_now)?;
            if !positive_semidefinite(&turn.covariance) {
                let expected = "a covariance in square radians, symmetric and not negative";
                return Err(Error::argument("gyro", "another matrix", expected));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_direction_or_turn_is_refused() {
        let good = CameraTurn { before_from_now: Matrix3::identity(), covariance: Matrix3::zeros() };
        let gravity = |down, sigma_rad| Some(GravityDirection { down, sigma_rad });
        let known = FrameKnowledge { gravity: gravity(Vector3::y(), 0.1), turn: Some(good) };
        assert!(known.validate().is_ok() && FrameKnowledge::default().validate().is_ok());
        for wrong in [
            FrameKnowledge { gravity: gravity(Vector3::zeros(), 0.1), ..known },
            FrameKnowledge { gravity: gravity(Vector3::y(), 0.0), ..known },
            FrameKnowledge { turn: Some(CameraTurn { before_from_now: Matrix3::zeros(), ..good }), ..known },
            FrameKnowledge { turn: Some(CameraTurn { covariance: -Matrix3::identity(), ..good }), ..known },
        ] {
            assert!(wrong.validate().is_err(), "{wrong:?}");
        }
    }
}
