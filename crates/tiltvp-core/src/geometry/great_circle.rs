//! The great circle that many bearings lie on: weighted least squares, with covariance.

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::bearing::tangent_basis;

/// The least mean square of the bearings' distances from their own mean along the circle, square radians: 1e-7 rad, some hundred
/// times the rounding of the square root of a moment (`no_circle_through_one_point`).
const LEAST_SPREAD: f64 = 1e-14;

/// A great circle fitted to bearings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GreatCircleFit {
    /// Unit normal of the circle's plane; its sign has no meaning.
    pub normal: Vector3<f64>,
    /// Covariance of the normal in square radians, in the plane of [`tangent_basis`] at it, if the weights are the inverse
    /// variances of the bearings' distances from the circle.
    pub covariance: Matrix2<f64>,
    /// Weighted root mean square of the bearings' distances from the circle, radians.
    pub rms_rad: f64,
    /// Sum of the weighted squared distances: chi-square of two degrees of freedom less than bearings.
    pub chi_square: f64,
}

/// The least sine of the angle between two circles that meet in a place: at 3 degrees it is 20 times less sure than they are.
const MEETING_SINE: f64 = 0.05;

/// Where two great circles meet, by their unit normals: of the two opposite places that on the side of `near`. `None` for circles
/// that nearly coincide.
pub(crate) fn meeting(a: &Vector3<f64>, b: &Vector3<f64>, near: &Vector3<f64>) -> Option<Vector3<f64>> {
    let place = a.cross(b).try_normalize(MEETING_SINE)?;
    Some(if place.dot(near) < 0.0 { -place } else { place })
}

/// The great circle that minimises `sum w (n . b)^2` over unit normals `n`, for unit bearings `b` and weights `w` in
/// 1 / rad^2: the eigenvector of `sum w b b^T` with the least eigenvalue.
///
/// `None` for fewer than two bearings of positive weight, for bearings that all coincide (or are opposite), and where
/// anything is not finite.
pub fn fit_great_circle(weighted: impl IntoIterator<Item = (Vector3<f64>, f64)>) -> Option<GreatCircleFit> {
    let (mut moments, mut total, mut count) = (Matrix3::zeros(), 0.0, 0_usize);
    for (bearing, weight) in weighted {
        if weight > 0.0 {
            moments += bearing * bearing.transpose() * weight;
            total += weight;
            count += 1;
        }
    }
    if count < 2 || !moments.iter().all(|x| x.is_finite()) || !total.is_finite() {
        return None;
    }
    let eigen = (moments / total).symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let normal = eigen.eigenvectors.column(least).normalize();
    let basis = tangent_basis(&normal);
    let information: Matrix2<f64> = basis.transpose() * moments * basis;
    // Bearings that coincide leave a whole circle of normals.
    let spread = information.symmetric_eigenvalues().min() / total;
    if spread <= LEAST_SPREAD || spread.is_nan() {
        return None;
    }
    let covariance = information.try_inverse()?;
    let chi_square = normal.dot(&(moments * normal)).max(0.0);
    Some(GreatCircleFit { normal, covariance, rms_rad: (chi_square / total).sqrt(), chi_square })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tangent_exp;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = Vector3<f64>> {
        (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
            .prop_filter_map("zero", |(x, y, z)| Vector3::new(x, y, z).try_normalize(1e-3))
    }

    /// Bearings along an arc, each moved off the circle by what `off` says.
    fn arc(normal: &Vector3<f64>, from: f64, length: f64, off: impl Fn(usize) -> f64) -> Vec<Vector3<f64>> {
        let basis = tangent_basis(normal);
        let at = |i: usize| {
            let (sin, cos) = (from + length * i as f64 / 99.0).sin_cos();
            let on = basis.column(0) * cos + basis.column(1) * sin;
            (on * off(i).cos() + normal * off(i).sin()).normalize()
        };
        (0..100).map(at).collect()
    }

    proptest! {
        #[test]
        fn bearings_of_a_circle_give_it_back(normal in unit(), from in 0.0..6.0f64, length in 0.05..3.0f64) {
            let fit = fit_great_circle(arc(&normal, from, length, |_| 0.0).into_iter().map(|b| (b, 4.0))).unwrap();
            prop_assert!(fit.normal.cross(&normal).norm() < 1e-8, "{}", fit.normal.cross(&normal).norm());
            prop_assert!(fit.rms_rad < 1e-7);
        }

        #[test]
        fn covariance_is_what_noise_does(normal in unit(), from in 0.0..6.0f64) {
            // Mean square of the error over fixed patterns that are orthonormal over the bearings.
            let sigma = 1e-4;
            let clean = arc(&normal, from, 0.3, |_| 0.0);
            let weight = 1.0 / (sigma * sigma);
            let fit = fit_great_circle(clean.iter().map(|b| (*b, weight))).unwrap();
            let normal = if fit.normal.dot(&normal) > 0.0 { normal } else { -normal };
            let basis = tangent_basis(&fit.normal);
            let mut sum = Matrix2::zeros();
            for k in 0..100 {
                let moved = clean.iter().enumerate().map(|(i, b)| {
                    let off = if i == k { sigma } else { 0.0 };
                    ((b * off.cos() + normal * off.sin()).normalize(), weight)
                });
                let one = fit_great_circle(moved).unwrap();
                let step = basis.transpose() * one.normal * one.normal.dot(&fit.normal).signum();
                sum += step * step.transpose();
            }
            prop_assert!((sum - fit.covariance).norm() < 1e-2 * fit.covariance.norm());
        }
    }

    #[test]
    fn no_circle_through_one_point() {
        let b = Vector3::new(0.1, 0.2, 1.0).normalize();
        assert!(fit_great_circle([(b, 1.0)]).is_none());
        assert!(fit_great_circle([(b, 1.0), (b, 1.0), (-b, 2.0)]).is_none());
        assert!(fit_great_circle([(b, 1.0), (b, f64::NAN)]).is_none());
        let near = tangent_exp(&b, &nalgebra::Vector2::new(1e-3, 0.0));
        assert!(fit_great_circle([(b, 1.0), (near, 0.0)]).is_none());
        assert!(fit_great_circle([(b, 1.0), (near, 1.0)]).is_some());
        assert!(fit_great_circle([(b, 1.0), (Vector3::repeat(f64::NAN), 1.0)]).is_none());
    }
}
