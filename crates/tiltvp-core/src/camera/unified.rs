//! The unified sphere model of Mei: unit sphere, shift, plane, distortion, pixels.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::brown::{Brown, K1, K2, K3, P1, P2};
use super::grid::PixelGrid;
use super::lens::Lens;
use super::schema::{CX, CY, FX, FY, LensSchema, Parameter, ParameterSchema, Resize, scalars};
use super::sphere::ShiftedSphere;
use super::values::{Parametric, Values};
use crate::error::{Error, Result};

const NAME: &str = "unified";

/// Unified sphere: `m = (x, y) / (z + xi)` of the unit bearing, distorted, then `u = fx x' + skew y' + cx`, `v = fy y' + cy`.
///
/// Distortion `[k1, k2, p1, p2, k3]` in OpenCV's meaning. Valid for `z > -xi` if `xi <= 1`, `z > -1 / xi` if `xi > 1`, both
/// up to the radius at which the distortion stops being one-to-one (Mei and Rives 2007).
#[derive(Debug, Clone, PartialEq)]
pub struct Unified {
    grid: PixelGrid,
    brown: Brown,
    sphere: ShiftedSphere,
}

impl Parametric for Unified {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "Mei's unified model: Kalibr's `omni`, OpenCV's `omnidir`; `skew` is the entry (0, 1) of K.",
        parameters: &[
            ParameterSchema::required(
                "xi",
                Resize::Fixed,
                "shift of the centre of projection in radii of the sphere, at least 0",
            ),
            FX,
            FY,
            CX,
            CY,
            K1,
            K2,
            P1,
            P2,
            K3,
            ParameterSchema::optional("skew", 0.0, Resize::Length, "columns per row of the image plane, pixels"),
        ],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let [xi, fx, fy, cx, cy, k1, k2, p1, p2, k3, skew] = given.numbers();
        Self::new(xi, [fx, fy], [cx, cy], [k1, k2, p1, p2, k3], skew)
    }

    fn values(&self) -> Vec<Parameter> {
        let (focal_and_centre, skew) = (self.grid.focal_and_centre(), self.grid.matrix().m12);
        scalars(&[&[self.xi()], &focal_and_centre, &self.distortion(), &[skew]])
    }
}

impl Unified {
    /// A unified camera of shift `xi`, focal lengths `[fx, fy]`, centre `[cx, cy]` and `skew` in pixels, and distortion
    /// `[k1, k2, p1, p2, k3]`.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if a focal length is not positive, `xi` is negative, a number is not finite, or no field
    /// of view is left.
    pub fn new(xi: f64, focal_px: [f64; 2], centre_px: [f64; 2], distortion: [f64; 5], skew: f64) -> Result<Self> {
        if !(xi.is_finite() && xi >= 0.0) {
            return Err(Error::camera(NAME, "xi", xi, "a finite number, at least 0"));
        }
        let grid = PixelGrid::new(NAME, focal_px, skew, centre_px)?;
        let [k1, k2, p1, p2, k3] = distortion;
        let brown = Brown::new(NAME, [k1, k2, p1, p2, k3, 0.0, 0.0, 0.0])?;
        let sphere = ShiftedSphere::new(NAME, xi, 1.0, 1.0)?.within_radius(NAME, brown.limit())?;
        Ok(Self { grid, brown, sphere })
    }

    /// The shift of the centre of projection from the centre of the sphere, in radii.
    pub fn xi(&self) -> f64 {
        self.sphere.shift()
    }

    /// `[k1, k2, p1, p2, k3]`.
    pub fn distortion(&self) -> [f64; 5] {
        let [k1, k2, p1, p2, k3, ..] = self.brown.coefficients();
        [k1, k2, p1, p2, k3]
    }
}

impl Lens for Unified {
    fn grid(&self) -> &PixelGrid {
        &self.grid
    }

    #[inline]
    fn point(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.sphere.point(bearing).map(|m| self.brown.distort(&m))
    }

    #[inline]
    fn point_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (m, inner) = self.sphere.point_jacobian(bearing)?;
        let (point, outer) = self.brown.distort_jacobian(&m);
        Some((point, outer * inner))
    }

    #[inline]
    fn bearing(&self, point: &Vector2<f64>) -> Option<Vector3<f64>> {
        self.sphere.bearing(&self.brown.undistort(point)?)
    }

    fn rim_rad(&self) -> f64 {
        self.sphere.rim().theta
    }
}
