//! Which pixels are looked at for edges.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::image::Smoother;

/// Options of the edge extraction, paper 000 section 2.1.2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeOptions {
    /// Least gradient magnitude `I_min` of an edge pixel, for the Scharr kernel (3, 10, 3) on 8-bit grey levels. Default 150.
    pub gradient_min: f64,
    /// Standard deviation of the Gaussian before the Scharr kernel in pixels, 0 for none. Default 0.
    pub smoothing_px: f64,
    /// Lowest elevation above the robot's horizon in radians. Default 0.
    pub elevation_min_rad: f64,
    /// Highest elevation above the robot's horizon in radians. Default pi / 4.
    pub elevation_max_rad: f64,
    /// Pixels kept clear of the lens' rim, the image border and the mask, beside those the kernels reach. Default 1.
    pub margin_px: f64,
}

impl Default for EdgeOptions {
    fn default() -> Self {
        Self {
            gradient_min: 150.0,
            smoothing_px: 0.0,
            elevation_min_rad: 0.0,
            elevation_max_rad: FRAC_PI_4,
            margin_px: 1.0,
        }
    }
}

impl EdgeOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        if !(self.gradient_min > 0.0 && self.gradient_min.is_finite()) {
            return Err(Error::option("gradient_min", self.gradient_min, "a positive gradient magnitude"));
        }
        if !(0.0..=10.0).contains(&self.smoothing_px) {
            return Err(Error::option("smoothing_px", self.smoothing_px, "a standard deviation from 0 to 10 pixels"));
        }
        if !(0.0..=1000.0).contains(&self.margin_px) {
            return Err(Error::option("margin_px", self.margin_px, "a width from 0 to 1000 pixels"));
        }
        if !(-FRAC_PI_2..=FRAC_PI_2).contains(&self.elevation_min_rad) {
            return Err(Error::option("elevation_min_rad", self.elevation_min_rad, "an angle from -pi/2 to pi/2"));
        }
        if !(self.elevation_max_rad > self.elevation_min_rad && self.elevation_max_rad <= FRAC_PI_2) {
            return Err(Error::option(
                "elevation_max_rad",
                self.elevation_max_rad,
                "an angle above elevation_min_rad and at most pi/2",
            ));
        }
        Ok(())
    }

    /// How far from a pixel the kernels and the margin reach, in whole pixels.
    pub(super) fn reach_px(&self) -> usize {
        1 + Smoother::radius(self.smoothing_px) + self.margin_px.ceil() as usize
    }
}

/// Which pixels may be used at all: `true` where the image shows the world and not the robot. Clones share the pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    width: usize,
    height: usize,
    usable: Arc<[bool]>,
}

impl Mask {
    /// A mask in row order.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless there is one value for each pixel.
    pub fn new(width: usize, height: usize, usable: Vec<bool>) -> Result<Self> {
        if width.checked_mul(height) != Some(usable.len()) {
            return Err(Error::argument(
                "mask",
                format!("{} values", usable.len()),
                format!("{height} x {width} values"),
            ));
        }
        Ok(Self { width, height, usable: usable.into() })
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Whether pixel `(u, v)` may be used; `false` outside the mask.
    pub fn usable(&self, u: usize, v: usize) -> bool {
        u < self.width && self.usable.get(v * self.width + u).copied().unwrap_or(false)
    }
}
