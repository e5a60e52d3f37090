//! A pair of cameras, held by hand, that looks at a corner of a world: every frame can be rendered, and its truth is known.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use tiltvp_core::camera::Camera;
use tiltvp_core::{Error, Result};

use crate::corner::Corner;
use crate::handheld::Handheld;
use crate::lights::Lights;
use crate::rng::Rng;
use crate::stereo_options::StereoOptions;
use crate::sweep::{Rays, Sweep};
use crate::tone::{ColorImage, Film};
use crate::world::World;

/// How many motions are tried, per corner: the second half of them nearer to it, before the next corner has its turn.
const TRIALS: usize = 30;
/// How far from walls and furniture the cameras stay, metres: half of a pair of cameras with its hands.
const CLEAR_M: f64 = 0.12;
/// Most sharp pictures that a blurred one is averaged from: an eighth of the time of exposure each.
const SHARPS: usize = 8;
/// Edges of corners that are looked at first, metres: those of furniture, before boxes and books.
const LARGE_M: f64 = 0.35;
/// Least length of its edges in the images, all along, of a corner that is looked at, in widths of an image:
/// 8 pixels of 640, the least that a detector of edges can place.
const LEAST_EDGE_WIDTHS: f64 = 0.012;
/// Points at which an edge is looked for: the length in sight is told to a 64th.
const EDGE_POINTS: usize = 64;

/// A corner in sight at one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerSighting {
    /// Number of the corner.
    pub corner: usize,
    /// Where its vertex is in the left and in the right image, pixels.
    pub vertex_px: [Vector2<f64>; 2],
    /// In either image, how long the edges `x`, `y`, `z` are, from the vertex on to where they are hidden or end, pixels.
    pub edges_px: [[f64; 3]; 2],
}

/// A moving pair in a world.
pub struct StereoSequence {
    world: Arc<World>,
    cameras: [Camera; 2],
    options: StereoOptions,
    corner: usize,
    motion: Handheld,
    rays: [Rays; 2],
}

impl StereoSequence {
    /// Finds a motion for a pair in a world, and makes its rays in parallel on the current rayon pool; neither depends on it.
    ///
    /// # Errors
    /// If the options are outside their domains, or there is no space to move in.
    pub fn new(world: Arc<World>, cameras: [Camera; 2], options: StereoOptions) -> Result<Self> {
        options.validate()?;
        let corners = world.corners();
        if let Some(corner) = options.corner.filter(|&corner| corner >= corners.len()) {
            return Err(Error::option("corner", corner, format!("the number of one of {} corners", corners.len())));
        }
        let mut rng = Rng::new(options.seed, 1 << 34);
        let is_large = |k: &usize| corners[*k].lengths_m.iter().all(|length| *length >= LARGE_M);
        let (mut order, mut small): (Vec<usize>, Vec<usize>) = match options.corner {
            Some(corner) => (vec![corner], Vec::new()),
            None if world.has_cuboid() => (vec![0], Vec::new()),
            None => (0..corners.len()).filter(|&k| Handheld::suits(&corners[k])).partition(is_large),
        };
        for order in [&mut order, &mut small] {
            for k in (1..order.len()).rev() {
                order.swap(k, rng.below(k + 1));
            }
        }
        order.append(&mut small);
        for &corner in &order {
            for trial in 0..TRIALS {
                let reach = if 2 * trial < TRIALS { 1.0 } else { 0.4 };
                let motion = Handheld::draw(&corners[corner], &options, reach, &mut rng);
                if is_good(&world, &cameras, &options, &motion, &corners[corner]) {
                    let rays = cameras.each_ref().map(|camera| Rays::new(camera, 0.0));
                    return Ok(Self { world, cameras, options, corner, motion, rays });
                }
            }
        }
        let got = options.corner.map_or_else(|| format!("none of {}", order.len()), |corner| corner.to_string());
        Err(Error::argument("corner", got, "one with space to look at it"))
    }

    /// How the pair moves.
    pub fn options(&self) -> &StereoOptions {
        &self.options
    }

    /// The left and the right camera.
    pub fn cameras(&self) -> &[Camera; 2] {
        &self.cameras
    }

    /// Number of the corner that is looked at.
    pub fn corner(&self) -> usize {
        self.corner
    }

    /// The motion of the left camera, at any time.
    pub fn motion(&self) -> &Handheld {
        &self.motion
    }

    /// When a frame is taken, seconds.
    pub fn time_s(&self, frame: usize) -> f64 {
        frame as f64 / self.options.frame_rate_hz
    }

    /// The pose of the left camera in the world at a frame (`world_from_left`).
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if there is no such frame.
    pub fn pose(&self, frame: usize) -> Result<Isometry3<f64>> {
        if frame >= self.options.frames {
            return Err(Error::argument("frame", frame, format!("a frame below {}", self.options.frames)));
        }
        Ok(self.motion.pose(self.time_s(frame)))
    }

    /// The left and the right image of a frame, rendered in parallel on the current rayon pool; their bytes depend on world,
    /// cameras, options and frame alone.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if there is no such frame.
    pub fn render(&self, frame: usize) -> Result<[ColorImage; 2]> {
        self.pose(frame)?;
        Ok([0, 1].map(|eye| self.eye(frame, eye)))
    }

    fn eye(&self, frame: usize, eye: usize) -> ColorImage {
        let options = self.options.developed(frame, eye as u64);
        let (middle_s, open_s) = (self.time_s(frame), self.options.exposure_s);
        let count = self.sharps(middle_s, eye);
        let film = |k: usize| {
            let time_s = middle_s + open_s * ((k as f64 + 0.5) / count as f64 - 0.5);
            let pose = self.eye_pose(time_s, eye);
            let turn: Matrix3<f64> = pose.rotation.to_rotation_matrix().into_inner();
            Sweep::new(&self.world, &self.rays[eye], pose.translation.vector, turn).film(&Lights::STEADY, &options)
        };
        let first = film(0);
        let sum = (1..count).fold(first, |sum, k| sum.plus(&film(k)));
        Film::scaled(sum, 1.0 / count as f32).develop_color(&options)
    }

    /// How many sharp pictures a frame is averaged from: as many as pixels that the vertex, or the end of one of its edges,
    /// moves while the shutter is open.
    fn sharps(&self, time_s: f64, eye: usize) -> usize {
        let corner = &self.world.corners()[self.corner];
        let ends = corner.edges.iter().zip(corner.lengths_m).map(|(edge, length)| corner.position + edge * length);
        let [start, end] = [-0.5, 0.5].map(|side| self.eye_pose(time_s + side * self.options.exposure_s, eye));
        let place = |pose: &Isometry3<f64>, point: &Vector3<f64>| {
            self.cameras[eye].project(&pose.inverse_transform_point(&(*point).into()).coords)
        };
        let moved = ends
            .chain([corner.position])
            .filter_map(|point| Some((place(&end, &point)? - place(&start, &point)?).norm()))
            .fold(0.0, f64::max);
        (moved.ceil() as usize).clamp(1, SHARPS)
    }

    fn eye_pose(&self, time_s: f64, eye: usize) -> Isometry3<f64> {
        let left = self.motion.pose(time_s);
        if eye == 0 { left } else { left * self.options.left_from_right }
    }

    /// The corners whose vertex is in sight in both images of a frame, in the order of their numbers.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if there is no such frame.
    pub fn sightings(&self, frame: usize) -> Result<Vec<CornerSighting>> {
        self.pose(frame)?;
        let eyes = [0, 1].map(|eye| (self.eye_pose(self.time_s(frame), eye), &self.cameras[eye]));
        let numbered = self.world.corners().par_iter().enumerate();
        Ok(numbered.filter_map(|(number, corner)| sight(&self.world, number, corner, &eyes)).collect())
    }
}

/// What is in sight of a corner, if its vertex is for both eyes.
fn sight(
    world: &World,
    number: usize,
    corner: &Corner,
    eyes: &[(Isometry3<f64>, &Camera); 2],
) -> Option<CornerSighting> {
    let mut sighting = CornerSighting { corner: number, vertex_px: [Vector2::zeros(); 2], edges_px: [[0.0; 3]; 2] };
    for (eye, (pose, camera)) in eyes.iter().enumerate() {
        let vertex = seen(world, camera, pose, &corner.position)?;
        sighting.vertex_px[eye] = vertex;
        for (k, (edge, length)) in corner.edges.iter().zip(corner.lengths_m).enumerate() {
            let end = (1..=EDGE_POINTS)
                .map(|at| corner.position + edge * (length * at as f64 / EDGE_POINTS as f64))
                .map_while(|point| seen(world, camera, pose, &point))
                .last();
            sighting.edges_px[eye][k] = end.map_or(0.0, |end| (end - vertex).norm());
        }
    }
    Some(sighting)
}

/// The pixel at which a point of a surface is in sight.
fn seen(world: &World, camera: &Camera, pose: &Isometry3<f64>, point: &Vector3<f64>) -> Option<Vector2<f64>> {
    let pixel = camera.project(&pose.inverse_transform_point(&(*point).into()).coords)?;
    let ray = point - pose.translation.vector;
    let length = ray.norm();
    let clear = || world.scene().is_clear(&pose.translation.vector, &(ray / length), length - 2e-3 - 5e-4 * length);
    (camera.contains(&pixel) && clear()).then_some(pixel)
}

/// Whether all along a motion the cameras are free in the room, and the corner with its edges in both images.
fn is_good(world: &World, cameras: &[Camera; 2], options: &StereoOptions, motion: &Handheld, corner: &Corner) -> bool {
    // Five looks a second tell; no hand moves the cameras far in between.
    let duration = options.frames as f64 / options.frame_rate_hz;
    let looks = (5.0 * duration).ceil() as usize + 1;
    let least = cameras.each_ref().map(|camera| LEAST_EDGE_WIDTHS * f64::from(camera.width()));
    (0..looks).all(|k| {
        let left = motion.pose(k as f64 * duration / looks as f64);
        let poses = [left, left * options.left_from_right];
        let is_free = |center: &Vector3<f64>| {
            let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
            let clear = |d: Vector3<f64>| world.scene().is_clear(center, &d, CLEAR_M);
            world.contains(center) && axes.iter().all(|d| clear(*d) && clear(-d))
        };
        poses.iter().all(|pose| is_free(&pose.translation.vector))
            && sight(world, 0, corner, &[(poses[0], &cameras[0]), (poses[1], &cameras[1])]).is_some_and(|seen| {
                seen.edges_px.iter().zip(least).all(|(eye, least)| eye.iter().all(|px| *px >= least))
            })
    })
}
