//! The equidistant fisheye, `r = f theta`: the angle from the axis is proportional to the distance from the centre.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::grid;
use super::lens::{sane, seen};
use super::model::CameraModel;
use super::radial::{self, Radial};
use super::schema::{CX, CY, LensSchema, Parameter, ParameterSchema, Resize, scalars};
use super::values::{Parametric, Values};
use crate::error::Result;

const NAME: &str = "equidistant";

/// Equidistant fisheye: `(u, v) = (cx, cy) + f theta (cos phi, sin phi)`, valid over the whole sphere but the backward axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Equidistant {
    /// Focal length in pixels per radian.
    pub focal_px: f64,
    /// Column of the principal point in pixels.
    pub cx: f64,
    /// Row of the principal point in pixels.
    pub cy: f64,
}

impl Parametric for Equidistant {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "r = focal_px theta.",
        parameters: &[ParameterSchema::required("focal_px", Resize::Length, "focal length, pixels per radian"), CX, CY],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let [focal_px, cx, cy] = given.numbers();
        Self::new(focal_px, cx, cy)
    }

    fn values(&self) -> Vec<Parameter> {
        scalars(&[&[self.focal_px, self.cx, self.cy]])
    }
}

impl Equidistant {
    /// Checks the parameters.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`](crate::Error::InvalidCamera) if the focal length is below `1e-5` pixels, the centre beyond `1e9`
    /// pixels, or a number not finite.
    pub fn new(focal_px: f64, cx: f64, cy: f64) -> Result<Self> {
        grid::positive(NAME, "focal_px", focal_px)?;
        grid::centre(NAME, [cx, cy])?;
        Ok(Self { focal_px, cx, cy })
    }
}

impl Radial for Equidistant {
    fn radius(&self, theta: f64) -> Option<(f64, f64)> {
        (theta < self.max_theta_rad()).then_some((self.focal_px * theta, self.focal_px))
    }

    fn theta(&self, radius: f64) -> Option<(f64, f64)> {
        let theta = radius / self.focal_px;
        (theta < self.max_theta_rad()).then_some((theta, 1.0 / self.focal_px))
    }
}

impl CameraModel for Equidistant {
    fn project(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        seen(radial::point(self, sane(bearing)?)? + Vector2::new(self.cx, self.cy))
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        radial::bearing(self, &seen(pixel - Vector2::new(self.cx, self.cy))?)
    }

    fn project_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (point, jacobian) = radial::project(self, sane(bearing)?)?;
        Some((point + Vector2::new(self.cx, self.cy), jacobian))
    }

    fn unproject_jacobian(&self, pixel: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        radial::unproject(self, &(pixel - Vector2::new(self.cx, self.cy)))
    }

    fn max_theta_rad(&self) -> f64 {
        std::f64::consts::PI
    }
}
