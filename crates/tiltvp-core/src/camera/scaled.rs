//! The camera of an image that has been made larger or smaller.

use super::any::Model;
use super::calibrated::Camera;
use super::parameters::Parameter;
use crate::error::{Error, Result};

impl Camera {
    /// The camera of the image resized by `factor`: what was at `u` is at `factor (u + 1/2) - 1/2`. The size is rounded to
    /// whole pixels; an equirectangular camera covers the sphere with them.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless `factor` is positive and finite and the new image has from 1 to 2^16 pixels a side.
    pub fn scaled(&self, factor: f64) -> Result<Self> {
        let sides = [self.width(), self.height()].map(|side| (f64::from(side) * factor).round());
        if !(factor > 0.0 && sides.iter().all(|side| (1.0..=65_536.0).contains(side))) {
            let expected = "a positive factor that leaves from 1 to 65536 pixels a side";
            return Err(Error::argument("factor", factor, expected));
        }
        let [width, height] = sides.map(|side| side as u32);
        let model = self.model();
        let parameters: Vec<_> = model
            .parameters()
            .into_iter()
            .map(|(name, value)| (name.to_owned(), scaled_parameter(model, name, value, factor)))
            .collect();
        let camera = Self::new(width, height, Model::from_parameters(model.name(), width, height, &parameters)?)?;
        let camera = if self.max_theta_rad() < camera.max_theta_rad() {
            camera.with_max_theta_rad(self.max_theta_rad())?
        } else {
            camera
        };
        Ok(if self.is_mirrored() { camera.mirrored() } else { camera })
    }
}

/// A parameter in the pixels of the resized image. Whatever is no length in pixels stays as it is.
fn scaled_parameter(model: &Model, name: &str, value: Parameter, factor: f64) -> Parameter {
    match (model, name, value) {
        (_, "cx" | "cy", Parameter::Scalar(centre)) => Parameter::Scalar((centre + 0.5) * factor - 0.5),
        (_, "fx" | "fy" | "skew" | "focal_px", Parameter::Scalar(length))
        | (Model::RadialPolynomial(_), "k1" | "k2" | "k3" | "k4", Parameter::Scalar(length)) => {
            Parameter::Scalar(length * factor)
        }
        // Height over radius, both in pixels: z = sum a_i rho^i.
        (Model::Ocam(_), "polynomial", Parameter::List(a)) => {
            Parameter::List(a.iter().enumerate().map(|(i, a)| a * factor.powi(1 - i as i32)).collect())
        }
        // Radius in pixels over an angle.
        (Model::Ocam(_), "inverse_polynomial", Parameter::List(a)) => {
            Parameter::List(a.iter().map(|a| a * factor).collect())
        }
        (_, _, value) => value,
    }
}
