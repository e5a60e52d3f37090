//! Which pixels are looked at for edges.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::image::Smoother;
use crate::options;
use crate::options::{Kind, OptionValue, POSITIVE, Value};

options! {
    /// Options of the edge extraction (Fleer 2017, section 2.1.2).
    #[derive(Copy)]
    pub struct EdgeOptions {
        /// Least gradient magnitude `I_min` of an edge pixel, for the Scharr kernel (3, 10, 3) on 8-bit grey levels.
        gradient_min: f64 = 150.0 => POSITIVE, "a positive gradient magnitude";
        /// Standard deviation of the Gaussian before the Scharr kernel in pixels, 0 for none.
        smoothing_px: f64 = 0.0 => 0.0..=10.0, "a standard deviation from 0 to 10 pixels";
        /// Lowest elevation above the robot's horizon in radians.
        elevation_min_rad: f64 = 0.0 => -FRAC_PI_2..=FRAC_PI_2, "an angle from -pi/2 to pi/2";
        /// Highest elevation above the robot's horizon in radians.
        elevation_max_rad: f64 = FRAC_PI_4
            => |o: &EdgeOptions, x| x > o.elevation_min_rad && x <= FRAC_PI_2,
            "an angle above elevation_min_rad and at most pi/2";
        /// Pixels kept clear of the lens' rim, the image border and the mask, beside those the kernels reach.
        margin_px: f64 = 1.0 => 0.0..=1000.0, "a width from 0 to 1000 pixels";
    }
}

impl EdgeOptions {
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

impl OptionValue for Mask {
    const KIND: Kind = Kind::Mask;

    fn to_value(&self) -> Value {
        Value::Mask(vec![self.height, self.width], Arc::clone(&self.usable))
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Mask(shape, usable) => match *shape.as_slice() {
                [height, width] if width.checked_mul(height) == Some(usable.len()) => {
                    Some(Self { width, height, usable: Arc::clone(usable) })
                }
                _ => None,
            },
            _ => None,
        }
    }
}
