//! The double sphere model: two shifted spheres, then a shifted pinhole, closed forms both ways.

use nalgebra::{Matrix2x3, RowVector3, Vector2, Vector3};

use super::grid::PixelGrid;
use super::lens::Lens;
use super::rim::{NARROWEST_RAD, Rim};
use super::schema::{CX, CY, FX, FY, LensSchema, Parameter, ParameterSchema, Resize, scalars};
use super::values::{Parametric, Values};
use crate::error::{Error, Result};

const NAME: &str = "double_sphere";

/// Double sphere: with `d1 = |(x, y, z)|`, `z1 = xi d1 + z` and `d2 = |(x, y, z1)|`,
/// `m = (x, y) / (alpha d2 + (1 - alpha) z1)`, then `u = fx mx + cx`, `v = fy my + cy`.
///
/// Valid for `z > -w2 d1`, `w2 = (w1 + xi) / sqrt(2 w1 xi + xi^2 + 1)`, with `w1 = alpha / (1 - alpha)` if `alpha <= 1/2` and
/// `(1 - alpha) / alpha` otherwise (Usenko et al. 2018, eq. 43-45).
#[derive(Debug, Clone, PartialEq)]
pub struct DoubleSphere {
    grid: PixelGrid,
    xi: f64,
    alpha: f64,
    rim: Rim,
}

impl Parametric for DoubleSphere {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "The double sphere model of Usenko et al. 2018.",
        parameters: &[
            ParameterSchema::required("xi", Resize::Fixed, "shift between the spheres in radii, above -1 to 1"),
            ParameterSchema::required(
                "alpha",
                Resize::Fixed,
                "part of the distance, against the depth, in the denominator, 0 to 1",
            ),
            FX,
            FY,
            CX,
            CY,
        ],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let [xi, alpha, fx, fy, cx, cy] = given.numbers();
        Self::new(xi, alpha, [fx, fy], [cx, cy])
    }

    fn values(&self) -> Vec<Parameter> {
        scalars(&[&[self.xi, self.alpha], &self.grid.focal_and_centre()])
    }
}

impl DoubleSphere {
    /// A double sphere camera of focal lengths `[fx, fy]` and centre `[cx, cy]` in pixels.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] unless `-1 < xi <= 1`, `0 <= alpha <= 1`, the focal lengths are positive and a field of
    /// view is left.
    pub fn new(xi: f64, alpha: f64, focal_px: [f64; 2], centre_px: [f64; 2]) -> Result<Self> {
        if !(xi > -1.0 && xi <= 1.0) {
            return Err(Error::camera(NAME, "xi", xi, "a number in (-1, 1]"));
        }
        if !(0.0..=1.0).contains(&alpha) {
            return Err(Error::camera(NAME, "alpha", alpha, "a number in [0, 1]"));
        }
        let grid = PixelGrid::new(NAME, focal_px, 0.0, centre_px)?;
        let w1 = if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha };
        let w2 = (w1 + xi) / (2.0 * w1 * xi + xi * xi + 1.0).sqrt();
        let end = (1.0 - w2 * w2).max(0.0).sqrt().atan2(-w2);
        let open = Self { grid, xi, alpha, rim: Rim::new(end, 0.0) };
        let rim = Rim::find(end, |theta| {
            let (sin, cos) = theta.sin_cos();
            let (m, j) = open.raw_jacobian(&Vector3::new(sin, 0.0, cos));
            (m.x, j[(0, 0)] * cos - j[(0, 2)] * sin)
        });
        if rim.theta <= NARROWEST_RAD {
            return Err(Error::camera(
                NAME,
                "xi, alpha",
                format!("{xi}, {alpha}"),
                "a field of view larger than a point",
            ));
        }
        Ok(Self { rim, ..open })
    }

    /// The shift between the spheres, in radii.
    pub fn xi(&self) -> f64 {
        self.xi
    }

    /// The part of the distance, against the depth, in the denominator.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    fn raw_jacobian(&self, bearing: &Vector3<f64>) -> (Vector2<f64>, Matrix2x3<f64>) {
        let (xi, alpha) = (self.xi, self.alpha);
        let xy = bearing.xy();
        let d1 = bearing.norm();
        let z1 = xi * d1 + bearing.z;
        let d2 = (xy.norm_squared() + z1 * z1).sqrt();
        let denominator = alpha * d2 + (1.0 - alpha) * z1;
        let m = xy / denominator;
        // d z1 = xi bearing / d1 + z, d d2 = ((x, y, 0) + z1 d z1) / d2.
        let dz1 = RowVector3::new(xi * xy.x / d1, xi * xy.y / d1, xi * bearing.z / d1 + 1.0);
        let dd2 = (RowVector3::new(xy.x, xy.y, 0.0) + dz1 * z1) / d2;
        let mut jacobian = m * (dd2 * alpha + dz1 * (1.0 - alpha)) * (-1.0 / denominator);
        jacobian[(0, 0)] += 1.0 / denominator;
        jacobian[(1, 1)] += 1.0 / denominator;
        (m, jacobian)
    }
}

impl Lens for DoubleSphere {
    fn grid(&self) -> &PixelGrid {
        &self.grid
    }

    #[inline]
    fn point(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        let xy = bearing.xy();
        let rho2 = xy.norm_squared();
        if !self.rim.admits(rho2.sqrt(), bearing.z) {
            return None;
        }
        let z1 = self.xi * bearing.norm() + bearing.z;
        let d2 = (rho2 + z1 * z1).sqrt();
        Some(xy / (self.alpha * d2 + (1.0 - self.alpha) * z1))
    }

    #[inline]
    fn point_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        self.rim.admits(bearing.xy().norm(), bearing.z).then(|| self.raw_jacobian(bearing))
    }

    #[inline]
    fn bearing(&self, point: &Vector2<f64>) -> Option<Vector3<f64>> {
        let (xi, alpha) = (self.xi, self.alpha);
        let s = point.norm_squared();
        if s > self.rim.radius * self.rim.radius {
            return None;
        }
        let root = (1.0 - (2.0 * alpha - 1.0) * s).max(0.0).sqrt();
        let mz = (1.0 - alpha * alpha * s) / (alpha * root + 1.0 - alpha);
        let k = (mz * xi + (mz * mz + (1.0 - xi * xi) * s).sqrt()) / (mz * mz + s);
        Some(Vector3::new(k * point.x, k * point.y, k * mz - xi).normalize())
    }

    fn rim_rad(&self) -> f64 {
        self.rim.theta
    }
}
