//! What is known of a corner and of the camera's motion before images are looked at.

use nalgebra::Vector3;

use super::attitude::IncludedAngle;
use crate::error::{Error, Result};

/// What is known, and how far frames are apart.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimatorOptions {
    /// The angle between the horizontal edges. Default a right one.
    pub angle: IncludedAngle,
    /// Whether the edges x, y, z, clockwise in the image, are a right-handed triple: true for outer corners, false for inner
    /// ones, none where both are possible. Default none; the coloured cuboid's is an outer one.
    pub right_handed: Option<bool>,
    /// The direction down in the left camera's frame, before anything was seen; none where nothing is known. Default none.
    pub down: Option<Vector3<f64>>,
    /// Standard deviation of that direction, radians. Default 15 degrees.
    pub down_sigma_rad: f64,
    /// How far the camera may turn from one frame to the next, radians, as a standard deviation. Default 6 degrees.
    pub turn_sigma_rad: f64,
    /// Frames without a pose after which the last one is forgotten; 0 never follows. Default 10.
    pub forget_after: u32,
    /// How far attitudes of several features of one image may be apart, radians. Default 4 degrees.
    pub agree_max_rad: f64,
    /// How far a corner's own attitude may be from that which all straight edges of a pair of images have in common, radians,
    /// for its edges to be taken as parallel to them; 0 takes none as parallel. Default 4 degrees.
    pub parallel_max_rad: f64,
    /// How far the attitudes of one corner in both images may be apart, and the rays from the fused pose, in standard
    /// deviations of the covariances as they are: root mean square per degree of freedom. Default 5.
    pub misfit_max: f64,
    /// The least and the largest distance of a vertex, metres. Default 0.05 and 100.
    pub distance_m: [f64; 2],
    /// Least probability of the best hypothesis; below it none is chosen. Default 0.9.
    pub probability_min: f64,
}

impl Default for EstimatorOptions {
    fn default() -> Self {
        Self {
            angle: IncludedAngle::RIGHT,
            right_handed: None,
            down: None,
            down_sigma_rad: 15f64.to_radians(),
            turn_sigma_rad: 6f64.to_radians(),
            forget_after: 10,
            agree_max_rad: 4f64.to_radians(),
            parallel_max_rad: 4f64.to_radians(),
            misfit_max: 5.0,
            distance_m: [0.05, 100.0],
            probability_min: 0.9,
        }
    }
}

impl EstimatorOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        self.angle.validate()?;
        let positive = |name, value: f64, expected| {
            if value > 0.0 && value.is_finite() { Ok(()) } else { Err(Error::option(name, value, expected)) }
        };
        if let Some(down) = &self.down
            && ((down.norm() - 1.0).abs() >= 1e-6 || down.norm().is_nan())
        {
            return Err(Error::argument("down", format!("a vector of length {}", down.norm()), "a unit vector"));
        }
        positive("down_sigma_rad", self.down_sigma_rad, "a positive angle")?;
        positive("turn_sigma_rad", self.turn_sigma_rad, "a positive angle")?;
        positive("agree_max_rad", self.agree_max_rad, "a positive angle")?;
        if !(0.0..=std::f64::consts::PI).contains(&self.parallel_max_rad) {
            return Err(Error::option("parallel_max_rad", self.parallel_max_rad, "an angle from 0 to pi"));
        }
        positive("misfit_max", self.misfit_max, "a positive number of standard deviations")?;
        let [nearest, farthest] = self.distance_m;
        if !(nearest > 0.0 && farthest > nearest) {
            return Err(Error::option(
                "distance_m",
                format!("[{nearest}, {farthest}]"),
                "0 < nearest < farthest, metres",
            ));
        }
        if !(0.0..=1.0).contains(&self.probability_min) {
            return Err(Error::option("probability_min", self.probability_min, "a probability from 0 to 1"));
        }
        Ok(())
    }
}
