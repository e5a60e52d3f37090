//! The camera of an image that has been made larger or smaller.

use super::Model;
use super::calibrated::{Camera, LARGEST_SIDE_PX};
use crate::error::{Error, Result};

impl Camera {
    /// The camera of the image resized by `factor`: what was at `u` is at `factor (u + 1/2) - 1/2`. The size is rounded to
    /// whole pixels; an equirectangular camera covers the sphere with them.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless `factor` is positive and finite and the sides of the new image are from 1 to
    /// [`LARGEST_SIDE_PX`] pixels.
    pub fn scaled(&self, factor: f64) -> Result<Self> {
        let sides = [self.width(), self.height()].map(|side| (f64::from(side) * factor).round());
        if !(factor > 0.0 && sides.iter().all(|side| (1.0..=f64::from(LARGEST_SIDE_PX)).contains(side))) {
            let expected = format!("a positive factor that leaves from 1 to {LARGEST_SIDE_PX} pixels a side");
            return Err(Error::argument("factor", factor, expected));
        }
        let [width, height] = sides.map(|side| side as u32);
        let model = self.model();
        let schemas = model.schema().parameters.iter().zip(model.parameters());
        let parameters: Vec<_> =
            schemas.map(|(schema, (name, value))| (name.to_owned(), schema.resize.apply(value, factor))).collect();
        let camera = Self::new(width, height, Model::from_parameters(model.name(), width, height, &parameters)?)?;
        let camera = if self.max_theta_rad() < camera.max_theta_rad() {
            camera.with_max_theta_rad(self.max_theta_rad())?
        } else {
            camera
        };
        Ok(if self.is_mirrored() { camera.mirrored() } else { camera })
    }
}
