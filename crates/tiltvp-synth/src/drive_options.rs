//! How a drive goes and what its camera is like, and which of that is possible.

use nalgebra::Matrix3;
use tiltvp_core::options::{Field, Kind, OptionValue, Options, Value, assign};
use tiltvp_core::{Error, Result, options};

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

/// As (x_m, y_m, yaw_rad, height_m).
impl OptionValue for Mount {
    const KIND: Kind = Kind::Array(&[4]);

    fn to_value(&self) -> Value {
        [self.x_m, self.y_m, self.yaw_rad, self.height_m].to_value()
    }

    fn from_value(value: &Value) -> Option<Self> {
        let [x_m, y_m, yaw_rad, height_m] = OptionValue::from_value(value)?;
        Some(Self { x_m, y_m, yaw_rad, height_m })
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

/// Either `frames` or `legs`: the one that is set last.
impl Options for Way {
    fn fields(&self) -> Vec<Field> {
        let (name, doc, kind, value) = match self {
            Self::Wander { frames } => {
                let doc = "How many frames the robot wanders, from one far place to another.";
                ("frames", doc, Kind::Int(u64::MAX), frames.to_value())
            }
            Self::Legs(legs) => {
                let doc = "Arcs along which the robot goes, one after the other: distance in metres and turn in radians of each.";
                let rows = legs.iter().flat_map(|(distance, turn)| [*distance, *turn]).collect();
                ("legs", doc, Kind::Array(&[0, 2]), Value::Array(vec![legs.len(), 2], rows))
            }
        };
        vec![Field { name: name.into(), doc: doc.into(), kind, value, expected: kind.to_string().into() }]
    }

    fn try_set(&mut self, name: &str, value: &Value) -> Result<bool> {
        match (name, value) {
            ("frames", _) => {
                let mut frames = 0;
                assign(&mut frames, "frames", value)?;
                *self = Self::Wander { frames };
            }
            ("legs", Value::Array(shape, values)) if shape.last() == Some(&2) && shape.len() <= 2 => {
                *self = Self::Legs(values.as_chunks::<2>().0.iter().map(|leg| (*leg).into()).collect());
            }
            ("legs", Value::Array(_, values)) if values.is_empty() => *self = Self::Legs(Vec::new()),
            ("legs", _) => return Err(Error::option("legs", value, "an array (N, 2) of distances and turns")),
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn validate(&self) -> Result<()> {
        match self {
            Self::Wander { frames } if !(1..=100_000).contains(frames) => {
                Err(Error::option("frames", frames, "a number in [1, 100000]"))
            }
            Self::Legs(legs) => {
                let known = |(distance, turn): &(f64, f64)| (-100.0..=100.0).contains(distance) && turn.abs() <= 100.0;
                let moves = legs.iter().any(|(distance, turn)| *distance != 0.0 || *turn != 0.0);
                match legs.iter().find(|leg| !known(leg)) {
                    Some(leg) => Err(Error::option("legs", format!("{leg:?}"), "numbers in [-100, 100]")),
                    None if !moves => Err(Error::option("legs", format!("{legs:?}"), "a leg that moves the robot")),
                    None => Ok(()),
                }
            }
            Self::Wander { .. } => Ok(()),
        }
    }
}

options! {
    /// How a drive goes and what its camera is like: equal options give equal drives.
    pub struct DriveOptions {
        /// Where the robot goes.
        [flat] way: Way = Way::Wander { frames: 1500 };
        /// Seed of way, encoders, bumps, light and noise.
        seed: u64 = 0;
        /// Greatest way from frame to frame, metres.
        step_m: f64 = 0.05 => 1e-4..=0.2, "metres in [1e-4, 0.2]";
        /// Greatest turn from frame to frame, radians.
        turn_max_rad: f64 = 0.08 => 1e-3..=0.5, "radians in [1e-3, 0.5]";
        /// Where the camera is on the robot: x_m, y_m, yaw_rad and height_m.
        mount: Mount = Mount::default();
        /// How the camera sits in its mounting, which the mount's yaw turns; identity for a camera that looks up.
        robot_from_camera: Matrix3<f64> = Matrix3::identity();
        /// Half angle of the cone around the camera's `z` axis in which it sees only itself, as under a mirror: black, radians.
        blind_rad: f64 = 0.0 => 0.0..=1.5, "radians in [0, 1.5]";
        /// Wheels and encoders.
        [flat] wheels: Wheels = Wheels::default();
        /// Greatest lean from bumps, radians; the robot leans about the camera's centre.
        bumps_max_rad: f64 = 0.0 => 0.0..=0.5, "radians in [0, 0.5]";
        /// How much lamps, daylight, their colours and the exposure change along the way.
        lighting: f64 = 0.5 => 0.0..=1.0, "a number in [0, 1]";
        /// Rays per pixel side where surfaces meet; elsewhere one ray per pixel will do.
        samples: usize = 3 => 1.0..=8.0, "rays per pixel side in [1, 8]";
        /// Standard deviation of Gaussian noise, grey levels.
        noise_sigma: f64 = 2.0 => 0.0..=255.0, "grey levels in [0, 255]";
        /// Standard deviation of a Gaussian blur, pixels, 0 for none.
        blur_sigma_px: f64 = 0.0 => 0.0..=50.0, "pixels in [0, 50]";
    }
    check mount_is_possible
}

fn mount_is_possible(options: &DriveOptions) -> Result<()> {
    let Mount { x_m, y_m, yaw_rad, height_m } = options.mount;
    for (name, value, low, high, expected) in [
        ("x_m", x_m, -1.0, 1.0, "metres in [-1, 1]"),
        ("y_m", y_m, -1.0, 1.0, "metres in [-1, 1]"),
        ("yaw_rad", yaw_rad, -7.0, 7.0, "radians in [-7, 7]"),
        ("height_m", height_m, 0.05, 2.2, "metres in [0.05, 2.2]"),
    ] {
        if !(low..=high).contains(&value) {
            return Err(Error::option("mount", value, format!("a {name} of {expected}")));
        }
    }
    let rotation = &options.robot_from_camera;
    let off = (rotation * rotation.transpose() - Matrix3::identity()).norm();
    if !(off < 1e-6 && rotation.determinant() > 0.0) {
        return Err(Error::argument("robot_from_camera", rotation, "a rotation matrix"));
    }
    Ok(())
}

impl DriveOptions {
    /// Rotation from camera to robot coordinates, with the mount's yaw.
    pub fn robot_from_mounted_camera(&self) -> Matrix3<f64> {
        about_z(self.mount.yaw_rad) * self.robot_from_camera
    }

    pub(crate) fn exposed(&self, mean_level: f64, frame: usize) -> RenderOptions {
        RenderOptions {
            samples: self.samples,
            blur_sigma_px: self.blur_sigma_px,
            noise_sigma: self.noise_sigma,
            exposure: Exposure::auto(mean_level),
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
