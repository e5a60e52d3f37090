//! The extended unified model: an ellipsoid seen from a shifted point, two parameters, closed forms both ways.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::grid::{self, PixelGrid};
use super::lens::Lens;
use super::schema::{CX, CY, FX, FY, LensSchema, Parameter, ParameterSchema, Resize, scalars};
use super::sphere::ShiftedSphere;
use super::values::{Parametric, Values};
use crate::error::{Error, Result};

const NAME: &str = "extended_unified";

/// Extended unified: `m = (x, y) / (alpha d + (1 - alpha) z)` with `d = sqrt(beta (x^2 + y^2) + z^2)`, then
/// `u = fx mx + cx`, `v = fy my + cy`.
///
/// Valid for `z > -w d`, with `w = alpha / (1 - alpha)` if `alpha <= 1/2` and `(1 - alpha) / alpha` otherwise
/// (Khomutenko et al. 2016; valid set from Usenko et al. 2018).
#[derive(Debug, Clone, PartialEq)]
pub struct ExtendedUnified {
    grid: PixelGrid,
    sphere: ShiftedSphere,
}

impl Parametric for ExtendedUnified {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "The extended unified model of Khomutenko et al. 2016.",
        parameters: &[
            ParameterSchema::required(
                "alpha",
                Resize::Fixed,
                "part of the distance, against the depth, in the denominator, 0 to 1",
            ),
            ParameterSchema::required("beta", Resize::Fixed, "stretch of the ellipsoid, above 0"),
            FX,
            FY,
            CX,
            CY,
        ],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let [alpha, beta, fx, fy, cx, cy] = given.numbers();
        Self::new(alpha, beta, [fx, fy], [cx, cy])
    }

    fn values(&self) -> Vec<Parameter> {
        scalars(&[&[self.alpha(), self.beta()], &self.grid.focal_and_centre()])
    }
}

impl ExtendedUnified {
    /// An extended unified camera of focal lengths `[fx, fy]` and centre `[cx, cy]` in pixels.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] unless `0 <= alpha <= 1`, `beta > 0`, and the focal lengths are positive.
    pub fn new(alpha: f64, beta: f64, focal_px: [f64; 2], centre_px: [f64; 2]) -> Result<Self> {
        if !(0.0..=1.0).contains(&alpha) {
            return Err(Error::camera(NAME, "alpha", alpha, "a number in [0, 1]"));
        }
        grid::positive(NAME, "beta", beta)?;
        let grid = PixelGrid::new(NAME, focal_px, 0.0, centre_px)?;
        Ok(Self { grid, sphere: ShiftedSphere::new(NAME, alpha, 1.0 - alpha, beta)? })
    }

    /// The part of the distance, against the depth, in the denominator.
    pub fn alpha(&self) -> f64 {
        self.sphere.shift()
    }

    /// The stretch of the ellipsoid.
    pub fn beta(&self) -> f64 {
        self.sphere.beta()
    }
}

impl Lens for ExtendedUnified {
    fn grid(&self) -> &PixelGrid {
        &self.grid
    }

    #[inline]
    fn point(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.sphere.point(bearing)
    }

    #[inline]
    fn point_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        self.sphere.point_jacobian(bearing)
    }

    #[inline]
    fn bearing(&self, point: &Vector2<f64>) -> Option<Vector3<f64>> {
        self.sphere.bearing(point)
    }

    fn rim_rad(&self) -> f64 {
        self.sphere.rim().theta
    }
}
