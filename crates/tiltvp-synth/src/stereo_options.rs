//! How a pair of cameras moves and what they are like, and which of that is possible.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tiltvp_core::{Error, Result, options};

use crate::tone::{Exposure, RenderOptions};

options! {
    /// How a pair moves and what its cameras are like: equal options give equal sequences.
    pub struct StereoOptions {
        /// How many frames.
        frames: usize = 1000 => 1.0..=1e5, "a number in [1, 100000]";
        /// Frames per second.
        frame_rate_hz: f64 = 30.0 => 1.0..=1000.0, "hertz in [1, 1000]";
        /// Seed of motion and noise.
        seed: u64 = 0;
        /// Which of the world's corners is looked at; none for a laboratory's cuboid, or one that can be approached.
        corner: Option<usize> = None;
        /// Least and greatest distance from the corner, metres. In a room it stays nearer where there is no space.
        distance_m: [f64; 2] = [1.0, 3.0]
            => |o: &StereoOptions, x| x >= o.distance_m[0].max(0.3) && x <= o.distance_m[1].min(20.0),
            "least and greatest metres, ascending, in [0.3, 20]";
        /// Greatest roll, radians.
        roll_max_rad: f64 = 0.2 => 0.0..=1.5, "radians in [0, 1.5]";
        /// Period of the slowest sway, seconds.
        period_s: f64 = 15.0 => 1.0..=1000.0, "seconds in [1, 1000]";
        /// The right camera's pose in the left one's frame, (4, 4): 0.12 m to the right, and turned by less than half a degree, as
        /// a pair is before rectification.
        left_from_right: Isometry3<f64> = before_rectification();
        /// Rays per pixel side where surfaces meet; elsewhere one ray per pixel will do.
        samples: usize = 3 => 1.0..=8.0, "rays per pixel side in [1, 8]";
        /// Standard deviation of Gaussian noise, grey levels of 255.
        noise_sigma: f64 = 2.0 => 0.0..=255.0, "grey levels in [0, 255]";
        /// Standard deviation of a Gaussian blur, pixels, for what lens and sensor do to a point.
        blur_sigma_px: f64 = 0.6 => 0.0..=50.0, "pixels in [0, 50]";
        /// How long the shutter is open, seconds, 0 for no motion blur.
        exposure_s: f64 = 0.0 => 0.0..=0.1, "seconds in [0, 0.1]";
        /// Factor from the room's light to display white, the same for all frames.
        gain: f64 = 0.8 => 0.05..=20.0, "a factor in [0.05, 20]";
    }
    check baseline_is_possible
}

fn before_rectification() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.003, -0.005, 0.004));
    Isometry3::from_parts(Translation3::new(0.12, 0.0, 0.0), turn)
}

fn baseline_is_possible(options: &StereoOptions) -> Result<()> {
    let baseline = options.left_from_right.translation.vector.norm();
    if !(0.0..=2.0).contains(&baseline) {
        return Err(Error::option("left_from_right", baseline, "a baseline of at most 2 metres"));
    }
    Ok(())
}

impl StereoOptions {
    pub(crate) fn developed(&self, frame: usize, eye: u64) -> RenderOptions {
        RenderOptions {
            samples: self.samples,
            blur_sigma_px: self.blur_sigma_px,
            noise_sigma: self.noise_sigma,
            exposure: Exposure::fixed(self.gain),
            seed: self.seed ^ (2 * frame as u64 + 1 + eye).rotate_left(40),
            ..RenderOptions::default()
        }
    }
}
