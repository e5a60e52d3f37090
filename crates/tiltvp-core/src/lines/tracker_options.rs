//! The options of the tracker of lines.

use super::matcher::MatchOptions;
use crate::error::{Error, Result};

/// Options of the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerOptions {
    /// How many frames back a line is looked for before it is taken for a new one. Default 20.
    pub look_back: usize,
    /// How lines of two frames are matched where the motion is unknown.
    pub matching: MatchOptions,
    /// The least distance of an edge from the camera, metres: how far bearings may change while nothing else is known. Default
    /// 0.3.
    pub nearest_m: f64,
    /// Where the camera's centre is on the robot, x and y from the middle between the wheels, metres. Default (0, 0).
    pub camera_m: [f64; 2],
    /// Standard deviation of a turn that is given, radians. Default 0.005.
    pub turn_sigma_rad: f64,
    /// Standard deviation of a distance driven that is given, as a share of it. Default 0.03.
    pub distance_sigma: f64,
    /// Standard deviation of the change of a bearing per frame beside the turn, where no distance is given, radians. Default
    /// 0.05.
    pub rate_sigma_rad: f64,
    /// Standard deviation of a bearing beside the line's own, from neighbouring edges that blend, radians. Default 0.1 degrees.
    pub bearing_sigma_rad: f64,
    /// The greatest difference from a predicted bearing, in standard deviations. Default 3.
    pub gate_sigmas: f64,
    /// Standard deviation of the distance between descriptors of one line. Default 0.35.
    pub descriptor_sigma: f64,
    /// The greatest distance between descriptors of one line at its predicted bearing. Default 1.25.
    pub descriptor_max: f64,
    /// What a new track costs, to be held against the squared deviations of a line that goes on. Default 18.
    pub new_cost: f64,
}

impl Default for TrackerOptions {
    fn default() -> Self {
        Self {
            look_back: 20,
            matching: MatchOptions::default(),
            nearest_m: 0.3,
            camera_m: [0.0; 2],
            turn_sigma_rad: 0.005,
            distance_sigma: 0.03,
            rate_sigma_rad: 0.05,
            bearing_sigma_rad: 0.1f64.to_radians(),
            gate_sigmas: 3.0,
            descriptor_sigma: 0.35,
            descriptor_max: 1.25,
            new_cost: 18.0,
        }
    }
}

impl TrackerOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        self.matching.validate()?;
        if !(1..=100_000).contains(&self.look_back) {
            return Err(Error::option("look_back", self.look_back, "a whole number of frames from 1 to 100000"));
        }
        for (name, value, expected) in [
            ("nearest_m", self.nearest_m, "a positive distance"),
            ("turn_sigma_rad", self.turn_sigma_rad, "a positive angle"),
            ("rate_sigma_rad", self.rate_sigma_rad, "a positive angle"),
            ("bearing_sigma_rad", self.bearing_sigma_rad, "a positive angle"),
            ("gate_sigmas", self.gate_sigmas, "a positive number"),
            ("descriptor_sigma", self.descriptor_sigma, "a positive distance"),
            ("descriptor_max", self.descriptor_max, "a positive distance"),
            ("new_cost", self.new_cost, "a positive number"),
        ] {
            if !(value > 0.0 && value <= 1e6) {
                return Err(Error::option(name, value, expected));
            }
        }
        if !(self.distance_sigma >= 0.0 && self.distance_sigma <= 10.0) {
            return Err(Error::option("distance_sigma", self.distance_sigma, "a share from 0 to 10"));
        }
        for value in self.camera_m {
            if !(-10.0..=10.0).contains(&value) {
                return Err(Error::option("camera_m", value, "metres from -10 to 10"));
            }
        }
        Ok(())
    }
}
