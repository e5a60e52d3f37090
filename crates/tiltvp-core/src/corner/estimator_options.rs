//! What is known of a corner and of the camera's motion before images are looked at.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::attitude::IncludedAngle;
use crate::error::{Error, Result};
use crate::options;
use crate::options::{NOT_NEGATIVE, POSITIVE};

options! {
    /// What is known, and how far frames are apart.
    pub struct EstimatorOptions {
        /// The angle between the horizontal edges.
        [flat] angle: IncludedAngle = IncludedAngle::RIGHT;
        /// Whether the edges x, y, z, clockwise in the image, are a right-handed triple: true for outer corners, false for inner
        /// ones, none where both are possible; the coloured cuboid's is an outer one.
        right_handed: Option<bool> = None;
        /// The direction down in the left camera's frame, before anything was seen; none where nothing is known.
        down: Option<Vector3<f64>> = None;
        /// Standard deviation of that direction, radians.
        down_sigma_rad: f64 = 15f64.to_radians() => POSITIVE, "a positive angle";
        /// How far the camera may turn from one frame to the next, radians, as a standard deviation.
        turn_sigma_rad: f64 = 6f64.to_radians() => POSITIVE, "a positive angle";
        /// Frames without a pose after which the last one is forgotten; 0 never follows.
        forget_after: u32 = 10;
        /// How far attitudes of several features of one image may be apart, radians.
        agree_max_rad: f64 = 4f64.to_radians() => POSITIVE, "a positive angle";
        /// How far a corner's own attitude may be from that which all straight edges of a pair of images have in common, radians,
        /// for its edges to be taken as parallel to them; 0 takes none as parallel.
        parallel_max_rad: f64 = 4f64.to_radians() => 0.0..=PI, "an angle from 0 to pi";
        /// How far the attitudes of one corner in both images may be apart, and the rays from the fused pose, in standard
        /// deviations of the covariances as they are: root mean square per degree of freedom.
        misfit_max: f64 = 5.0 => POSITIVE, "a positive number of standard deviations";
        /// The least distance of a vertex, metres.
        distance_min_m: f64 = 0.05 => POSITIVE, "a positive number of metres";
        /// The largest distance of a vertex, metres.
        distance_max_m: f64 = 100.0
            => |o: &EstimatorOptions, x| x > o.distance_min_m, "a number of metres above distance_min_m";
        /// How far one camera is above the level plane through the vertex, metres, as above the floor for a corner on the floor: it
        /// tells the place. None where that is not known, and for two cameras, which tell it themselves.
        camera_height_m: Option<f64> = None;
        /// Standard deviation of that height, metres.
        camera_height_sigma_m: f64 = 0.0 => NOT_NEGATIVE, "a number of metres from 0";
        /// Least probability of the best hypothesis; below it none is chosen.
        probability_min: f64 = 0.9 => 0.0..=1.0, "a probability from 0 to 1";
    }
    check priors
}

fn priors(options: &EstimatorOptions) -> Result<()> {
    if let Some(height_m) = options.camera_height_m.filter(|height_m| !(*height_m > 0.0 && height_m.is_finite())) {
        return Err(Error::option("camera_height_m", height_m, "a positive number of metres"));
    }
    match options.down.map(|down| down.norm()) {
        Some(length) if (length - 1.0).abs() >= 1e-6 || length.is_nan() => {
            Err(Error::argument("down", format!("a vector of length {length}"), "a unit vector"))
        }
        _ => Ok(()),
    }
}
