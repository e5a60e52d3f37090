//! Furnishing: which pieces stand where, so that they leave doors, windows and each other free.

mod decor;
mod palette;
mod seating;
mod storage;
mod tables;

use crate::builder::{Builder, Footprint};
use crate::frame::Frame;
use crate::options::{RoomKind, RoomOptions};
use crate::plan::{Filling, Plan, Wall};
use crate::rng::Rng;
use palette::Palette;

/// The floor as it fills up.
struct Layout<'a> {
    plan: &'a Plan,
    claims: Vec<Footprint>,
}

impl Layout<'_> {
    /// Claims the rectangle `low..high` of a frame, if it is inside the room and free.
    fn claim(&mut self, frame: &Frame, low: [f64; 2], high: [f64; 2]) -> bool {
        let footprint = Footprint::new(frame, low, high);
        let corners_inside = footprint.corners().iter().all(|c| {
            // A hair inside, so that pieces may touch the walls.
            self.plan.contains(&(footprint.center + (c - footprint.center) * 0.99))
        });
        let reflex_outside = self.plan.outline.iter().all(|corner| footprint.distance(corner) > 0.0);
        let free = corners_inside && reflex_outside && !self.claims.iter().any(|other| other.overlaps(&footprint));
        if free {
            self.claims.push(footprint);
        }
        free
    }
}

/// A piece that stands against a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Piece {
    Bookshelf,
    Cupboard,
    Sideboard,
    Desk,
    Sofa,
    Rack,
    Plant,
    FloorLamp,
    Bin,
    Chair,
}

impl Piece {
    /// Width, depth with the room in front that it needs, and height, metres.
    fn size(self, rng: &mut Rng) -> [f64; 3] {
        match self {
            Self::Bookshelf => [rng.within(0.75, 1.3), 0.32, rng.within(1.6, 2.2)],
            Self::Cupboard => [rng.within(0.8, 1.3), 0.45, rng.within(1.0, 2.1)],
            Self::Sideboard => [rng.within(1.1, 1.8), 0.45, rng.within(0.6, 0.85)],
            Self::Desk => [rng.within(1.3, 1.7), 1.35, 0.74],
            Self::Sofa => [rng.within(1.6, 2.2), 0.9, 0.85],
            Self::Rack => [rng.within(0.9, 1.2), 0.42, rng.within(1.8, 2.2)],
            Self::Plant => [0.6, 0.6, rng.within(0.8, 1.7)],
            Self::FloorLamp => [0.45, 0.45, rng.within(1.4, 1.7)],
            Self::Bin => [0.3, 0.3, 0.35],
            Self::Chair => [0.6, 0.65, 0.9],
        }
    }
}

/// Furnishes a room; returns the places the robot is meant for, none for anywhere.
pub(crate) fn furnish(plan: &Plan, options: &RoomOptions, builder: &mut Builder, rng: &mut Rng) -> Vec<Footprint> {
    let palette = Palette::draw(builder, rng);
    let mut layout = Layout { plan, claims: Vec::new() };
    for wall in &plan.walls {
        for door in wall.openings.iter().filter(|o| o.filling == Filling::Door) {
            layout.claim(&wall.frame, [door.along[0] - 0.1, 0.0], [door.along[1] + 0.1, 0.75]);
        }
    }
    if options.extent >= 1.5 && plan.kind != RoomKind::Corridor {
        pillars(&mut layout, builder);
    }
    let places = tables::freestanding(&mut layout, &palette, builder, rng);
    let mut order: Vec<usize> = (0..plan.walls.len()).collect();
    for k in (1..order.len()).rev() {
        order.swap(k, rng.below(k + 1));
    }
    for k in order {
        let tall = along_wall(&plan.walls[k], &mut layout, &palette, options.clutter, builder, rng);
        decor::hang(&plan.walls[k], &tall, plan, &palette, options.clutter, builder, rng);
    }
    places
}

/// Lines the walls of a room with furniture, and leaves its middle free.
pub(crate) fn furnish_walls(plan: &Plan, clutter: f64, builder: &mut Builder, rng: &mut Rng) {
    let palette = Palette::draw(builder, rng);
    let mut layout = Layout { plan, claims: Vec::new() };
    for wall in &plan.walls {
        for door in &wall.openings {
            layout.claim(&wall.frame, [door.along[0] - 0.1, 0.0], [door.along[1] + 0.1, 0.75]);
        }
    }
    for wall in &plan.walls {
        let tall = along_wall(wall, &mut layout, &palette, clutter, builder, rng);
        decor::hang(wall, &tall, plan, &palette, clutter, builder, rng);
    }
}

/// Square pillars from floor to ceiling on an even grid.
fn pillars(layout: &mut Layout<'_>, builder: &mut Builder) {
    let paint = builder.paint(196, 192, 184);
    for [x0, y0, x1, y1] in layout.plan.floors.clone() {
        let count = |length: f64| ((length / 3.6) as usize).max(1);
        let (nx, ny) = (count(x1 - x0), count(y1 - y0));
        for k in 0..(nx - 1) * (ny - 1) {
            let place = |low: f64, high: f64, at: usize, n: usize| low + (high - low) * (at + 1) as f64 / n as f64;
            let frame = Frame::new(place(x0, x1, k % (nx - 1), nx), place(y0, y1, k / (nx - 1), ny), 0.0);
            if layout.claim(&frame, [-0.6, -0.6], [0.6, 0.6]) {
                builder.cuboid(&frame, [-0.18, -0.18, 0.0], [0.18, 0.18, layout.plan.height], paint);
                builder.solid(&frame, [-0.18, -0.18], [0.18, 0.18]);
            }
        }
    }
}

/// Lines a wall with furniture; returns the intervals where something stands that hides the wall, with its height.
fn along_wall(
    wall: &Wall,
    layout: &mut Layout<'_>,
    palette: &Palette,
    clutter: f64,
    builder: &mut Builder,
    rng: &mut Rng,
) -> Vec<[f64; 3]> {
    let mut taken = Vec::new();
    let mut x = 0.05;
    let kind = layout.plan.kind;
    while x < wall.length - 0.3 {
        if !rng.chance(0.25 + 0.75 * clutter) {
            x += rng.within(0.4, 0.9);
            continue;
        }
        let piece = choose(kind, rng);
        let [width, depth, height] = piece.size(rng);
        let blocks_light = height > 0.9 && !wall.is_free_of(Filling::Window, x, x + width, 0.1);
        let frame = wall.frame.then(x, 0.012, 0.0, 0.0);
        // A radiator keeps furniture a little off the wall under a window.
        let off = if wall.is_free_of(Filling::Window, x, x + width, 0.0) { 0.0 } else { 0.12 };
        let frame = frame.then(0.0, off, 0.0, 0.0);
        if x + width > wall.length - 0.02 || blocks_light || !layout.claim(&frame, [0.0, 0.0], [width, depth]) {
            x += 0.12;
            continue;
        }
        build(piece, &frame, [width, height], palette, builder, rng);
        taken.push([x, x + width, if piece == Piece::Sofa { 1.0 } else { height }]);
        x += width + if rng.chance(0.5) { 0.03 } else { rng.within(0.1, 0.6) };
    }
    taken
}

fn choose(kind: RoomKind, rng: &mut Rng) -> Piece {
    use Piece::{Bin, Bookshelf, Chair, Cupboard, Desk, FloorLamp, Plant, Rack, Sideboard, Sofa};
    match kind {
        RoomKind::Office => rng.pick([Bookshelf, Bookshelf, Cupboard, Desk, Desk, Desk, Plant, Bin, Sideboard, Chair]),
        RoomKind::LivingRoom => {
            rng.pick([Bookshelf, Bookshelf, Cupboard, Sideboard, Sideboard, Sofa, Sofa, Plant, FloorLamp, Chair])
        }
        RoomKind::Corridor | RoomKind::Yard => rng.pick([Bin, Plant, Cupboard, Chair, Bookshelf, Cupboard]),
        RoomKind::LShaped => {
            rng.pick([Bookshelf, Cupboard, Sideboard, Desk, Sofa, Plant, FloorLamp, Chair, Bookshelf, Rack])
        }
        RoomKind::Narrow => rng.pick([Rack, Rack, Rack, Cupboard, Bookshelf, Bin]),
        RoomKind::UnderTable => rng.pick([Bookshelf, Cupboard, Sideboard, Sideboard, Plant, FloorLamp, Chair]),
    }
}

fn build(piece: Piece, frame: &Frame, size: [f64; 2], palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let [width, height] = size;
    match piece {
        Piece::Bookshelf => storage::bookshelf(frame, width, height, palette, builder, rng),
        Piece::Cupboard => storage::cupboard(frame, width, height, palette, builder, rng),
        Piece::Sideboard => storage::sideboard(frame, width, height, palette, builder, rng),
        Piece::Rack => storage::rack(frame, width, height, palette, builder, rng),
        Piece::Desk => {
            tables::desk(frame, width, palette, builder, rng);
            seating::office_chair(&frame.then(0.5 * width, 1.0, 0.0, rng.within(2.2, 4.0)), palette, builder, rng);
        }
        Piece::Sofa => seating::sofa(frame, width, palette, builder, rng),
        Piece::Plant => decor::plant(&frame.then(0.3, 0.3, 0.0, 0.0), height, palette, builder, rng),
        Piece::FloorLamp => decor::floor_lamp(&frame.then(0.22, 0.22, 0.0, 0.0), height, palette, builder),
        Piece::Bin => decor::bin(&frame.then(0.15, 0.15, 0.0, 0.0), palette, builder),
        Piece::Chair => {
            seating::chair(&frame.then(0.3, 0.35, 0.0, rng.within(-0.3, 0.3)), palette.chair, palette, builder, rng);
        }
    }
}
