//! A camera over slices: the model is looked up once per batch, and rays without an answer are NaN.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::calibrated::Camera;
use super::with_model;
use crate::error::{Error, Result};

impl Camera {
    /// The pixels that see bearings, NaN where there is none. Both sides take vectors or arrays of `f64`.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the slices differ in length.
    pub fn project_all<B, P>(&self, bearings: &[B], pixels: &mut [P]) -> Result<()>
    where
        B: Copy + Into<Vector3<f64>>,
        P: From<Vector2<f64>>,
    {
        same_length("pixels", bearings.len(), pixels.len())?;
        with_model!(self.model(), model => {
            for (bearing, pixel) in bearings.iter().zip(pixels) {
                *pixel = self.project_by(model, &(*bearing).into()).unwrap_or_else(|| Vector2::repeat(f64::NAN)).into();
            }
        });
        Ok(())
    }

    /// The unit bearings that pixels see, NaN where there is none. Both sides take vectors or arrays of `f64`.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the slices differ in length.
    pub fn unproject_all<P, B>(&self, pixels: &[P], bearings: &mut [B]) -> Result<()>
    where
        P: Copy + Into<Vector2<f64>>,
        B: From<Vector3<f64>>,
    {
        same_length("bearings", pixels.len(), bearings.len())?;
        with_model!(self.model(), model => {
            for (pixel, bearing) in pixels.iter().zip(bearings) {
                *bearing = self.unproject_by(model, &(*pixel).into()).unwrap_or_else(|| Vector3::repeat(f64::NAN)).into();
            }
        });
        Ok(())
    }

    /// [`project_all`](Self::project_all) with `d pixel / d bearing`, NaN where there is none.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the slices differ in length.
    pub fn project_jacobian_all<B, P>(
        &self,
        bearings: &[B],
        pixels: &mut [P],
        jacobians: &mut [Matrix2x3<f64>],
    ) -> Result<()>
    where
        B: Copy + Into<Vector3<f64>>,
        P: From<Vector2<f64>>,
    {
        same_length("pixels", bearings.len(), pixels.len())?;
        same_length("jacobians", bearings.len(), jacobians.len())?;
        with_model!(self.model(), model => {
            for ((bearing, pixel), jacobian) in bearings.iter().zip(pixels).zip(jacobians) {
                let (p, j) = self
                    .project_jacobian_by(model, &(*bearing).into())
                    .unwrap_or_else(|| (Vector2::repeat(f64::NAN), Matrix2x3::repeat(f64::NAN)));
                (*pixel, *jacobian) = (p.into(), j);
            }
        });
        Ok(())
    }

    /// [`unproject_all`](Self::unproject_all) with `d bearing / d pixel`, NaN where there is none.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the slices differ in length.
    pub fn unproject_jacobian_all<P, B>(
        &self,
        pixels: &[P],
        bearings: &mut [B],
        jacobians: &mut [Matrix3x2<f64>],
    ) -> Result<()>
    where
        P: Copy + Into<Vector2<f64>>,
        B: From<Vector3<f64>>,
    {
        same_length("bearings", pixels.len(), bearings.len())?;
        same_length("jacobians", pixels.len(), jacobians.len())?;
        with_model!(self.model(), model => {
            for ((pixel, bearing), jacobian) in pixels.iter().zip(bearings).zip(jacobians) {
                let (b, j) = self
                    .unproject_jacobian_by(model, &(*pixel).into())
                    .unwrap_or_else(|| (Vector3::repeat(f64::NAN), Matrix3x2::repeat(f64::NAN)));
                (*bearing, *jacobian) = (b.into(), j);
            }
        });
        Ok(())
    }
}

fn same_length(name: &'static str, expected: usize, got: usize) -> Result<()> {
    if expected == got {
        Ok(())
    } else {
        Err(Error::argument(name, format!("{got} places"), format!("{expected}, one per input")))
    }
}
