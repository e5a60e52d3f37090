//! Seeded worlds with known truth: furnished, textured, lit rooms, ray-cast through any central camera.
//!
//! A [`World`] is drawn from [`RoomOptions`]; equal options give equal bytes, for any number of threads. [`render`] looks at
//! it through a [`View`]: a lens given as a function from pixels to bearings, mounted on a robot that stands, and leans,
//! somewhere in the room. What comes back is the image and the truth behind it.
//!
//! Lengths are metres, angles radians. The world frame has `z` up with the floor at `z = 0`; the robot frame has `x` forward,
//! `y` left, `z` up; the camera frame has `z` along the optical axis, `x` to the right (columns), `y` down (rows).

#![forbid(unsafe_code)]

mod bearing_drive;
mod builder;
mod corner;
mod drive;
mod drive_options;
mod encoders;
mod frame;
mod furniture;
mod handheld;
mod imu;
mod laboratory;
mod light;
mod lights;
mod noise;
mod openings;
mod options;
mod outdoors;
mod plan;
mod render;
mod rng;
mod route;
mod scene;
mod segment;
mod shell;
mod sighting;
mod stereo;
mod stereo_options;
mod straight;
mod sweep;
mod texture;
mod threads;
mod tiles;
mod tone;
mod trajectory;
mod view;
mod world;
mod yard;

pub use bearing_drive::{BearingDrive, BearingDriveKind, BearingDriveOptions};
pub use corner::{Corner, CornerKind};
pub use drive::Drive;
pub use drive_options::{DriveOptions, Mount, Way};
pub use encoders::Wheels;
pub use handheld::Handheld;
pub use imu::{GRAVITY_M_S2, ImuChannel, ImuOptions, ImuReading, imu_readings, readings_of};
pub use laboratory::LaboratoryOptions;
pub use options::{RoomKind, RoomOptions, WallPattern};
pub use render::{Rendering, Truth, render, render_panorama};
pub use segment::Segment;
pub use sighting::{EdgeSighting, UprightEdge};
pub use stereo::{CornerSighting, StereoSequence};
pub use stereo_options::StereoOptions;
pub use straight::StraightEdge;
pub use threads::on_threads;
pub use tone::{AutoExposure, ColorImage, Exposure, FixedExposure, Image, RenderOptions};
pub use trajectory::Trajectory;
pub use view::{Lens, RobotPose, View};
pub use world::{Hit, World};
