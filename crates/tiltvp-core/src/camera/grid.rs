//! The last step of every lens: its image plane to pixels, by an affine map.

use std::ops::RangeInclusive;

use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, Vector2};

use crate::error::{Error, Result};

/// `pixel = A point + c`, kept with the inverse of `A`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PixelGrid {
    pixel_from_point: Matrix2<f64>,
    point_from_pixel: Matrix2<f64>,
    centre: Vector2<f64>,
}

impl PixelGrid {
    /// The grid of focal lengths `[fx, fy]`, a skew and a centre `[cx, cy]`, all in pixels:
    /// `u = fx x + skew y + cx`, `v = fy y + cy`.
    pub(super) fn new(model: &'static str, focal_px: [f64; 2], skew: f64, centre_px: [f64; 2]) -> Result<Self> {
        for (name, value) in ["fx", "fy"].into_iter().zip(focal_px) {
            positive(model, name, value)?;
        }
        finite(model, ["skew"], [skew])?;
        Self::affine(model, Matrix2::new(focal_px[0], skew, 0.0, focal_px[1]), centre_px)
    }

    /// The grid of any matrix that does not turn the image over.
    pub(super) fn affine(model: &'static str, matrix: Matrix2<f64>, centre_px: [f64; 2]) -> Result<Self> {
        centre(model, centre_px)?;
        match matrix.try_inverse() {
            Some(inverse) if matrix.determinant() > 0.0 && inverse.iter().all(|x| x.is_finite()) => {
                Ok(Self { pixel_from_point: matrix, point_from_pixel: inverse, centre: centre_px.into() })
            }
            _ => Err(Error::camera(
                model,
                "the affine map to pixels",
                format!("{:?}", matrix.transpose().as_slice()),
                "a matrix with a positive determinant and an inverse",
            )),
        }
    }

    /// `[fx, fy, cx, cy]`.
    pub(super) fn focal_and_centre(&self) -> [f64; 4] {
        let (matrix, centre) = (&self.pixel_from_point, &self.centre);
        [matrix.m11, matrix.m22, centre.x, centre.y]
    }

    pub(super) fn matrix(&self) -> &Matrix2<f64> {
        &self.pixel_from_point
    }

    #[inline]
    pub(super) fn pixel(&self, point: &Vector2<f64>) -> Vector2<f64> {
        self.pixel_from_point * point + self.centre
    }

    #[inline]
    pub(super) fn point(&self, pixel: &Vector2<f64>) -> Vector2<f64> {
        self.point_from_pixel * (pixel - self.centre)
    }

    /// `d pixel / d bearing` from `d point / d bearing`.
    #[inline]
    pub(super) fn pixel_jacobian(&self, point_jacobian: &Matrix2x3<f64>) -> Matrix2x3<f64> {
        self.pixel_from_point * point_jacobian
    }

    /// `d bearing / d pixel` from `d bearing / d point`.
    #[inline]
    pub(super) fn bearing_jacobian(&self, point_jacobian: &Matrix3x2<f64>) -> Matrix3x2<f64> {
        point_jacobian * self.point_from_pixel
    }
}

/// No lens has a focal length, in pixels, or another scale below this: its image is a point. Places in the largest images are known
/// to 1e-11 pixels by their rounding, which at this focal length is a millionth of a radian.
const SMALLEST: f64 = 1e-5;

/// No image is farther from the axis of its lens than this, in pixels: ten thousand of the longest sides. Rounding of places beyond
/// would be seen, at a ten-millionth of a pixel here.
const WITHIN_PX: RangeInclusive<f64> = -1e9..=1e9;

/// Refuses a parameter that is not a positive finite number of ordinary size.
pub(super) fn positive(model: &'static str, name: &str, value: f64) -> Result<()> {
    if value.is_finite() && value >= SMALLEST {
        return Ok(());
    }
    let expected = if value > 0.0 { "a number from 1e-5 on" } else { "a positive finite number" };
    Err(Error::camera(model, name, value, expected))
}

/// Refuses a centre `[cx, cy]` that is not finite or too far from any image.
pub(super) fn centre(model: &'static str, centre_px: [f64; 2]) -> Result<()> {
    match ["cx", "cy"].into_iter().zip(centre_px).find(|(_, value)| !WITHIN_PX.contains(value)) {
        Some((name, value)) => Err(Error::camera(model, name, value, "pixels from -1e9 to 1e9")),
        None => Ok(()),
    }
}

/// Refuses parameters that are not finite.
pub(super) fn finite<const N: usize>(model: &'static str, names: [&str; N], values: [f64; N]) -> Result<()> {
    for (name, value) in names.into_iter().zip(values) {
        if !value.is_finite() {
            return Err(Error::camera(model, name, value, "a finite number"));
        }
    }
    Ok(())
}
