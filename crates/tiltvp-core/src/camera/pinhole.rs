//! The pinhole with the distortion of Brown and Conrady, as OpenCV calibrates it: 4, 5 or 8 coefficients.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::brown::{Brown, K1, K2, K3, P1, P2};
use super::grid::PixelGrid;
use super::lens::Lens;
use super::rim::{NARROWEST_RAD, Rim};
use super::schema::{CX, CY, FX, FY, LensSchema, Parameter, ParameterSchema, scalars};
use super::values::{Parametric, Values};
use crate::error::{Error, Result};

const NAME: &str = "pinhole";

/// Pinhole: `m = (x / z, y / z)`, distorted, then `u = fx x' + cx`, `v = fy y' + cy`.
///
/// With `s = |m|^2`, `x' = x (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3) + 2 p1 x y + p2 (s + 2 x^2)` and
/// `y'` alike (OpenCV, calib3d). Valid for `z > 0` up to the radius at which the distortion stops being one-to-one.
#[derive(Debug, Clone, PartialEq)]
pub struct Pinhole {
    grid: PixelGrid,
    brown: Brown,
    rim: Rim,
}

impl Parametric for Pinhole {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "Pinhole with Brown-Conrady distortion of 4, 5 or 8 coefficients, in OpenCV's meaning.",
        parameters: &[
            FX,
            FY,
            CX,
            CY,
            K1,
            K2,
            P1,
            P2,
            K3,
            ParameterSchema::coefficient("k4", "denominator of the radial distortion, of r^2"),
            ParameterSchema::coefficient("k5", "denominator of the radial distortion, of r^4"),
            ParameterSchema::coefficient("k6", "denominator of the radial distortion, of r^6"),
        ],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let [fx, fy, cx, cy, distortion @ ..]: [f64; 12] = given.numbers();
        Self::new([fx, fy], [cx, cy], &distortion)
    }

    fn values(&self) -> Vec<Parameter> {
        scalars(&[&self.grid.focal_and_centre(), &self.brown.coefficients()])
    }
}

impl Pinhole {
    /// A pinhole of focal lengths `[fx, fy]` and centre `[cx, cy]` in pixels, and OpenCV's distortion
    /// `[k1, k2, p1, p2, k3, k4, k5, k6]`, of which trailing zeros may be left away.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if a focal length is not positive, a number is not finite, there are more than eight
    /// coefficients, or the distortion leaves no field of view.
    pub fn new(focal_px: [f64; 2], centre_px: [f64; 2], distortion: &[f64]) -> Result<Self> {
        let grid = PixelGrid::new(NAME, focal_px, 0.0, centre_px)?;
        let mut coefficients = [0.0; 8];
        let Some(slots) = coefficients.get_mut(..distortion.len()) else {
            let got = format!("{} numbers", distortion.len());
            return Err(Error::camera(NAME, "distortion", got, "at most k1, k2, p1, p2, k3, k4, k5, k6"));
        };
        slots.copy_from_slice(distortion);
        let brown = Brown::new(NAME, coefficients)?;
        let rim = Rim::new(brown.limit().atan(), brown.limit());
        if rim.theta <= NARROWEST_RAD {
            return Err(Error::camera(
                NAME,
                "distortion",
                format!("{distortion:?}"),
                "a field of view larger than a point",
            ));
        }
        Ok(Self { grid, brown, rim })
    }

    /// `[k1, k2, p1, p2, k3, k4, k5, k6]`.
    pub fn distortion(&self) -> [f64; 8] {
        self.brown.coefficients()
    }
}

impl Lens for Pinhole {
    fn grid(&self) -> &PixelGrid {
        &self.grid
    }

    #[inline]
    fn point(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        let xy = bearing.xy();
        self.rim.admits(xy.norm(), bearing.z).then(|| self.brown.distort(&(xy / bearing.z)))
    }

    #[inline]
    fn point_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let xy = bearing.xy();
        if !self.rim.admits(xy.norm(), bearing.z) {
            return None;
        }
        let m = xy / bearing.z;
        let (point, jacobian) = self.brown.distort_jacobian(&m);
        let inner = Matrix2x3::new(1.0, 0.0, -m.x, 0.0, 1.0, -m.y) / bearing.z;
        Some((point, jacobian * inner))
    }

    #[inline]
    fn bearing(&self, point: &Vector2<f64>) -> Option<Vector3<f64>> {
        let m = self.brown.undistort(point)?;
        (m.norm() <= self.rim.radius).then(|| Vector3::new(m.x, m.y, 1.0).normalize())
    }

    fn rim_rad(&self) -> f64 {
        self.rim.theta
    }
}
