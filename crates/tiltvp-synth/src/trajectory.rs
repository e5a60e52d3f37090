//! Where a drive leads: poses of a robot that wanders through a room, what its encoders say, and how bumps tilt it.

use std::f64::consts::PI;

use nalgebra::Vector2;
use tiltvp_core::geometry::Tilt;
use tiltvp_core::{Error, Result};

use crate::drive_options::{DriveOptions, Way};
use crate::noise::fractal_noise;
use crate::rng::Rng;
use crate::route::{Follower, Grid};
use crate::view::RobotPose;
use crate::world::World;

/// Streams of the drive's seed, told apart from each other and from those of the frames.
const WAY: u64 = 0x0D01;
const ENCODERS: u64 = 0x0D02;

/// Places and headings that are tried for a way that is prescribed: enough that a free one is found in a narrow room
/// (`legs_are_driven_where_there_is_room`).
const START_TRIALS: usize = 20_000;

/// What a drive went through, one entry per frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Where the robot was.
    pub poses: Vec<RobotPose>,
    /// How it leaned.
    pub tilts: Vec<Tilt>,
    /// How far the left and the right wheel rolled since the frame before, metres; 0 for the first frame. The poses are exactly
    /// what [`Wheels::moved`](crate::Wheels::moved) makes of them.
    pub displacements_m: Vec<[f64; 2]>,
    /// What the encoders said of it.
    pub odometry_m: Vec<[f64; 2]>,
}

impl Trajectory {
    /// The way that was asked for. No pose is nearer than 0.22 m to anything that a low robot cannot drive over.
    ///
    /// # Errors
    /// If there is no place for a robot in the room, or none from which the legs can be driven.
    pub(crate) fn draw(world: &World, options: &DriveOptions) -> Result<Self> {
        let grid = Grid::new(world, options.mount.x_m.hypot(options.mount.y_m), options.mount.height_m);
        let cells = grid.open_cells();
        if cells.len() < 12 {
            return Err(Error::argument("room", world.kind().name(), "a room with space for a robot to drive in"));
        }
        let mut rng = Rng::new(options.seed, WAY);
        let (start, displacements_m) = match &options.way {
            Way::Wander { frames } => wander(&grid, &cells, *frames, options, &mut rng),
            Way::Legs(legs) => along(&grid, &cells, legs, options, &mut rng).ok_or_else(|| {
                Error::argument("legs", format!("{legs:?}"), "legs that a robot has room for in this room")
            })?,
        };
        let mut pose = start;
        let poses: Vec<RobotPose> = displacements_m
            .iter()
            .map(|rolled| {
                pose = options.wheels.moved(pose, *rolled);
                pose
            })
            .collect();
        let mut rng = Rng::new(options.seed, ENCODERS);
        let odometry_m = displacements_m.iter().map(|rolled| options.wheels.read(*rolled, &mut rng)).collect();
        let tilts = (0..poses.len()).map(|frame| bump(frame, options)).collect();
        Ok(Self { poses, tilts, displacements_m, odometry_m })
    }
}

/// A place and a heading drawn at random, and how far the wheels roll up to each frame; nothing up to the first.
type Plan = (RobotPose, Vec<[f64; 2]>);

/// Wanders through a room from one far place to another.
fn wander(grid: &Grid, cells: &[usize], frames: usize, options: &DriveOptions, rng: &mut Rng) -> Plan {
    let wheels = options.wheels;
    let start = grid.center(cells[rng.below(cells.len())]);
    let mut follower = Follower::new(grid.way_from(&start, cells, true, rng));
    let start = RobotPose { x_m: start.x, y_m: start.y, yaw_rad: rng.within(-PI, PI) };
    let mut displacements_m = vec![[0.0; 2]];
    let mut pose = start;
    while displacements_m.len() < frames {
        let at = Vector2::new(pose.x_m, pose.y_m);
        if follower.is_done() || follower.is_stuck() {
            follower.follow(grid.way_from(&at, cells, !follower.is_stuck(), rng));
        }
        let is_open = |distance: f64, turn: f64| {
            [0.5, 1.0].iter().all(|part| {
                let there = wheels.moved(pose, wheels.displacements(part * distance, part * turn));
                grid.has_room(&Vector2::new(there.x_m, there.y_m))
            })
        };
        let (distance, turn) = follower.next(grid, &at, pose.yaw_rad, (options.step_m, options.turn_max_rad), is_open);
        let rolled = wheels.displacements(distance, turn);
        pose = wheels.moved(pose, rolled);
        displacements_m.push(rolled);
    }
    (start, displacements_m)
}

/// Drives legs in equal steps; none if no place was found from which there is room for all.
fn along(grid: &Grid, cells: &[usize], legs: &[(f64, f64)], options: &DriveOptions, rng: &mut Rng) -> Option<Plan> {
    let steps = |(distance, turn): &(f64, f64)| {
        let count = (distance.abs() / options.step_m).max(turn.abs() / options.turn_max_rad).ceil();
        vec![options.wheels.displacements(distance / count, turn / count); count as usize]
    };
    let displacements_m: Vec<[f64; 2]> = [[0.0; 2]].into_iter().chain(legs.iter().flat_map(steps)).collect();
    let has_room = |start: RobotPose| {
        let mut pose = start;
        displacements_m.iter().all(|rolled| {
            pose = options.wheels.moved(pose, *rolled);
            grid.has_room(&Vector2::new(pose.x_m, pose.y_m))
        })
    };
    (0..START_TRIALS).find_map(|_| {
        let at = grid.center(cells[rng.below(cells.len())]);
        let start = RobotPose { x_m: at.x, y_m: at.y, yaw_rad: rng.within(-PI, PI) };
        has_room(start).then(|| (start, displacements_m.clone()))
    })
}

/// The lean of one frame: smooth in time, in any direction, up to the greatest that was asked for.
fn bump(frame: usize, options: &DriveOptions) -> Tilt {
    if options.bumps_max_rad <= 0.0 {
        return Tilt::UPRIGHT;
    }
    let seed = (options.seed ^ (options.seed >> 32)) as u32;
    let wave = |stream: u32| 1.6 * fractal_noise(frame as f64 + 0.5, 0.5, 12.0, 3, 0.0, seed ^ (stream << 20));
    let lean = Vector2::new(wave(1), wave(2));
    let share = lean.norm().min(1.0);
    Tilt::from_alpha_beta(options.bumps_max_rad * share, lean.y.atan2(lean.x))
}
