//! The radius as a polynomial of the angle, in pixels: the surround-view cameras of WoodScape.

use nalgebra::Matrix2;

use super::grid::{self, PixelGrid};
use super::polynomial::{evaluate, fold_rad};
use super::profile::{Inverse, Profile};
use super::rim::FOLD;
use super::schema::{CX, CY, LensSchema, Parameter, ParameterSchema, Resize, scalars};
use super::values::{Parametric, Values};
use crate::error::Result;

const NAME: &str = "radial_polynomial";

/// Radial polynomial: `rho = k1 theta + k2 theta^2 + k3 theta^3 + k4 theta^4` in pixels, then `u = rho cos phi + cx`,
/// `v = aspect_ratio rho sin phi + cy`.
///
/// Valid for `theta` up to the first maximum of `rho`, at most pi (Yogamani et al. 2019).
#[derive(Debug, Clone, PartialEq)]
pub struct RadialPolynomial {
    grid: PixelGrid,
    /// `rho` in powers of `theta`.
    rho: [f64; 5],
    inverse: Inverse,
}

impl Parametric for RadialPolynomial {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "WoodScape's r = k1 theta + k2 theta^2 + k3 theta^3 + k4 theta^4, in pixels.",
        parameters: &[
            ParameterSchema::required("k1", Resize::Length, "of theta, pixels"),
            ParameterSchema::optional("k2", 0.0, Resize::Length, "of theta^2, pixels"),
            ParameterSchema::optional("k3", 0.0, Resize::Length, "of theta^3, pixels"),
            ParameterSchema::optional("k4", 0.0, Resize::Length, "of theta^4, pixels"),
            CX,
            CY,
            ParameterSchema::optional("aspect_ratio", 1.0, Resize::Fixed, "stretch of the rows"),
        ],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let [k1, k2, k3, k4, cx, cy, aspect_ratio] = given.numbers();
        Self::new([k1, k2, k3, k4], [cx, cy], aspect_ratio)
    }

    fn values(&self) -> Vec<Parameter> {
        let [_, aspect_ratio, cx, cy] = self.grid.focal_and_centre();
        scalars(&[&self.coefficients(), &[cx, cy, aspect_ratio]])
    }
}

impl RadialPolynomial {
    /// A camera of coefficients `[k1, k2, k3, k4]` in pixels, centre `[cx, cy]` in pixels and the stretch of the rows.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`](crate::Error::InvalidCamera) if `k1` or the aspect ratio is not positive or a number is not
    /// finite.
    pub fn new(coefficients: [f64; 4], centre_px: [f64; 2], aspect_ratio: f64) -> Result<Self> {
        grid::positive(NAME, "aspect_ratio", aspect_ratio)?;
        let grid = PixelGrid::affine(NAME, Matrix2::new(1.0, 0.0, 0.0, aspect_ratio), centre_px)?;
        let [k1, k2, k3, k4] = coefficients;
        grid::positive(NAME, "k1", k1)?;
        grid::finite(NAME, ["k2", "k3", "k4"], [k2, k3, k4])?;
        let rho = [0.0, k1, k2, k3, k4];
        let slope = [k1 - FOLD * k1, 2.0 * k2, 3.0 * k3, 4.0 * k4];
        let inverse = Inverse::new(NAME, ("k1 .. k4", &coefficients), fold_rad(&slope), |theta| evaluate(&rho, theta))?;
        Ok(Self { grid, rho, inverse })
    }

    /// `[k1, k2, k3, k4]` in pixels.
    pub fn coefficients(&self) -> [f64; 4] {
        let [_, k1, k2, k3, k4] = self.rho;
        [k1, k2, k3, k4]
    }
}

impl Profile for RadialPolynomial {
    fn pixel_grid(&self) -> &PixelGrid {
        &self.grid
    }

    #[inline]
    fn profile(&self, theta: f64) -> (f64, f64) {
        evaluate(&self.rho, theta)
    }

    #[inline]
    fn inverse(&self) -> &Inverse {
        &self.inverse
    }
}
