//! The fisheye of Kannala and Brandt, OpenCV's `fisheye` and Kalibr's `equidistant`, followed to where its image folds.

use super::grid::{self, PixelGrid};
use super::polynomial::{evaluate, fold_rad};
use super::profile::{Inverse, Profile};
use super::rim::FOLD;
use super::schema::{CX, CY, FX, FY, LensSchema, Parameter, ParameterSchema, scalars};
use super::values::{Parametric, Values};
use crate::error::Result;

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
    inverse: Inverse,
}

impl Parametric for KannalaBrandt {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "r = theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9: OpenCV's fisheye, Kalibr's equidistant.",
        parameters: &[
            FX,
            FY,
            CX,
            CY,
            ParameterSchema::coefficient("k1", "of theta^3"),
            ParameterSchema::coefficient("k2", "of theta^5"),
            ParameterSchema::coefficient("k3", "of theta^7"),
            ParameterSchema::coefficient("k4", "of theta^9"),
        ],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let [fx, fy, cx, cy, coefficients @ ..]: [f64; 8] = given.numbers();
        Self::new([fx, fy], [cx, cy], coefficients)
    }

    fn values(&self) -> Vec<Parameter> {
        scalars(&[&self.grid.focal_and_centre(), &self.coefficients()])
    }
}

impl KannalaBrandt {
    /// A fisheye of focal lengths `[fx, fy]` and centre `[cx, cy]` in pixels, and coefficients `[k1, k2, k3, k4]`.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`](crate::Error::InvalidCamera) if a focal length is not positive, a number is not finite, or `r`
    /// does not grow.
    pub fn new(focal_px: [f64; 2], centre_px: [f64; 2], coefficients: [f64; 4]) -> Result<Self> {
        let grid = PixelGrid::new(NAME, focal_px, 0.0, centre_px)?;
        grid::finite(NAME, ["k1", "k2", "k3", "k4"], coefficients)?;
        let [k1, k2, k3, k4] = coefficients;
        let factor = [1.0, k1, k2, k3, k4];
        let slope = [1.0 - FOLD, 0.0, 3.0 * k1, 0.0, 5.0 * k2, 0.0, 7.0 * k3, 0.0, 9.0 * k4];
        let inverse =
            Inverse::new(NAME, ("k1 .. k4", &coefficients), fold_rad(&slope), |theta| profile(&factor, theta))?;
        Ok(Self { grid, factor, inverse })
    }

    /// `[k1, k2, k3, k4]`.
    pub fn coefficients(&self) -> [f64; 4] {
        let [_, k1, k2, k3, k4] = self.factor;
        [k1, k2, k3, k4]
    }
}

#[inline]
fn profile(factor: &[f64; 5], theta: f64) -> (f64, f64) {
    let s = theta * theta;
    let (factor, slope) = evaluate(factor, s);
    (theta * factor, factor + 2.0 * s * slope)
}

impl Profile for KannalaBrandt {
    fn pixel_grid(&self) -> &PixelGrid {
        &self.grid
    }

    #[inline]
    fn profile(&self, theta: f64) -> (f64, f64) {
        profile(&self.factor, theta)
    }

    #[inline]
    fn inverse(&self) -> &Inverse {
        &self.inverse
    }
}
