//! Where a drive leads: poses of a robot that wanders through a room, what its encoders say, and how bumps tilt it.

use nalgebra::Vector2;
use tiltvp_core::geometry::Tilt;
use tiltvp_core::{Error, Result};

use crate::dice::Dice;
use crate::drive::DriveOptions;
use crate::noise::fractal_noise;
use crate::route::{Follower, Grid};
use crate::view::RobotPose;
use crate::world::World;

/// Streams of the drive's seed.
const WAY: u64 = 0x0D01;
const ENCODERS: u64 = 0x0D02;

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
    /// Wanders through a room from one far place to another. No pose is nearer than 0.22 m to anything that a low robot
    /// cannot drive over.
    ///
    /// # Errors
    /// If there is no place for a robot in the room.
    pub(crate) fn draw(world: &World, options: &DriveOptions) -> Result<Self> {
        let wheels = options.wheels;
        let grid = Grid::new(world, options.mount.x_m.hypot(options.mount.y_m), options.mount.height_m);
        let cells = grid.open_cells();
        if cells.len() < 12 {
            return Err(Error::argument("room", world.kind().name(), "a room with space for a robot to drive in"));
        }
        let mut dice = Dice::new(options.seed, WAY);
        let start = grid.center(cells[dice.below(cells.len())]);
        let mut follower = Follower::new(grid.way_from(&start, &cells, true, &mut dice));
        let yaw_rad = dice.within(-std::f64::consts::PI, std::f64::consts::PI);
        let mut poses = vec![RobotPose { x_m: start.x, y_m: start.y, yaw_rad }];
        let mut displacements_m = vec![[0.0; 2]];
        let mut pose = poses[0];
        while poses.len() < options.frames {
            let at = Vector2::new(pose.x_m, pose.y_m);
            if follower.is_done() || follower.is_stuck() {
                follower.follow(grid.way_from(&at, &cells, !follower.is_stuck(), &mut dice));
            }
            let is_open = |distance: f64, turn: f64| {
                [0.5, 1.0].iter().all(|part| {
                    let there = wheels.moved(pose, wheels.displacements(part * distance, part * turn));
                    grid.has_room(&Vector2::new(there.x_m, there.y_m))
                })
            };
            let (distance, turn) =
                follower.next(&grid, &at, pose.yaw_rad, (options.step_m, options.turn_max_rad), is_open);
            let rolled = wheels.displacements(distance, turn);
            pose = wheels.moved(pose, rolled);
            poses.push(pose);
            displacements_m.push(rolled);
        }
        let mut dice = Dice::new(options.seed, ENCODERS);
        let odometry_m = displacements_m.iter().map(|rolled| wheels.read(*rolled, &mut dice)).collect();
        let tilts = (0..options.frames).map(|frame| bump(frame, options)).collect();
        Ok(Self { poses, tilts, displacements_m, odometry_m })
    }
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
