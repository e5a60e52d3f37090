//! The fisheye of Kannala and Brandt, OpenCV's `fisheye` and Kalibr's `equidistant`, followed to where its image folds.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::grid::{self, PixelGrid};
use super::lens::Lens;
use super::polynomial::{evaluate, first_fall};
use super::radial::{self, Radial};
use super::rim::FOLD;
use super::solve;
use super::table::Table;
use crate::error::{Error, Result};

const NAME: &str = "kannala_brandt";

/// Kannala-Brandt: `r = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)`, then `u = fx r cos phi + cx`,
/// `v = fy r sin phi + cy`.
///
/// Valid for `theta` up to the first maximum of `r`, at most pi, past 90 degrees too (Kannala and Brandt 2006).
#[derive(Debug, Clone, PartialEq)]
pub struct KannalaBrandt {
    grid: PixelGrid,
    /// `r / theta` in powers of `theta^2`.
    factor: [f64; 5],
    max_theta: f64,
    max_radius: f64,
    /// `theta` over `r`.
    table: Table,
}

impl KannalaBrandt {
    /// A fisheye of focal lengths `[fx, fy]` and centre `[cx, cy]` in pixels, and coefficients `[k1, k2, k3, k4]`.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if a focal length is not positive, a number is not finite, or `r` does not grow.
    pub fn new(focal_px: [f64; 2], centre_px: [f64; 2], coefficients: [f64; 4]) -> Result<Self> {
        let grid = PixelGrid::new(NAME, focal_px, 0.0, centre_px)?;
        grid::finite(NAME, ["k1", "k2", "k3", "k4"], coefficients)?;
        let [k1, k2, k3, k4] = coefficients;
        let slope = [1.0 - FOLD, 0.0, 3.0 * k1, 0.0, 5.0 * k2, 0.0, 7.0 * k3, 0.0, 9.0 * k4];
        let max_theta = first_fall(&slope, std::f64::consts::PI).unwrap_or(std::f64::consts::PI);
        let factor = [1.0, k1, k2, k3, k4];
        let max_radius = profile(&factor, max_theta).0;
        if max_theta <= 1e-6 || !max_radius.is_finite() {
            let got = format!("{coefficients:?}");
            return Err(Error::camera(NAME, "k1 .. k4", got, "coefficients under which r(theta) grows at first"));
        }
        let table = Table::new(max_radius, |radius| {
            let theta = root(&factor, 0.0, max_theta, radius, radius);
            (theta, 1.0 / profile(&factor, theta).1)
        });
        Ok(Self { grid, factor, max_theta, max_radius, table })
    }

    /// `[k1, k2, k3, k4]`.
    pub fn coefficients(&self) -> [f64; 4] {
        let [_, k1, k2, k3, k4] = self.factor;
        [k1, k2, k3, k4]
    }
}

/// `(r, dr/dtheta)`.
#[inline]
fn profile(factor: &[f64; 5], theta: f64) -> (f64, f64) {
    let s = theta * theta;
    let (factor, slope) = evaluate(factor, s);
    (theta * factor, factor + 2.0 * s * slope)
}

#[inline]
fn root(factor: &[f64; 5], low: f64, high: f64, start: f64, radius: f64) -> f64 {
    solve::increasing(low, high, start, |theta| {
        let (r, slope) = profile(factor, theta);
        (r - radius, slope)
    })
}

impl Radial for KannalaBrandt {
    #[inline]
    fn radius(&self, theta: f64) -> Option<(f64, f64)> {
        (theta < self.max_theta).then(|| profile(&self.factor, theta))
    }

    #[inline]
    fn theta(&self, radius: f64) -> Option<(f64, f64)> {
        if radius >= self.max_radius {
            return None;
        }
        let (low, high, start) = self.table.around(radius);
        let theta = root(&self.factor, low, high, start, radius);
        Some((theta, 1.0 / profile(&self.factor, theta).1))
    }
}

impl Lens for KannalaBrandt {
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
