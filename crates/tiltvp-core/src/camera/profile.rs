//! Lenses that are round about their axis and whose radius has no inverse in closed form: a root, from a table's guess.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::grid::PixelGrid;
use super::lens::Lens;
use super::radial::{self, Radial};
use super::rim::NARROWEST_RAD;
use super::solve;
use super::table::Table;
use crate::error::{Error, Result};

/// A lens told by its profile `r(theta)`, which grows up to where `inverse` ends.
pub(super) trait Profile {
    fn pixel_grid(&self) -> &PixelGrid;

    /// `(r, dr/dtheta)`.
    fn profile(&self, theta: f64) -> (f64, f64);

    fn inverse(&self) -> &Inverse;
}

/// How far a profile grows, and `theta` over `r`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Inverse {
    max_theta: f64,
    max_radius: f64,
    table: Table,
}

impl Inverse {
    /// The inverse of a profile that grows up to `max_theta`: its fold, or pi.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if the profile does not grow at first; the model, and the coefficients with what they are called
    /// together, are for the message.
    pub(super) fn new(
        model: &'static str,
        (names, coefficients): (&'static str, &[f64]),
        max_theta: f64,
        profile: impl Fn(f64) -> (f64, f64),
    ) -> Result<Self> {
        let max_radius = profile(max_theta).0;
        let refused = || {
            let expected = "coefficients under which the radius grows with the angle at first";
            Error::camera(model, names, format!("{coefficients:?}"), expected)
        };
        if max_theta <= NARROWEST_RAD || !max_radius.is_finite() {
            return Err(refused());
        }
        let (_, scale) = profile(0.0);
        let table = Table::new(max_radius, |radius| {
            let theta = root(&profile, 0.0, max_theta, radius / scale, radius);
            (theta, 1.0 / profile(theta).1)
        });
        if !table.is_finite() {
            return Err(refused());
        }
        Ok(Self { max_theta, max_radius, table })
    }
}

#[inline]
fn root(profile: impl Fn(f64) -> (f64, f64), low: f64, high: f64, start: f64, radius: f64) -> f64 {
    solve::increasing(low, high, start, |theta| {
        let (r, slope) = profile(theta);
        (r - radius, slope)
    })
}

impl<T: Profile> Radial for T {
    #[inline]
    fn radius(&self, theta: f64) -> Option<(f64, f64)> {
        (theta < self.inverse().max_theta).then(|| self.profile(theta))
    }

    #[inline]
    fn theta(&self, radius: f64) -> Option<(f64, f64)> {
        let inverse = self.inverse();
        if radius >= inverse.max_radius {
            return None;
        }
        let (low, high, start) = inverse.table.around(radius);
        let theta = root(|theta| self.profile(theta), low, high, start, radius);
        Some((theta, 1.0 / self.profile(theta).1))
    }
}

impl<T: Profile> Lens for T {
    fn grid(&self) -> &PixelGrid {
        self.pixel_grid()
    }

    #[inline]
    fn point(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        radial::point(self, bearing)
    }

    #[inline]
    fn point_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        radial::project(self, bearing)
    }

    #[inline]
    fn bearing(&self, point: &Vector2<f64>) -> Option<Vector3<f64>> {
        radial::bearing(self, point)
    }

    #[inline]
    fn bearing_jacobian(&self, point: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        radial::unproject(self, point)
    }

    fn rim_rad(&self) -> f64 {
        self.inverse().max_theta
    }
}
