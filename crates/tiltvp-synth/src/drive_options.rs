//! How a drive goes and what its camera is like, and which of that is possible.

use nalgebra::Matrix3;
use tiltvp_core::{Error, Result};

use crate::encoders::Wheels;
use crate::tone::{Exposure, RenderOptions};

/// Where the camera's centre is on the robot, and how it is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// In front of the middle between the wheels, metres; 0 by default.
    pub x_m: f64,
    /// To the left of it, metres; 0 by default.
    pub y_m: f64,
    /// Turn of camera and mounting about the robot's `z`, counter-clockwise, radians; 0 by default.
    pub yaw_rad: f64,
    /// Above the floor, metres; 0.4 by default.
    pub height_m: f64,
}

impl Default for Mount {
    fn default() -> Self {
        Self { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0, height_m: 0.4 }
    }
}

/// Where a robot goes.
#[derive(Debug, Clone, PartialEq)]
pub enum Way {
    /// From one far place to another, for so many frames within `[1, 100000]`.
    Wander {
        /// How many frames.
        frames: usize,
    },
    /// Along arcs, one after the other, from a place and in a direction in which there is room for them: distance in metres and
    /// turn in radians of each.
    Legs(Vec<(f64, f64)>),
}

/// How a drive goes and what its camera is like: equal options give equal drives.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveOptions {
    /// Where the robot goes; it wanders for 1500 frames by default.
    pub way: Way,
    /// Seed of way, encoders, bumps, light and noise; 0 by default.
    pub seed: u64,
    /// Greatest way from frame to frame, metres; 0.05 by default.
    pub step_m: f64,
    /// Greatest turn from frame to frame, radians; 0.08 by default.
    pub turn_max_rad: f64,
    /// Where the camera is.
    pub mount: Mount,
    /// How the camera sits in its mounting, which the mount's yaw turns; identity for a camera that looks up.
    pub robot_from_camera: Matrix3<f64>,
    /// Half angle of the cone around the camera's `z` axis in which it sees only itself, as under a mirror: black, radians
    /// within `[0, 1.5]`; 0 by default.
    pub blind_rad: f64,
    /// Wheels and encoders.
    pub wheels: Wheels,
    /// Greatest lean from bumps, radians within `[0, 0.5]`; the robot leans about the camera's centre; 0 by default.
    pub bumps_max_rad: f64,
    /// How much lamps, daylight, their colours and the exposure change along the way, in `[0, 1]`; 0.5 by default.
    pub lighting: f64,
    /// Rays per pixel side where surfaces meet, within `[1, 8]`; elsewhere one ray per pixel will do; 3 by default.
    pub samples: usize,
    /// Standard deviation of Gaussian noise, grey levels; 2 by default.
    pub noise_sigma: f64,
    /// Standard deviation of a Gaussian blur, pixels; 0 by default, for none.
    pub blur_sigma_px: f64,
}

impl Default for DriveOptions {
    fn default() -> Self {
        Self {
            way: Way::Wander { frames: 1500 },
            seed: 0,
            step_m: 0.05,
            turn_max_rad: 0.08,
            mount: Mount::default(),
            robot_from_camera: Matrix3::identity(),
            blind_rad: 0.0,
            wheels: Wheels::default(),
            bumps_max_rad: 0.0,
            lighting: 0.5,
            samples: 3,
            noise_sigma: 2.0,
            blur_sigma_px: 0.0,
        }
    }
}

impl DriveOptions {
    /// Checks every field's domain.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] for the first field outside its domain.
    pub fn validate(&self) -> Result<()> {
        self.validate_way()?;
        let Mount { x_m, y_m, yaw_rad, height_m } = self.mount;
        let ranges = [
            ("drive.step_m", self.step_m, 1e-4, 0.2, "metres in [1e-4, 0.2]"),
            ("drive.turn_max_rad", self.turn_max_rad, 1e-3, 0.5, "radians in [1e-3, 0.5]"),
            ("drive.mount.x_m", x_m, -1.0, 1.0, "metres in [-1, 1]"),
            ("drive.mount.y_m", y_m, -1.0, 1.0, "metres in [-1, 1]"),
            ("drive.mount.yaw_rad", yaw_rad, -7.0, 7.0, "radians in [-7, 7]"),
            ("drive.mount.height_m", height_m, 0.05, 2.2, "metres in [0.05, 2.2]"),
            ("drive.blind_rad", self.blind_rad, 0.0, 1.5, "radians in [0, 1.5]"),
            ("drive.bumps_max_rad", self.bumps_max_rad, 0.0, 0.5, "radians in [0, 0.5]"),
            ("drive.lighting", self.lighting, 0.0, 1.0, "a number in [0, 1]"),
        ];
        for (name, value, low, high, expected) in ranges {
            if !(low..=high).contains(&value) {
                return Err(Error::option(name, value, expected));
            }
        }
        let rotation = &self.robot_from_camera;
        let off = (rotation * rotation.transpose() - Matrix3::identity()).norm();
        if !(off < 1e-6 && rotation.determinant() > 0.0) {
            return Err(Error::argument("drive.robot_from_camera", rotation, "a rotation matrix"));
        }
        self.wheels.validate()?;
        self.exposed(0.45, 0).validate()
    }

    fn validate_way(&self) -> Result<()> {
        match &self.way {
            Way::Wander { frames } if !(1..=100_000).contains(frames) => {
                Err(Error::option("drive.frames", frames, "a number in [1, 100000]"))
            }
            Way::Legs(legs) => {
                let known = |(distance, turn): &(f64, f64)| (-100.0..=100.0).contains(distance) && turn.abs() <= 100.0;
                let moves = legs.iter().any(|(distance, turn)| *distance != 0.0 || *turn != 0.0);
                match legs.iter().find(|leg| !known(leg)) {
                    Some(leg) => Err(Error::option("drive.legs", format!("{leg:?}"), "numbers in [-100, 100]")),
                    None if !moves => {
                        Err(Error::option("drive.legs", format!("{legs:?}"), "a leg that moves the robot"))
                    }
                    None => Ok(()),
                }
            }
            Way::Wander { .. } => Ok(()),
        }
    }

    /// Rotation from camera to robot coordinates, with the mount's yaw.
    pub fn robot_from_mounted_camera(&self) -> Matrix3<f64> {
        about_z(self.mount.yaw_rad) * self.robot_from_camera
    }

    pub(crate) fn exposed(&self, mean_level: f64, frame: usize) -> RenderOptions {
        RenderOptions {
            samples: self.samples,
            blur_sigma_px: self.blur_sigma_px,
            noise_sigma: self.noise_sigma,
            exposure: Exposure::Auto { mean_level },
            seed: self.seed ^ (frame as u64 + 1).rotate_left(40),
            ..RenderOptions::default()
        }
    }
}

/// The rotation about `z`.
pub(crate) fn about_z(angle_rad: f64) -> Matrix3<f64> {
    let (s, c) = angle_rad.sin_cos();
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}
