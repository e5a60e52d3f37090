//! The radius as a polynomial of the angle, in pixels: the surround-view cameras of WoodScape.

use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::grid::{self, PixelGrid};
use super::lens::Lens;
use super::polynomial::{evaluate, first_fall};
use super::radial::{self, Radial};
use super::rim::FOLD;
use super::solve;
use super::table::Table;
use crate::error::{Error, Result};

const NAME: &str = "radial_polynomial";

/// Radial polynomial: `rho = k1 theta + k2 theta^2 + k3 theta^3 + k4 theta^4` in pixels, then `u = rho cos phi + cx`,
/// `v = aspect_ratio rho sin phi + cy`.
///
/// Valid for `theta` up to the first maximum of `rho`, at most pi (Yogamani et al. 2019).
#[derive(Debug, Clone, PartialEq)]
pub struct RadialPolynomial {
    grid: PixelGrid,
    profile: [f64; 5],
    max_theta: f64,
    max_radius: f64,
    /// `theta` over `rho`.
    table: Table,
}

impl RadialPolynomial {
    /// A camera of coefficients `[k1, k2, k3, k4]` in pixels, centre `[cx, cy]` in pixels and the stretch of the rows.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if `k1` or the aspect ratio is not positive or a number is not finite.
    pub fn new(coefficients: [f64; 4], centre_px: [f64; 2], aspect_ratio: f64) -> Result<Self> {
        grid::positive(NAME, "aspect_ratio", aspect_ratio)?;
        let grid = PixelGrid::affine(NAME, Matrix2::new(1.0, 0.0, 0.0, aspect_ratio), centre_px)?;
        let [k1, k2, k3, k4] = coefficients;
        grid::positive(NAME, "k1", k1)?;
        grid::finite(NAME, ["k2", "k3", "k4"], [k2, k3, k4])?;
        let slope = [k1 - FOLD * k1, 2.0 * k2, 3.0 * k3, 4.0 * k4];
        let max_theta = first_fall(&slope, std::f64::consts::PI).unwrap_or(std::f64::consts::PI);
        let profile = [0.0, k1, k2, k3, k4];
        let max_radius = evaluate(&profile, max_theta).0;
        if max_theta <= 1e-6 || !max_radius.is_finite() {
            let got = format!("{coefficients:?}");
            return Err(Error::camera(NAME, "k1 .. k4", got, "coefficients under which rho(theta) grows at first"));
        }
        let table = Table::new(max_radius, |radius| {
            let theta = root(&profile, 0.0, max_theta, radius / k1, radius);
            (theta, 1.0 / evaluate(&profile, theta).1)
        });
        Ok(Self { grid, profile, max_theta, max_radius, table })
    }

    /// `[k1, k2, k3, k4]` in pixels.
    pub fn coefficients(&self) -> [f64; 4] {
        let [_, k1, k2, k3, k4] = self.profile;
        [k1, k2, k3, k4]
    }
}

#[inline]
fn root(profile: &[f64; 5], low: f64, high: f64, start: f64, radius: f64) -> f64 {
    solve::increasing(low, high, start, |theta| {
        let (rho, slope) = evaluate(profile, theta);
        (rho - radius, slope)
    })
}

impl Radial for RadialPolynomial {
    #[inline]
    fn radius(&self, theta: f64) -> Option<(f64, f64)> {
        (theta < self.max_theta).then(|| evaluate(&self.profile, theta))
    }

    #[inline]
    fn theta(&self, radius: f64) -> Option<(f64, f64)> {
        if radius >= self.max_radius {
            return None;
        }
        let (low, high, start) = self.table.around(radius);
        let theta = root(&self.profile, low, high, start, radius);
        Some((theta, 1.0 / evaluate(&self.profile, theta).1))
    }
}

impl Lens for RadialPolynomial {
    fn grid(&self) -> &PixelGrid {
        &self.grid
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
        self.max_theta
    }
}
