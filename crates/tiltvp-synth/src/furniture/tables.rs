//! Tables and desks, and what stands free in the room: dining groups, desk islands, low tables with rugs, pillars.

use super::palette::Palette;
use super::{Layout, decor, seating};
use crate::builder::{Builder, Footprint, Material};
use crate::frame::Frame;
use crate::options::RoomKind;
use crate::rng::Rng;
use crate::texture::{Texture, rgb};

/// Furnishes the middle of the room; returns the places meant for the robot.
pub(crate) fn freestanding(
    layout: &mut Layout<'_>,
    palette: &Palette,
    builder: &mut Builder,
    rng: &mut Rng,
) -> Vec<Footprint> {
    let (kind, floors) = (layout.plan.kind, layout.plan.floors.clone());
    let mut places = Vec::new();
    for [x0, y0, x1, y1] in floors {
        let (cx, cy) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
        let (play_x, play_y) = (0.1 * (x1 - x0), 0.06 * (y1 - y0));
        let frame = Frame::new(
            cx + rng.within(-play_x, play_x),
            cy + rng.within(-play_y, play_y),
            if rng.chance(0.7) { 0.0 } else { rng.within(-0.3, 0.3) },
        );
        match kind {
            RoomKind::Office => island(&frame, layout, palette, builder, rng),
            RoomKind::LivingRoom => low_table(&frame, layout, palette, builder, rng),
            RoomKind::LShaped => {
                if rng.chance(0.5) {
                    dining(&frame, layout, palette, builder, rng);
                } else {
                    low_table(&frame, layout, palette, builder, rng);
                }
            }
            RoomKind::UnderTable => {
                // The table is the point of this room: it stands straight in the middle if it must.
                let middle = Frame::new(cx, cy - 0.1, 0.0);
                let place = dining(&frame, layout, palette, builder, rng)
                    .or_else(|| dining(&middle, layout, palette, builder, rng));
                places.extend(place);
            }
            RoomKind::Corridor | RoomKind::Narrow | RoomKind::Yard => {}
        }
    }
    places
}

/// A table top on four legs that stand out by `splay` at the floor.
fn table(frame: &Frame, size: [f64; 3], splay: f64, palette: &Palette, builder: &mut Builder) {
    let [a, b, height] = [0.5 * size[0], 0.5 * size[1], size[2]];
    builder.cuboid(frame, [-a, -b, height - 0.035], [a, b, height], palette.wood);
    builder.cuboid(frame, [-a + 0.07, -b + 0.07, height - 0.12], [a - 0.07, -b + 0.09, height - 0.035], palette.wood);
    builder.cuboid(frame, [-a + 0.07, b - 0.09, height - 0.12], [a - 0.07, b - 0.07, height - 0.035], palette.wood);
    builder.cuboid(frame, [-a + 0.07, -b + 0.09, height - 0.12], [-a + 0.09, b - 0.09, height - 0.035], palette.wood);
    builder.cuboid(frame, [a - 0.09, -b + 0.09, height - 0.12], [a - 0.07, b - 0.09, height - 0.035], palette.wood);
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let (top, foot) = ([x * (a - 0.08), y * (b - 0.08)], [x * (a - 0.08 + splay), y * (b - 0.08 + splay)]);
        builder.post(frame, [foot[0], foot[1], 0.0], [top[0], top[1], height - 0.035], 0.055, palette.wood_v);
        builder.solid(frame, [foot[0] - 0.05, foot[1] - 0.05], [foot[0] + 0.05, foot[1] + 0.05]);
    }
}

/// A dining table with chairs around it; returns the floor under the table.
fn dining(
    frame: &Frame,
    layout: &mut Layout<'_>,
    palette: &Palette,
    builder: &mut Builder,
    rng: &mut Rng,
) -> Option<Footprint> {
    let (a, b) = (rng.within(1.5, 1.9), rng.within(0.9, 1.05));
    if !layout.claim(frame, [-0.5 * a - 0.45, -0.5 * b - 0.55], [0.5 * a + 0.45, 0.5 * b + 0.55]) {
        return None;
    }
    let splay = if rng.chance(0.5) { 0.0 } else { rng.within(0.02, 0.06) };
    table(frame, [a, b, 0.74], splay, palette, builder);
    decor::vase(&frame.then(rng.within(-0.2, 0.2), 0.0, 0.74, 0.0), 0.25, palette, builder, rng);
    let seats = if a > 1.7 { 3 } else { 2 };
    for side in [-1.0, 1.0] {
        for k in 0..seats {
            if !rng.chance(0.85) {
                continue;
            }
            let x = a * ((f64::from(k) + 0.5) / f64::from(seats) - 0.5);
            let y = side * (0.5 * b + rng.within(0.1, 0.3));
            let turn = rng.within(-0.25, 0.25) + if side > 0.0 { std::f64::consts::PI } else { 0.0 };
            seating::chair(&frame.then(x, y, 0.0, turn), palette.chair, palette, builder, rng);
        }
    }
    if rng.chance(0.5) {
        seating::chair(&frame.then(0.5 * a + 0.15, 0.0, 0.0, 1.57), palette.chair, palette, builder, rng);
    }
    Some(Footprint::new(frame, [-0.5 * a, -0.5 * b], [0.5 * a, 0.5 * b]))
}

/// A low table on a rug.
fn low_table(frame: &Frame, layout: &mut Layout<'_>, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let size = [rng.within(0.9, 1.2), rng.within(0.5, 0.7), rng.within(0.38, 0.45)];
    if !layout.claim(frame, [-0.5 * size[0], -0.5 * size[1]], [0.5 * size[0], 0.5 * size[1]]) {
        return;
    }
    let rug = [size[0] + 1.0, size[1] + 0.9];
    let (base, ink) = rng.pick([
        (rgb(150, 56, 48), rgb(216, 196, 150)),
        (rgb(60, 76, 100), rgb(200, 200, 196)),
        (rgb(206, 196, 176), rgb(110, 90, 76)),
    ]);
    let seed = rng.seed();
    let material = builder.matt(Texture::Rug { size: rug, base, ink, seed });
    let (x, y) = (0.5 * rug[0], 0.5 * rug[1]);
    builder.pane(frame, [[-x, -y, 0.006], [x, -y, 0.006], [-x, y, 0.006]], [0.0; 2], material);
    table(frame, size, rng.within(0.0, 0.08), palette, builder);
    builder.solid(frame, [-0.5 * size[0], -0.5 * size[1]], [0.5 * size[0], 0.5 * size[1]]);
    decor::vase(&frame.then(0.1, 0.0, size[2], 0.0), 0.18, palette, builder, rng);
}

/// Two desks face to face, their chairs outside.
fn island(frame: &Frame, layout: &mut Layout<'_>, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let width = rng.within(1.4, 1.7);
    if !layout.claim(frame, [-0.5 * width, -1.45], [0.5 * width, 1.45]) {
        return;
    }
    for turn in [0.0, std::f64::consts::PI] {
        let side = frame.then(0.0, 0.0, 0.0, turn);
        desk(&side.then(-0.5 * width, 0.03, 0.0, 0.0), width, palette, builder, rng);
        let chair = side.then(rng.within(-0.2, 0.2), rng.within(0.95, 1.1), 0.0, rng.within(2.4, 3.9));
        seating::office_chair(&chair, palette, builder, rng);
    }
    builder.cuboid(frame, [-0.5 * width, -0.015, 0.3], [0.5 * width, 0.015, 1.2], palette.fabric);
}

/// A desk with drawers, screen, keyboard and clutter, its back at `y = 0`.
pub(crate) fn desk(frame: &Frame, width: f64, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let (depth, height) = (0.72, 0.74);
    builder.cuboid(frame, [0.0, 0.0, height - 0.03], [width, depth, height], palette.wood);
    for x in [0.02, width - 0.06] {
        builder.cuboid(frame, [x, 0.06, 0.0], [x + 0.04, 0.1, height - 0.03], palette.metal);
        builder.cuboid(frame, [x, depth - 0.1, 0.0], [x + 0.04, depth - 0.06, height - 0.03], palette.metal);
        builder.cuboid(frame, [x, 0.1, 0.02], [x + 0.04, depth - 0.1, 0.05], palette.metal);
        builder.solid(frame, [x, 0.0], [x + 0.04, depth]);
    }
    let drawers = if rng.chance(0.5) { 0.09 } else { width - 0.5 };
    builder.cuboid(frame, [drawers, 0.1, 0.04], [drawers + 0.41, depth - 0.06, 0.6], palette.white);
    for k in 0..3 {
        let z = 0.05 + 0.183 * f64::from(k);
        builder.cuboid(
            frame,
            [drawers + 0.005, depth - 0.06, z],
            [drawers + 0.405, depth - 0.04, z + 0.17],
            palette.front,
        );
        builder.cuboid(
            frame,
            [drawers + 0.14, depth - 0.04, z + 0.12],
            [drawers + 0.27, depth - 0.02, z + 0.135],
            palette.metal,
        );
    }
    builder.solid(frame, [drawers, 0.1], [drawers + 0.41, depth]);
    let top = frame.then(0.0, 0.0, height, 0.0);
    let screens = 1 + rng.below(2);
    for k in 0..screens {
        let x = width * (k as f64 + 0.5) / screens as f64 + rng.within(-0.05, 0.05);
        screen(&top.then(x, 0.22, 0.0, rng.within(-0.25, 0.25)), palette, builder, rng);
    }
    builder.cuboid(&top, [0.5 * width - 0.2, 0.42, 0.0], [0.5 * width + 0.2, 0.56, 0.02], palette.dark);
    if rng.chance(0.6) {
        decor::vase(&top.then(width - 0.14, 0.5, 0.0, 0.0), 0.1, palette, builder, rng);
    }
    if rng.chance(0.7) {
        let pile = top.then(0.18, 0.45, 0.0, rng.within(-0.3, 0.3));
        builder.cuboid(&pile, [-0.1, -0.15, 0.0], [0.11, 0.15, rng.within(0.01, 0.09)], palette.white);
    }
}

/// A flat screen on a foot, facing `+y`.
fn screen(frame: &Frame, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let (half, low, high) = (rng.within(0.24, 0.32), 0.12, 0.47);
    builder.cuboid(frame, [-0.11, -0.09, 0.0], [0.11, 0.09, 0.012], palette.dark);
    builder.cuboid(frame, [-0.025, -0.06, 0.01], [0.025, -0.035, 0.3], palette.dark);
    builder.cuboid(frame, [-half, -0.035, low], [half, 0.0, high], palette.dark);
    let size = [2.0 * half - 0.03, high - low - 0.03];
    let seed = rng.seed();
    let lit = rng.chance(0.7);
    let picture = builder.matt(Texture::Screen { size, seed });
    let (x, z) = (half - 0.015, low + 0.015);
    let off = builder.material(Material::Matt(Texture::Paint { color: [0.02; 3], mottle: 0.0, seed }));
    let material = if lit { picture } else { off };
    builder.pane(frame, [[x, 0.001, z], [-x, 0.001, z], [x, 0.001, high - 0.015]], [0.0; 2], material);
}
