//! What is known of the attitude beforehand: the vertical, the camera's elevation, or a whole attitude.

use nalgebra::{Matrix2, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::error::{Error, Result};
use crate::filter::positive_semidefinite;
use crate::geometry::{tangent_basis, tangent_log, validate_rotation};

/// Which way a corner's vertical edge runs from the vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum VerticalSense {
    /// Either way, both alike.
    #[default]
    Either,
    /// Down, as from a table's corner.
    Down,
    /// Up, as from a corner on the floor.
    Up,
}

impl VerticalSense {
    /// Every sense.
    pub const ALL: [Self; 3] = [Self::Either, Self::Down, Self::Up];

    /// Its name: `"either"`, `"down"` or `"up"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Either => "either",
            Self::Down => "down",
            Self::Up => "up",
        }
    }

    /// The signs with which the vertical edge may point down.
    fn signs(self) -> &'static [f64] {
        match self {
            Self::Either => &[1.0, -1.0],
            Self::Down => &[1.0],
            Self::Up => &[-1.0],
        }
    }
}

/// Knowledge beforehand, which chooses between hypotheses and does not move them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AttitudePrior {
    /// The direction of gravity in the camera's frame, as from an accelerometer at rest.
    Gravity {
        /// Unit vector that points down, camera frame.
        down: Vector3<f64>,
        /// Standard deviation in any one direction, radians.
        sigma_rad: f64,
        /// Which way the vertical edge runs.
        sense: VerticalSense,
    },
    /// How far the optical axis points above the horizon (method 2 of Liu et al. 2018 knows its sign).
    Elevation {
        /// Angle above the horizon, radians: positive looks up.
        elevation_rad: f64,
        /// Its standard deviation, radians.
        sigma_rad: f64,
        /// Which way the vertical edge runs.
        sense: VerticalSense,
    },
    /// A whole attitude, as of the frame before.
    Attitude {
        /// The rotation that takes vectors of the object's frame to the camera's.
        camera_from_object: Matrix3<f64>,
        /// Covariance of the rotation vector, camera frame, of its error, square radians.
        covariance: Matrix3<f64>,
    },
}

impl AttitudePrior {
    /// # Errors
    /// [`Error::InvalidArgument`] for a direction of no length, a standard deviation that is not positive, and a matrix that
    /// is no rotation or no covariance.
    pub fn validate(&self) -> Result<()> {
        let positive = |sigma_rad: f64| {
            if sigma_rad > 0.0 && sigma_rad.is_finite() {
                return Ok(());
            }
            Err(Error::argument("sigma_rad", sigma_rad, "a standard deviation above 0, finite"))
        };
        match self {
            Self::Gravity { down, sigma_rad, .. } => {
                let off = (down.norm_squared() - 1.0).abs();
                if off >= 1e-6 || off.is_nan() {
                    let [x, y, z]: [f64; 3] = (*down).into();
                    return Err(Error::argument("down", format!("({x}, {y}, {z})"), "a unit vector"));
                }
                positive(*sigma_rad)
            }
            Self::Elevation { elevation_rad, sigma_rad, .. } => {
                if elevation_rad.abs() > std::f64::consts::FRAC_PI_2 || elevation_rad.is_nan() {
                    return Err(Error::argument("elevation_rad", elevation_rad, "an angle in [-pi/2, pi/2]"));
                }
                positive(*sigma_rad)
            }
            Self::Attitude { camera_from_object, covariance } => {
                validate_rotation(camera_from_object)?;
                if positive_semidefinite(covariance) && covariance.trace() > 0.0 {
                    return Ok(());
                }
                Err(Error::argument("covariance", "a matrix that is none", "a covariance, symmetric and not negative"))
            }
        }
    }

    /// The logarithm of the likelihood of an attitude with this covariance, without the constant that all share.
    pub(crate) fn ln_likelihood(&self, rotation: &Matrix3<f64>, covariance: &Matrix3<f64>) -> f64 {
        let vertical = rotation.column(1).into_owned();
        match self {
            Self::Gravity { down, sigma_rad, sense } => {
                let turn = tangent_basis(down).transpose() * vertical.cross_matrix();
                let spread =
                    turn * covariance * turn.transpose() + Matrix2::from_diagonal_element(sigma_rad * sigma_rad);
                let (Some(weight), volume) = (spread.try_inverse(), spread.determinant()) else {
                    return f64::NEG_INFINITY;
                };
                mixture(sense.signs().iter().map(|sign| {
                    let off = tangent_log(down, &(vertical * *sign));
                    -0.5 * (off.dot(&(weight * off)) + volume.ln())
                }))
            }
            Self::Elevation { elevation_rad, sigma_rad, sense } => {
                let aside = vertical.cross(&Vector3::z());
                let level = aside.norm();
                let variance = sigma_rad * sigma_rad
                    + aside.try_normalize(1e-12).map_or(0.0, |aside| aside.dot(&(covariance * aside)));
                mixture(sense.signs().iter().map(|sign| {
                    let off = (-sign * vertical.z).atan2(level) - elevation_rad;
                    -0.5 * (off * off / variance + variance.ln())
                }))
            }
            Self::Attitude { camera_from_object, covariance: own } => {
                gaussian(&rotation_vector(&(rotation * camera_from_object.transpose())), &(covariance + own)).1
            }
        }
    }
}

/// The logarithm of the mean of likelihoods given by their logarithms.
fn mixture(logarithms: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = logarithms.clone().fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY {
        return largest;
    }
    let count = logarithms.clone().count() as f64;
    largest + (logarithms.map(|x| (x - largest).exp()).sum::<f64>() / count).ln()
}

/// Variance that keeps the covariance of exact attitudes invertible, square radians: (1e-12 rad)^2, the rounding of an
/// attitude.
const VARIANCE_MIN: f64 = 1e-24;

/// By how much rounding may carry a variance below 0, as a share of the sum of all: some fifty products of three numbers each.
pub(super) const ROUNDING: f64 = 1e-14;

/// The squared Mahalanobis length of a rotation vector, and the logarithm of its density without the constant.
pub(crate) fn gaussian(off: &Vector3<f64>, covariance: &Matrix3<f64>) -> (f64, f64) {
    let rounding = ROUNDING * covariance.trace();
    if (covariance - Matrix3::from_diagonal_element(rounding)).cholesky().is_none() {
        // Known exactly in some direction: the cofactors of such a matrix, of which its inverse is made, are rounding.
        let raised = covariance + Matrix3::from_diagonal_element(rounding.max(VARIANCE_MIN));
        return raised.cholesky().map_or((f64::INFINITY, f64::NEG_INFINITY), |factor| {
            let square = off.dot(&factor.solve(off));
            (square, -0.5 * square - factor.l().diagonal().map(f64::ln).sum())
        });
    }
    let covariance = covariance + Matrix3::from_diagonal_element(VARIANCE_MIN);
    match covariance.try_inverse() {
        Some(inverse) => {
            let square = off.dot(&(inverse * off));
            (square, -0.5 * (square + covariance.determinant().ln()))
        }
        None => (f64::INFINITY, f64::NEG_INFINITY),
    }
}

/// The rotation vector of a rotation, of length in [0, pi].
pub(crate) fn rotation_vector(rotation: &Matrix3<f64>) -> Vector3<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation)).scaled_axis()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_elevation_weighs_by_its_own_variance_and_the_attitudes_about_the_level_axis() {
        let (elevation_rad, sigma_rad) = (0.2, 0.1);
        let prior = AttitudePrior::Elevation { elevation_rad, sigma_rad, sense: VerticalSense::Down };
        // Of these only the variance about x, the axis that a nod turns about, moves the elevation of a camera held level.
        for about_x in [0.0, 0.03] {
            let covariance = Matrix3::from_diagonal(&Vector3::new(about_x, 5.0, 7.0));
            let variance = sigma_rad * sigma_rad + about_x;
            for nod in [0.0_f64, -0.2, 0.3] {
                let rotation = *Rotation3::from_axis_angle(&Vector3::x_axis(), nod).matrix();
                let off = -nod.sin().atan2(nod.cos()) - elevation_rad;
                let expected = -0.5 * (off * off / variance + variance.ln());
                let found = prior.ln_likelihood(&rotation, &covariance);
                assert!((found - expected).abs() < 1e-12, "{about_x} {nod}: {found} {expected}");
            }
        }
    }

    #[test]
    fn an_attitude_weighs_by_the_sum_of_both_covariances() {
        let camera_from_object = *Rotation3::new(Vector3::new(0.3, -0.2, 0.5)).matrix();
        let own = Matrix3::from_diagonal(&Vector3::new(0.02, 0.03, 0.05));
        let covariance = Matrix3::new(0.01, 0.002, 0.0, 0.002, 0.04, -0.001, 0.0, -0.001, 0.09);
        let prior = AttitudePrior::Attitude { camera_from_object, covariance: own };
        let off = Vector3::new(0.05, -0.1, 0.02);
        let found = prior.ln_likelihood(&(Rotation3::new(off).matrix() * camera_from_object), &covariance);
        let sum = own + covariance;
        let square = off.dot(&sum.lu().solve(&off).unwrap());
        assert!((found + 0.5 * (square + sum.determinant().ln())).abs() < 1e-9, "{found}");
    }

    #[test]
    fn an_attitude_that_is_known_but_for_one_turn_has_a_likelihood() {
        for k in 0..200 {
            let turn = Rotation3::new(Vector3::new(0.01, 0.02, -0.03) * f64::from(k));
            let axis = turn * Vector3::new(0.3, 0.5, 0.8).normalize();
            let (square, ln_density) = gaussian(&(axis * 0.01), &(axis * axis.transpose() * 0.1));
            assert!((square / 1e-3 - 1.0).abs() < 0.1 && ln_density > 0.0, "{square} {ln_density}");
        }
    }
}
