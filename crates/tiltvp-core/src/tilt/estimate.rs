//! What an estimator answers.

use nalgebra::{Matrix2, Vector3};

use super::doubt::Doubt;
use crate::geometry::Tilt;
use crate::robust::Stop;

/// How many alternatives an estimate tells at most.
pub const ALTERNATIVES: usize = 4;

/// A direction that may be up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    /// Unit ground normal in the robot frame.
    pub normal: Vector3<f64>,
    /// Probability of being the right one of all.
    pub probability: f64,
}

/// The tilt of one image, with how sure the estimator is of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltEstimate {
    /// The lean, `None` if the image does not determine one (the reason is in [`stop`](Self::stop)).
    pub tilt: Option<Tilt>,
    /// Covariance in squared radians of the ground normal in its tangent plane, in the basis of
    /// [`tangent_basis`](crate::geometry::tangent_basis) (close to the robot's `x` and `y`); infinite without a tilt.
    pub covariance_rad2: Matrix2<f64>,
    /// Probability, in `[0, 1]`, that the error is below two degrees and no alternative is right; 0 without a tilt.
    pub confidence: f64,
    /// Edge pixels in the elevation band; of the method of straight edges those that are part of one.
    pub edge_pixels: usize,
    /// Edge pixels that passed the prefilter and were not left out.
    pub prefiltered_pixels: usize,
    /// Edge pixels that agree with the estimate.
    pub inlier_pixels: usize,
    /// The shift `l` of the vanishing point in pixels (eq. 20) before any factor; only of the image-space methods.
    pub shift_px: Option<f64>,
    /// Directions that may be up, the most probable first; only of the method of straight edges. The first is the tilt, where there is
    /// one.
    pub alternatives: [Option<Alternative>; ALTERNATIVES],
    /// Root mean square residual of the inliers: radians, or pixels for the image-space methods; NaN without a tilt.
    pub residual_rms: f64,
    /// Random samples or refits done.
    pub iterations: u32,
    /// Why the fit stopped.
    pub stop: Stop,
    /// What most likely keeps the estimate from being sure of itself; `None` where it is sure.
    pub doubt: Option<Doubt>,
}

impl TiltEstimate {
    /// Why the fit stopped, and what most likely keeps the estimate from being sure of itself: a sentence.
    pub fn reason(&self) -> String {
        match self.doubt {
            Some(doubt) => format!("{}; {doubt}", self.stop),
            None => self.stop.to_string(),
        }
    }
}

/// One edge pixel of the last image, for pictures and experiments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeElement {
    /// Column.
    pub u: u16,
    /// Row.
    pub v: u16,
    /// Gradient direction in `[0, pi)` radians, eq. 16.
    pub phi_rad: f64,
    /// Edge offset in pixels, eq. 17; NaN where the vertical vanishing point is out of the lens' reach.
    pub offset_px: f64,
    /// Unit normal of the edge's great circle in the robot frame, as the method makes it (eq. 37 or exact); NaN for the
    /// image-space methods, which have none.
    pub normal: [f32; 3],
    /// Whether it passed the prefilter and was not left out.
    pub prefiltered: bool,
    /// Whether it agrees with the estimate.
    pub inlier: bool,
}
