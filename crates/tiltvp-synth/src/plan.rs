//! The plan of a room: outline, height, walls with doors and windows, and the day outside.

use nalgebra::{Vector2, Vector3};

use crate::frame::Frame;
use crate::options::{RoomKind, RoomOptions, WallPattern};
use crate::outdoors::Outdoors;
use crate::rng::Rng;

/// Height of a yard's sky, metres: above the ridges of three storeys.
const SKY_M: f64 = 18.0;

/// What fills a hole in a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Filling {
    Door,
    Window,
}

/// A hole in a wall, in the wall's frame: `along` its `x`, and `z`, metres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Opening {
    pub(crate) filling: Filling,
    pub(crate) along: [f64; 2],
    pub(crate) z: [f64; 2],
}

/// A wall; its frame starts at one end, `x` along the wall, `y` into the room.
#[derive(Debug, Clone)]
pub(crate) struct Wall {
    pub(crate) frame: Frame,
    pub(crate) length: f64,
    pub(crate) openings: Vec<Opening>,
}

impl Wall {
    /// The walls around an outline, without openings.
    pub(crate) fn around(outline: &[Vector2<f64>]) -> Vec<Self> {
        (0..outline.len())
            .map(|k| {
                let (from, to) = (outline[k], outline[(k + 1) % outline.len()]);
                let length = (to - from).norm();
                let frame = Frame { origin: Vector3::new(from.x, from.y, 0.0), x: (to - from) / length };
                Self { frame, length, openings: Vec::new() }
            })
            .collect()
    }

    /// Whether an interval of the wall, widened by `margin`, is free of the given filling.
    pub(crate) fn is_free_of(&self, filling: Filling, from: f64, to: f64, margin: f64) -> bool {
        self.openings.iter().all(|o| o.filling != filling || to < o.along[0] - margin || from > o.along[1] + margin)
    }
}

/// The plan of a room.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    pub(crate) kind: RoomKind,
    /// Corners of the floor, counter-clockwise.
    pub(crate) outline: Vec<Vector2<f64>>,
    /// Rectangles `[x0, y0, x1, y1]` that make up the floor.
    pub(crate) floors: Vec<[f64; 4]>,
    pub(crate) height: f64,
    pub(crate) walls: Vec<Wall>,
    pub(crate) outdoors: Outdoors,
    /// Radiance of the lamps.
    pub(crate) lamps: f64,
    /// How much the floor shines, in `[0, 1]`.
    pub(crate) floor_gloss: f64,
    pub(crate) wall_pattern: WallPattern,
}

impl Plan {
    /// Draws a plan.
    pub(crate) fn draw(options: &RoomOptions, rng: &mut Rng) -> Self {
        let kind = options.kind;
        let (width, depth) = match kind {
            RoomKind::Office => (rng.within(5.0, 7.5), rng.within(4.0, 6.0)),
            RoomKind::LivingRoom => (rng.within(4.5, 6.5), rng.within(3.8, 5.2)),
            RoomKind::Corridor => (rng.within(8.0, 14.0), rng.within(1.7, 2.4)),
            RoomKind::LShaped => (rng.within(6.0, 8.0), rng.within(5.0, 6.5)),
            RoomKind::Narrow => (rng.within(3.5, 6.0), rng.within(1.9, 2.3)),
            RoomKind::UnderTable => (rng.within(4.2, 5.5), rng.within(3.7, 4.6)),
            RoomKind::Yard => (rng.within(9.0, 15.0), rng.within(8.0, 12.0)),
        };
        let (width, depth) =
            (width * options.extent, depth * if kind == RoomKind::Corridor { 1.0 } else { options.extent });
        let height = match kind {
            RoomKind::Narrow => rng.within(2.45, 2.7),
            RoomKind::Yard => SKY_M,
            _ => rng.within(2.45, 3.0),
        };
        let (outline, floors) = if kind == RoomKind::LShaped {
            let corner = Vector2::new;
            let (a, b) = (width * rng.within(0.4, 0.6), depth * rng.within(0.4, 0.55));
            (
                vec![
                    corner(0.0, 0.0),
                    corner(width, 0.0),
                    corner(width, depth - b),
                    corner(width - a, depth - b),
                    corner(width - a, depth),
                    corner(0.0, depth),
                ],
                vec![[0.0, 0.0, width, depth - b], [0.0, depth - b, width - a, depth]],
            )
        } else {
            (rectangle(width, depth), vec![[0.0, 0.0, width, depth]])
        };
        let mut walls = Wall::around(&outline);
        pierce(kind, height, &mut walls, rng);
        let outdoors = day(options, &walls, rng);
        let lamps = if options.daylight < 0.3 || rng.chance(0.6) { rng.within(9.0, 16.0) } else { 1.5 };
        let (floor_gloss, wall_pattern) = (options.floor_gloss, options.wall_pattern);
        Self { kind, outline, floors, height, walls, outdoors, lamps, floor_gloss, wall_pattern }
    }

    /// Whether a point of the ground is on the floor.
    pub(crate) fn contains(&self, point: &Vector2<f64>) -> bool {
        self.floors.iter().any(|[x0, y0, x1, y1]| (*x0..=*x1).contains(&point.x) && (*y0..=*y1).contains(&point.y))
    }

    /// The distance from a point of the floor to the nearest wall, metres.
    pub(crate) fn distance_to_walls(&self, point: &Vector2<f64>) -> f64 {
        self.walls
            .iter()
            .map(|wall| {
                let start = wall.frame.origin.xy();
                let along = (point - start).dot(&wall.frame.x).clamp(0.0, wall.length);
                (point - start - wall.frame.x * along).norm()
            })
            .fold(f64::MAX, f64::min)
    }

    /// The least and the greatest corner of the floor.
    pub(crate) fn bounds(&self) -> (Vector2<f64>, Vector2<f64>) {
        let start = Vector2::new(0.0, 0.0);
        self.outline.iter().fold((start, start), |(low, high), p| (low.inf(p), high.sup(p)))
    }
}

/// The corners of a rectangle, counter-clockwise from the origin.
pub(crate) fn rectangle(width: f64, depth: f64) -> Vec<Vector2<f64>> {
    [[0.0, 0.0], [width, 0.0], [width, depth], [0.0, depth]].map(Vector2::from).to_vec()
}

/// How many doors and windows each wall gets, by kind of room.
fn counts(kind: RoomKind, walls: &[Wall], rng: &mut Rng) -> Vec<[usize; 2]> {
    let along = |k: usize, width: f64| ((walls[k].length / width) as usize).max(1);
    match kind {
        RoomKind::Corridor => {
            vec![[along(0, 2.6), 0], [0, 1], [along(2, 3.1), 0], [1, 0]]
        }
        RoomKind::Narrow => vec![[0, 0], [0, 1], [0, 0], [1, 0]],
        RoomKind::LShaped => vec![[0, along(0, 2.8)], [0, 1], [1, 0], [0, 0], [0, 1], [1, 0]],
        RoomKind::Office => vec![[0, along(0, 2.2)], [1, 0], [0, 0], [0, rng.below(2)]],
        RoomKind::LivingRoom | RoomKind::UnderTable => {
            vec![[0, along(0, 2.6)], [0, 1], [1, 0], [rng.below(2), 0]]
        }
        // Houses have theirs, on each storey.
        RoomKind::Yard => Vec::new(),
    }
}

fn pierce(kind: RoomKind, height: f64, walls: &mut [Wall], rng: &mut Rng) {
    let counts = counts(kind, walls, rng);
    let sill = if kind == RoomKind::LivingRoom && rng.chance(0.4) { 0.25 } else { rng.within(0.8, 1.0) };
    let head = (height - rng.within(0.2, 0.4)).min(2.35);
    let wish = rng.within(1.1, 1.9);
    for (wall, [doors, windows]) in walls.iter_mut().zip(counts) {
        let total = doors + windows;
        for k in 0..total {
            let filling = if k < doors { Filling::Door } else { Filling::Window };
            let slot = wall.length / total as f64;
            let (width, z) = match filling {
                Filling::Door => (rng.pick([0.8, 0.86, 0.94]), [0.0, rng.pick([2.0, 2.03, 2.1])]),
                Filling::Window => (wish, [sill, head]),
            };
            let width = width.min(slot - 0.4);
            if width > 0.5 {
                let middle = (k as f64 + 0.5) * slot;
                let play = 0.5 * (slot - width) - 0.2;
                let start = middle - 0.5 * width + play * rng.within(-0.7, 0.7);
                wall.openings.push(Opening { filling, along: [start, start + width], z });
            }
        }
    }
}

/// The day outside: if the sun shines, it shines through one of the windows.
fn day(options: &RoomOptions, walls: &[Wall], rng: &mut Rng) -> Outdoors {
    let windowed: Vec<&Wall> =
        walls.iter().filter(|wall| wall.openings.iter().any(|o| o.filling == Filling::Window)).collect();
    let pick = rng.below(windowed.len());
    let (elevation, aside) = (rng.within(0.35, 0.85), rng.within(-0.8, 0.8));
    let sunny = rng.chance(0.5);
    let outward = windowed.get(pick).map_or_else(Vector2::x, |wall| Vector2::new(wall.frame.x.y, -wall.frame.x.x));
    let azimuth = outward.y.atan2(outward.x) + aside;
    let (s, c) = elevation.sin_cos();
    Outdoors {
        brightness: 6.0 * options.daylight,
        towards_sun: Vector3::new(c * azimuth.cos(), c * azimuth.sin(), s),
        sun: if sunny && options.daylight > 0.2 { 5.0 * options.daylight } else { 0.0 },
        seed: rng.seed(),
    }
}
