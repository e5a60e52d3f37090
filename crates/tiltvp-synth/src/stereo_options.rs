//! How a pair of cameras moves and what they are like, and which of that is possible.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tiltvp_core::{Error, Result};

use crate::tone::{Exposure, RenderOptions};

/// How a pair moves and what its cameras are like: equal options give equal sequences.
#[derive(Debug, Clone, PartialEq)]
pub struct StereoOptions {
    /// How many frames, within `[1, 100000]`; 1000 by default.
    pub frames: usize,
    /// Frames per second, within `[1, 1000]`; 30 by default.
    pub frame_rate_hz: f64,
    /// Seed of motion and noise; 0 by default.
    pub seed: u64,
    /// Which of the world's corners is looked at; by default a laboratory's cuboid, or one that can be approached.
    pub corner: Option<usize>,
    /// Least and greatest distance from the corner, metres, within `[0.3, 20]`; 1 and 3 by default. In a room it stays nearer
    /// where there is no space.
    pub distance_m: [f64; 2],
    /// Greatest roll, radians within `[0, 1.5]`; 0.2 by default.
    pub roll_max_rad: f64,
    /// Period of the slowest sway, seconds within `[1, 1000]`; 15 by default.
    pub period_s: f64,
    /// The right camera's pose in the left one's frame; by default 0.12 m to the right, and turned by less than half a degree,
    /// as a pair is before rectification.
    pub left_from_right: Isometry3<f64>,
    /// Rays per pixel side where surfaces meet, within `[1, 8]`; elsewhere one ray per pixel will do; 3 by default.
    pub samples: usize,
    /// Standard deviation of Gaussian noise, grey levels of 255; 2 by default.
    pub noise_sigma: f64,
    /// Standard deviation of a Gaussian blur, pixels, for what lens and sensor do to a point; 0.6 by default.
    pub blur_sigma_px: f64,
    /// How long the shutter is open, seconds within `[0, 0.1]`; 0 by default, for no motion blur.
    pub exposure_s: f64,
    /// Factor from the room's light to display white, the same for all frames, within `[0.05, 20]`; 0.8 by default.
    pub gain: f64,
}

impl Default for StereoOptions {
    fn default() -> Self {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.003, -0.005, 0.004));
        Self {
            frames: 1000,
            frame_rate_hz: 30.0,
            seed: 0,
            corner: None,
            distance_m: [1.0, 3.0],
            roll_max_rad: 0.2,
            period_s: 15.0,
            left_from_right: Isometry3::from_parts(Translation3::new(0.12, 0.0, 0.0), turn),
            samples: 3,
            noise_sigma: 2.0,
            blur_sigma_px: 0.6,
            exposure_s: 0.0,
            gain: 0.8,
        }
    }
}

impl StereoOptions {
    /// Checks every field's domain.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for the first field outside its domain.
    pub fn validate(&self) -> Result<()> {
        if !(1..=100_000).contains(&self.frames) {
            return Err(Error::option("stereo.frames", self.frames, "a number in [1, 100000]"));
        }
        let [near, far] = self.distance_m;
        let ranges = [
            ("stereo.frame_rate_hz", self.frame_rate_hz, 1.0, 1000.0, "hertz in [1, 1000]"),
            ("stereo.distance_m", near, 0.3, far, "least and greatest metres, ascending, in [0.3, 20]"),
            ("stereo.distance_m", far, near, 20.0, "least and greatest metres, ascending, in [0.3, 20]"),
            ("stereo.roll_max_rad", self.roll_max_rad, 0.0, 1.5, "radians in [0, 1.5]"),
            ("stereo.period_s", self.period_s, 1.0, 1000.0, "seconds in [1, 1000]"),
            ("stereo.exposure_s", self.exposure_s, 0.0, 0.1, "seconds in [0, 0.1]"),
            ("stereo.gain", self.gain, 0.05, 20.0, "a factor in [0.05, 20]"),
            (
                "stereo.left_from_right",
                self.left_from_right.translation.vector.norm(),
                0.0,
                2.0,
                "a baseline of at most 2 metres",
            ),
        ];
        for (name, value, low, high, expected) in ranges {
            if !(low..=high).contains(&value) {
                return Err(Error::option(name, value, expected));
            }
        }
        self.developed(0, 0).validate()
    }

    pub(crate) fn developed(&self, frame: usize, eye: u64) -> RenderOptions {
        RenderOptions {
            samples: self.samples,
            blur_sigma_px: self.blur_sigma_px,
            noise_sigma: self.noise_sigma,
            exposure: Exposure::Fixed { gain: self.gain },
            seed: self.seed ^ (2 * frame as u64 + 1 + eye).rotate_left(40),
            ..RenderOptions::default()
        }
    }
}
