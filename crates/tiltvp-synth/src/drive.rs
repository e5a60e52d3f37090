//! A drive: a robot with a camera and encoders on its way through a room, every frame of which can be looked at.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use tiltvp_core::camera::Camera;
use tiltvp_core::geometry::Tilt;
use tiltvp_core::options::OptionValue;
use tiltvp_core::{Error, Result};

use crate::drive_options::{DriveOptions, Mount, about_z};
use crate::light::LightMap;
use crate::lights::{Lights, Weather};
use crate::sighting::{EdgeSighting, Lookout, UprightEdge, upright_edges};
use crate::sweep::{Rays, Sweep};
use crate::tone::Image;
use crate::trajectory::Trajectory;
use crate::view::RobotPose;
use crate::world::World;

/// A robot's drive through a room.
pub struct Drive {
    world: Arc<World>,
    camera: Camera,
    options: DriveOptions,
    trajectory: Trajectory,
    /// The light of the windows alone, where the light changes.
    daylight: Option<LightMap>,
    rays: Rays,
    edges: Vec<UprightEdge>,
}

impl Drive {
    /// Plans a drive. Light is gathered in parallel on the current rayon pool; the drive does not depend on it.
    ///
    /// # Errors
    /// If the options are outside their domains, or the robot finds no space to drive in.
    pub fn new(world: Arc<World>, camera: Camera, options: DriveOptions) -> Result<Self> {
        options.validate()?;
        if options.mount.height_m >= world.height_m() {
            return Err(Error::option("mount", options.mount.to_value(), "a height_m below the ceiling"));
        }
        let trajectory = Trajectory::draw(&world, &options)?;
        let daylight = (options.lighting > 0.0).then(|| world.daylight());
        let (rays, edges) = (Rays::new(&camera, options.blind_rad), upright_edges(&world));
        Ok(Self { world, camera, options, trajectory, daylight, rays, edges })
    }

    /// How the drive goes.
    pub fn options(&self) -> &DriveOptions {
        &self.options
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Poses, leans and wheels.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// The upright edges of the room, visible or not; an edge's place here is its number.
    pub fn edges(&self) -> &[UprightEdge] {
        &self.edges
    }

    /// The camera's centre in the world at a frame, metres.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if there is no such frame.
    pub fn center(&self, frame: usize) -> Result<Vector3<f64>> {
        Ok(self.center_at(self.state(frame)?.0))
    }

    /// The image of a frame, rendered in parallel on the current rayon pool; its bytes depend on room, camera, options and
    /// frame alone.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if there is no such frame.
    pub fn render(&self, frame: usize) -> Result<Image> {
        let (pose, tilt) = self.state(frame)?;
        self.render_at(frame, pose, tilt)
    }

    /// What the camera sees in a frame's light, and with its noise, where the robot is elsewhere or leans otherwise than on
    /// this drive; any frame's number will do.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the camera is outside the room there.
    pub fn render_at(&self, frame: usize, pose: RobotPose, tilt: Tilt) -> Result<Image> {
        let center = self.center_at(pose);
        if !(self.world.contains(&center) && pose.yaw_rad.is_finite()) {
            return Err(Error::argument("pose", format!("{pose:?}"), "a place in the room, and a finite heading"));
        }
        let (lights, level) = self.lights(frame);
        let sweep = Sweep::new(&self.world, &self.rays, center, self.world_from_camera(pose, tilt));
        let options = self.options.exposed((0.45 * level).clamp(0.1, 0.8), frame);
        Ok(sweep.film(&lights, &options).develop(&options))
    }

    /// The upright edges in sight at a frame, in the order of their numbers.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if there is no such frame.
    pub fn sightings(&self, frame: usize) -> Result<Vec<EdgeSighting>> {
        let (pose, tilt) = self.state(frame)?;
        let (lights, _) = self.lights(frame);
        let lookout = Lookout {
            world: &self.world,
            camera: &self.camera,
            blind_rad: self.options.blind_rad,
            pose,
            center: self.center(frame)?,
            camera_from_world: self.world_from_camera(pose, tilt).transpose(),
            lights: &lights,
        };
        let numbered = self.edges.par_iter().enumerate();
        Ok(numbered.filter_map(|(number, edge)| lookout.sight(number, edge)).collect())
    }

    fn state(&self, frame: usize) -> Result<(RobotPose, Tilt)> {
        match (self.trajectory.poses.get(frame), self.trajectory.tilts.get(frame)) {
            (Some(pose), Some(tilt)) => Ok((*pose, *tilt)),
            _ => Err(Error::argument("frame", frame, format!("a frame below {}", self.trajectory.poses.len()))),
        }
    }

    fn center_at(&self, pose: RobotPose) -> Vector3<f64> {
        let Mount { x_m, y_m, height_m, .. } = self.options.mount;
        let (s, c) = pose.yaw_rad.sin_cos();
        Vector3::new(pose.x_m + c * x_m - s * y_m, pose.y_m + s * x_m + c * y_m, height_m)
    }

    fn world_from_camera(&self, pose: RobotPose, tilt: Tilt) -> Matrix3<f64> {
        let upright_from_leaning = tilt.leaning_from_upright().transpose();
        about_z(pose.yaw_rad) * upright_from_leaning * self.options.robot_from_mounted_camera()
    }

    fn lights(&self, frame: usize) -> (Lights<'_>, f64) {
        let Some(daylight) = &self.daylight else { return (Lights::STEADY, 1.0) };
        let seed = (self.options.seed ^ (self.options.seed >> 32)) as u32;
        let (lamps, day, level) = Weather { strength: self.options.lighting, seed }.at(frame);
        (Lights { lamps, day, daylight: Some(daylight) }, level)
    }
}
