//! One ray of a corner: the great circle of an edge's image, fitted, and the side of the vertex on which it lies.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use crate::camera::Camera;
use crate::filter::{restored, symmetric};
use crate::geometry::{GreatCircleFit, fit_great_circle, tangent_basis};

/// The image of one edge of a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedRay {
    /// Unit normal of the great circle that the ray lies on, camera frame. A feature turns it so that the walk from the
    /// vertex to `toward` is a positive turn about it; before that its sign has no meaning.
    pub normal: Vector3<f64>,
    /// Covariance of the normal in square radians, in the plane of [`tangent_basis`] at it.
    pub covariance: Matrix2<f64>,
    /// Unit bearing of a further point on the ray, away from the vertex.
    pub toward: Vector3<f64>,
    /// How many pixels along the ray agree with it; 0 of an edge that is not seen.
    pub support: usize,
    /// Root mean square of the pixels' distances from the great circle, radians.
    pub residual_rms_rad: f64,
}

/// The sum of the variances, the same in any basis but for rounding, in square radians: beyond it products of two are none of a float.
const VARIANCES_MAX: f64 = 1e150 * (1.0 + 1e-9);

/// Variance below which rounding is what is left, square radians: (1e-15 rad)^2.
pub(super) const VARIANCE_MIN: f64 = 1e-30;

impl FittedRay {
    /// The weighted fit to unit bearings with the standard deviation of each across the ray, radians; `toward` is a bearing
    /// near the far end, which is moved onto the circle.
    ///
    /// `None` where no great circle fits (see [`fit_great_circle`]), `toward` is its pole, or there are not as many standard
    /// deviations as bearings.
    pub fn fit(bearings: &[Vector3<f64>], sigma_rad: &[f64], toward: &Vector3<f64>) -> Option<Self> {
        let weighted = bearings.iter().zip(sigma_rad).map(|(bearing, sigma)| (*bearing, sigma.powi(-2)));
        let fit = fit_great_circle(weighted).filter(|_| bearings.len() == sigma_rad.len())?;
        Self::from_fit(&fit, toward, bearings.len())
    }

    /// The fit to pixels whose places have the standard deviation `sigma_px` in every direction, through a camera; pixels
    /// that the camera has no bearing for are left out. `toward_px` is a pixel near the far end.
    ///
    /// What a pixel's noise does to the distance from the circle depends on the lens' Jacobian there and on the circle's
    /// normal, so it is fitted twice.
    pub fn fit_pixels(
        camera: &Camera,
        pixels: &[Vector2<f64>],
        sigma_px: f64,
        toward_px: &Vector2<f64>,
    ) -> Option<Self> {
        let toward = camera.unproject(toward_px)?;
        let seen: Vec<_> = pixels.iter().filter_map(|pixel| camera.unproject_jacobian(pixel)).collect();
        let first = fit_great_circle(seen.iter().map(|(bearing, _)| (*bearing, 1.0)))?;
        let weight = |jacobian: &nalgebra::Matrix3x2<f64>| {
            (sigma_px * sigma_px * (jacobian.transpose() * first.normal).norm_squared()).recip()
        };
        let second = fit_great_circle(seen.iter().map(|(bearing, jacobian)| (*bearing, weight(jacobian))))?;
        Self::from_fit(&second, &toward, seen.len())
    }

    /// From a fitted great circle and a bearing near the far end.
    pub fn from_fit(fit: &GreatCircleFit, toward: &Vector3<f64>, support: usize) -> Option<Self> {
        let toward = (toward - fit.normal * fit.normal.dot(toward)).try_normalize(1e-9)?;
        Some(Self { normal: fit.normal, covariance: fit.covariance, toward, support, residual_rms_rad: fit.rms_rad })
    }

    /// The same ray with the normal reversed.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        let turn = tangent_basis(&-self.normal).transpose() * tangent_basis(&self.normal);
        self.normal = -self.normal;
        self.covariance = restored(&symmetric(&(turn * self.covariance * turn.transpose())));
        // Of a normal that is known exactly in one direction, the turn's rounding leaves a variance on either side of zero.
        for i in 0..2 {
            self.covariance[(i, i)] = self.covariance[(i, i)].max(0.0);
        }
        self
    }

    /// The covariance of the normal as a 3 x 3 matrix of the camera frame, square radians; its null space is the normal.
    pub fn covariance_3d(&self) -> Matrix3<f64> {
        let basis = tangent_basis(&self.normal);
        basis * self.covariance * basis.transpose()
    }

    /// The inverse of the covariance, of which no variance is below that of rounding.
    pub(super) fn information(&self) -> Option<Matrix2<f64>> {
        (self.covariance + Matrix2::from_diagonal_element(VARIANCE_MIN)).try_inverse()
    }

    /// How far a plane is from the ray's, by a normal of any length and by the ray's [`information`](Self::information).
    pub(super) fn missed_by(&self, plane: &Vector3<f64>, information: &Matrix2<f64>) -> PlaneMiss {
        let length = plane.norm();
        let normal = plane / length;
        let across = tangent_basis(&self.normal).transpose();
        let basis = across / length;
        let by_plane = basis - basis * normal * normal.transpose();
        let miss = across * normal;
        let is_near = normal.dot(&self.normal) > 0.0;
        let chi_square = if is_near { miss.dot(&(information * miss)) } else { f64::INFINITY };
        PlaneMiss { miss, by_plane, chi_square }
    }

    /// Whether every number is finite, the bearings of unit length and the variances not negative nor above 1e150.
    pub fn is_valid(&self) -> bool {
        let unit = |v: &Vector3<f64>| (v.norm_squared() - 1.0).abs() < 1e-6;
        // In units of the largest entry, whose square may be none of a float; what is below the floats' own digits is none.
        let scale = self.covariance.amax();
        let c = if scale >= f64::MIN_POSITIVE { self.covariance / scale } else { self.covariance * 0.0 };
        c.iter().all(|x| x.is_finite())
            && self.covariance.trace() <= VARIANCES_MAX
            && (c[(0, 1)] - c[(1, 0)]).abs() <= 1e-9
            && c[(0, 0)] >= 0.0
            && c[(1, 1)] >= 0.0
            && c.determinant() >= -1e-9
            && unit(&self.normal)
            && unit(&self.toward)
    }
}

/// How far a plane through the camera is from that of a ray.
pub(super) struct PlaneMiss {
    /// In the tangent plane at the ray's normal.
    pub(super) miss: Vector2<f64>,
    /// The derivative by the plane's normal, as long as it was given.
    pub(super) by_plane: Matrix2x3<f64>,
    /// Its square in standard deviations of the ray; infinite on the other half of the ray's circle.
    pub(super) chi_square: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn each_bearing_has_a_standard_deviation() {
        let bearings = [0.0, 0.1, 0.2].map(|x: f64| Vector3::new(x, 0.0, 1.0).normalize());
        let fit = |sigmas_rad: &[f64]| FittedRay::fit(&bearings, sigmas_rad, &bearings[2]);
        assert_eq!(fit(&[1e-3; 3]).unwrap().support, 3);
        assert!(fit(&[1e-3; 2]).is_none() && fit(&[1e-3; 4]).is_none());
    }

    #[test]
    fn covariances_are_judged_whatever_their_unit() {
        let ray = |covariance| {
            let normal = Vector3::z();
            FittedRay { normal, covariance, toward: Vector3::x(), support: 2, residual_rms_rad: 0.0 }
        };
        let (good, bad) = (Matrix2::new(2.0, 1.0, 1.0, 0.5), Matrix2::new(2.0, 1.1, 1.1, 0.5));
        for unit in [1e-307, 1e-160, 1.0, 1e149] {
            assert!(ray(good * unit).is_valid(), "{unit:e}");
            assert!(!ray(bad * unit).is_valid(), "{unit:e}");
        }
        assert!(ray(Matrix2::zeros()).is_valid());
        // Numbers of so few digits that they are a covariance one way round alone.
        for few in [[8.443e-319, 1.04553e-318, 1.29472e-318], [1e-322, 5.66e-321, 3.24e-319], [1e-323, 1e-323, 5e-324]]
        {
            let [a, b, c] = few;
            let thin = ray(Matrix2::new(a, b, b, c));
            assert!(thin.is_valid() && thin.reversed().is_valid(), "{few:?}");
        }
        // As large as may be, in a basis in which rounding enlarges it.
        for turn in [0.0, 0.1, 0.7, 1.1] {
            let normal = Vector3::new(-1.0, turn, -1.0).normalize();
            let large = FittedRay { normal, ..ray(Matrix2::new(1e150, 0.0, 0.0, 1e-10)) };
            assert!(
                large.is_valid() && large.reversed().is_valid() && large.reversed().reversed().is_valid(),
                "{turn}"
            );
        }
        for wrong in [f64::NAN, f64::INFINITY, 1e160] {
            assert!(!ray(Matrix2::new(wrong, 0.0, 0.0, 1.0)).is_valid());
            assert!(!ray(Matrix2::new(1.0, wrong, 1.0, 1.0)).is_valid());
        }
    }

    proptest! {
        #[test]
        fn a_ray_that_is_exact_in_one_direction_is_valid_either_way_round(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, variance in 0.0..1.0f64, along in 0.0..6.3f64,
        ) {
            let normal = Vector3::new(x, y, z).normalize();
            let direction = Vector2::new(along.cos(), along.sin());
            let directions = [direction, Vector2::x(), Vector2::y()];
            for direction in directions {
                // Along an axis of the basis on the other side, whose variances rounding takes below zero.
                let turn = tangent_basis(&normal).transpose() * tangent_basis(&-normal);
                let covariance = symmetric(&(turn * direction * direction.transpose() * turn.transpose() * variance));
                let ray = FittedRay { normal, covariance, toward: normal, support: 2, residual_rms_rad: 0.0 };
                prop_assume!(ray.is_valid());
                prop_assert!(ray.reversed().is_valid(), "{:?}", ray.reversed());
                prop_assert!(ray.reversed().reversed().is_valid());
            }
        }

        /// As little of a covariance as may be, which in another basis is less.
        #[test]
        fn a_ray_that_is_only_just_valid_is_so_either_way_round(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, along in 0.0..6.3f64, least in -2e-9..0.0f64,
        ) {
            let normal = Vector3::new(x, y, z).normalize();
            let turn = *nalgebra::Rotation2::new(along).matrix();
            let covariance = symmetric(&(turn * Matrix2::from_diagonal(&Vector2::new(1.0, least)) * turn.transpose()));
            let ray = FittedRay { normal, covariance, toward: normal, support: 2, residual_rms_rad: 0.0 };
            prop_assume!(ray.is_valid());
            prop_assert!(ray.reversed().is_valid(), "{:?}", ray.reversed());
        }
    }
}
