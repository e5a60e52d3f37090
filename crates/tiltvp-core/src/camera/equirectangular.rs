//! The panorama of the whole sphere: columns are longitude, rows are latitude.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix2x3, Matrix3x2, RowVector3, Vector2, Vector3};

use super::lens::{sane, seen};
use super::model::CameraModel;
use super::schema::{LensSchema, Parameter};
use super::values::{Parametric, Values};
use crate::error::{Error, Result};

const NAME: &str = "equirectangular";

/// Equirectangular: `u = (lon / 2 pi + 1/2) W - 1/2`, `v = (1/2 - lat / pi) H - 1/2`, with the bearing
/// `(cos lat sin lon, -sin lat, cos lat cos lon)`.
///
/// Valid over the whole sphere and the whole image, to the outer edges of its border pixels. At the poles, where all
/// longitudes meet, there is no derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct Equirectangular {
    width: u32,
    height: u32,
}

impl Parametric for Equirectangular {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "A whole-sphere panorama: longitude ((u + 0.5) / width - 0.5) 2 pi, latitude (0.5 - (v + 0.5) / height) pi.",
        parameters: &[],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let [width, height] = given.size();
        Self::new(width, height)
    }

    fn values(&self) -> Vec<Parameter> {
        Vec::new()
    }
}

impl Equirectangular {
    /// The panorama that fills an image of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if a side is zero.
    pub fn new(width: u32, height: u32) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(Error::camera(NAME, "width, height", format!("{width} x {height}"), "at least one pixel"));
        }
        Ok(Self { width, height })
    }

    /// Pixels per radian of longitude and of latitude.
    #[inline]
    fn scale(&self) -> (f64, f64) {
        (f64::from(self.width) / TAU, f64::from(self.height) / PI)
    }

    /// `(longitude, latitude)` of a pixel.
    #[inline]
    fn angles(&self, pixel: &Vector2<f64>) -> Option<(f64, f64)> {
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        let inside = (-0.5..=w - 0.5).contains(&pixel.x) && (-0.5..=h - 0.5).contains(&pixel.y);
        inside.then(|| (((pixel.x + 0.5) / w - 0.5) * TAU, (0.5 - (pixel.y + 0.5) / h) * PI))
    }
}

impl CameraModel for Equirectangular {
    #[inline]
    fn project(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        let b = sane(bearing)?;
        let (per_lon, per_lat) = self.scale();
        let (lon, lat) = (b.x.atan2(b.z), (-b.y).atan2(b.x.hypot(b.z)));
        let centre = Vector2::new(f64::from(self.width) - 1.0, f64::from(self.height) - 1.0) * 0.5;
        seen(centre + Vector2::new(lon * per_lon, -lat * per_lat))
    }

    #[inline]
    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let (lon, lat) = self.angles(pixel)?;
        let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (lon.sin_cos(), lat.sin_cos());
        Some(Vector3::new(cos_lat * sin_lon, -sin_lat, cos_lat * cos_lon))
    }

    fn project_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let pixel = self.project(bearing)?;
        let (per_lon, per_lat) = self.scale();
        let (x, y, z) = (bearing.x, bearing.y, bearing.z);
        let n2 = bearing.norm_squared();
        let level2 = x * x + z * z;
        if level2 <= f64::EPSILON * f64::EPSILON * n2 {
            return None;
        }
        let level = level2.sqrt();
        let lon = RowVector3::new(z / level2, 0.0, -x / level2) * per_lon;
        // -d lat = (level^2 dy - y (x dx + z dz)) / (level n^2)
        let lat = RowVector3::new(-x * y / level, level, -z * y / level) * (per_lat / n2);
        Some((pixel, Matrix2x3::from_rows(&[lon, lat])))
    }

    fn unproject_jacobian(&self, pixel: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        let bearing = self.unproject(pixel)?;
        let (lon, lat) = self.angles(pixel)?;
        let (per_lon, per_lat) = self.scale();
        let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (lon.sin_cos(), lat.sin_cos());
        let by_u = Vector3::new(cos_lat * cos_lon, 0.0, -cos_lat * sin_lon) / per_lon;
        let by_v = Vector3::new(sin_lat * sin_lon, cos_lat, sin_lat * cos_lon) / per_lat;
        Some((bearing, Matrix3x2::from_columns(&[by_u, by_v])))
    }

    fn max_theta_rad(&self) -> f64 {
        PI
    }

    fn image_size(&self) -> Option<[u32; 2]> {
        Some([self.width, self.height])
    }
}
