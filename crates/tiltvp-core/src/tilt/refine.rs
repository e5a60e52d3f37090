//! The refined method: exact normals weighted by their gradients, trimmed from the upright prior, then a fading soft gate.

use nalgebra::Vector3;

use crate::error::{Error, Result};
use crate::robust::{Direction, FitReport, Real, RejectRefitOptions, ReweightOptions, Rows, reject_refit, reweight};

/// Options of the refined method. Angles are those between an edge's great circle and the vertical.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefineOptions {
    /// Share of normal residuals that each trimming round keeps. Default 0.8.
    pub keep_fraction: f64,
    /// Standard deviation in radians of the soft gate at the end: how far the edges of vertical things stray. Default 2 degrees.
    pub scale_rad: f64,
    /// Change of the direction in radians below which it has converged. Default 3.5e-4, a fiftieth of a degree.
    pub tolerance_rad: f64,
    /// Most refits with the gate at its final scale. Default 4.
    pub max_iterations: u32,
}

impl Default for RefineOptions {
    fn default() -> Self {
        Self { keep_fraction: 0.8, scale_rad: 2f64.to_radians(), tolerance_rad: 3.5e-4, max_iterations: 4 }
    }
}

impl RefineOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        if !(self.keep_fraction > 0.0 && self.keep_fraction < 1.0) {
            return Err(Error::option("keep_fraction", self.keep_fraction, "a share strictly between 0 and 1"));
        }
        if !(self.scale_rad > 0.0 && self.scale_rad < 1.0) {
            return Err(Error::option("scale_rad", self.scale_rad, "an angle strictly between 0 and 1 radian"));
        }
        if !(self.tolerance_rad >= 0.0 && self.tolerance_rad.is_finite()) {
            return Err(Error::option("tolerance_rad", self.tolerance_rad, "an angle of zero or more"));
        }
        if self.max_iterations == 0 {
            return Err(Error::option("max_iterations", self.max_iterations, "at least 1"));
        }
        Ok(())
    }
}

/// Rounds in which the soft gate fades from one and a half scales to one.
const FADING: u32 = 2;

/// Most rounds of trimming.
const TRIMMING_ROUNDS: u32 = 15;

/// Trims from the upright prior until the residuals are no larger than half the final scale or nothing changes, then
/// reweights with a gate that fades to the final scale. `weights` are those of the normals and are not altered; `trimmed` is scratch.
pub(super) fn refine<T: Real>(
    rows: &Rows<T>,
    options: &RefineOptions,
    weights: &mut [f32],
    trimmed: &mut Vec<f32>,
) -> FitReport<Vector3<f64>> {
    let problem = Direction::new(rows);
    trimmed.clear();
    trimmed.extend_from_slice(weights);
    let trimming = RejectRefitOptions {
        keep_fraction: options.keep_fraction,
        max_iterations: TRIMMING_ROUNDS,
        tolerance: options.tolerance_rad,
        rms_min: 0.5 * options.scale_rad,
    };
    let start = reject_refit(&problem, &trimming, &Vector3::z(), trimmed);
    let Some(direction) = start.model else { return start };
    let fading = ReweightOptions {
        first_scale: 1.5 * options.scale_rad,
        last_scale: options.scale_rad,
        shrinking: FADING,
        max_iterations: options.max_iterations,
        tolerance: options.tolerance_rad,
    };
    reweight(&problem, &fading, &direction, weights)
}
