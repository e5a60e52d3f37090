//! What is known of a corner and of the camera's motion before images are looked at.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::attitude::IncludedAngle;
use crate::error::{Error, Result};
use crate::options::{NOT_NEGATIVE, OptionValue, POSITIVE};
use crate::{options, words};

words! {
    /// An edge of a corner.
    pub enum KnownEdge {
        /// A level one.
        X = "x",
        /// The upright one.
        Y = "y",
        /// The other level one.
        Z = "z",
    }
}

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
        /// How far a corner's own attitude may be from that which most straight edges of the images have in common, radians,
        /// for its edges to be taken as parallel to them; 0 takes none as parallel.
        parallel_max_rad: f64 = 4f64.to_radians() => 0.0..=PI, "an angle from 0 to pi";
        /// How far the attitudes of one corner in both images may be apart, those of several corners in one image, and the rays
        /// from the fused pose, in standard deviations of the covariances as they are: root mean square per degree of freedom.
        misfit_max: f64 = 5.0 => POSITIVE, "a positive number of standard deviations";
        /// The least distance of a vertex, metres.
        distance_min_m: f64 = 0.05 => POSITIVE, "a positive number of metres";
        /// The largest distance of a vertex, metres.
        distance_max_m: f64 = 100.0
            => |o: &EstimatorOptions, x| x > o.distance_min_m, "a number of metres above distance_min_m";
        /// How far one camera is above the level plane through the vertex, metres: it tells the place. Without colours the vertex is of
        /// a corner whose upright edge rises from it, as of what stands on the floor. None where that is not known, and for two
        /// cameras, which tell it themselves.
        camera_height_m: Option<f64> = None;
        /// Standard deviation of that height, metres.
        camera_height_sigma_m: f64 = 0.0 => NOT_NEGATIVE, "a number of metres from 0";
        /// The length of one edge of the corner, metres, which tells one camera its place. None where that is not known.
        edge_length_m: Option<f64> = None;
        /// Which edge has that length: y is the upright one; x and z only before the coloured cuboid, whose colours name them.
        known_edge: KnownEdge = KnownEdge::Y;
        /// The sizes of the box along its edges x, y (the upright one) and z, metres, which tell one camera its place. Without colours
        /// x and z may be exchanged. None where they are not known.
        box_size_m: Option<Vector3<f64>> = None;
        /// Standard deviation of the known length, or of each size of the box, metres.
        length_sigma_m: f64 = 0.0 => NOT_NEGATIVE, "a number of metres from 0";
        /// Least probability of the best hypothesis; below it none is chosen.
        probability_min: f64 = 0.9 => 0.0..=1.0, "a probability from 0 to 1";
    }
    check priors
}

fn priors(options: &EstimatorOptions) -> Result<()> {
    let is_length = |x: f64| x > 0.0 && x.is_finite();
    for (name, value) in [("camera_height_m", options.camera_height_m), ("edge_length_m", options.edge_length_m)] {
        if let Some(length_m) = value.filter(|length_m| !is_length(*length_m)) {
            return Err(Error::option(name, length_m, "a positive number of metres"));
        }
    }
    if let Some(size_m) = options.box_size_m.filter(|size_m| !size_m.iter().all(|x| is_length(*x))) {
        return Err(Error::option("box_size_m", size_m.to_value(), "three positive numbers of metres"));
    }
    let scales = options.scales();
    if let [first, second, ..] = scales.as_slice() {
        return Err(Error::argument("scale", format!("{first} and {second}"), "one of them, or none"));
    }
    match options.down.map(|down| down.norm()) {
        Some(length) if (length - 1.0).abs() >= 1e-6 || length.is_nan() => {
            Err(Error::argument("down", format!("a vector of length {length}"), "a unit vector"))
        }
        _ => Ok(()),
    }
}

impl EstimatorOptions {
    /// The options given that tell one camera its place, by name.
    pub(super) fn scales(&self) -> Vec<&'static str> {
        let given = [
            ("camera_height_m", self.camera_height_m.is_some()),
            ("edge_length_m", self.edge_length_m.is_some()),
            ("box_size_m", self.box_size_m.is_some()),
        ];
        given.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect()
    }
}
