//! What fills the openings of a wall: doors, windows with their bars, curtains and the radiators below them.

use crate::builder::{Builder, MaterialId};
use crate::frame::Frame;
use crate::plan::Opening;
use crate::rng::Rng;
use crate::texture::{Texture, rgb};

/// The materials of everything fixed to the walls.
pub(crate) struct Trims {
    pub(crate) trim: MaterialId,
    pub(crate) door: MaterialId,
    pub(crate) metal: MaterialId,
    pub(crate) radiator: MaterialId,
    pub(crate) glass: MaterialId,
    pub(crate) curtain: Option<MaterialId>,
    /// Upright and level bars per window.
    pub(crate) bars: [usize; 2],
}

/// The material of all doors of a room.
pub(crate) fn door_leaf(builder: &mut Builder, rng: &mut Rng) -> MaterialId {
    if rng.chance(0.6) {
        let seed = rng.seed();
        let (light, dark) = rng.pick([
            (rgb(190, 140, 90), rgb(130, 86, 50)),
            (rgb(120, 78, 50), rgb(70, 42, 26)),
            (rgb(214, 180, 136), rgb(172, 130, 88)),
        ]);
        builder.matt(Texture::Wood { light, dark, along_v: true, seed })
    } else {
        let (r, g, b) = rng.pick([(70, 96, 120), (226, 224, 216), (140, 60, 52), (92, 110, 92)]);
        builder.paint(r, g, b)
    }
}

/// The material of all curtains of a room.
pub(crate) fn curtain(builder: &mut Builder, rng: &mut Rng) -> MaterialId {
    let color = rng.pick([rgb(170, 60, 50), rgb(205, 190, 160), rgb(70, 90, 120), rgb(110, 120, 80)]);
    let seed = rng.seed();
    builder.matt(Texture::Cloth { color, fold: 0.25, seed })
}

/// The four inner sides of an opening, down to `depth` behind the wall.
fn reveal(frame: &Frame, opening: &Opening, depth: f64, material: MaterialId, sill: MaterialId, builder: &mut Builder) {
    let ([x0, x1], [z0, z1], d) = (opening.along, opening.z, -depth);
    builder.pane(frame, [[x0, d, z0], [x0, 0.0, z0], [x0, d, z1]], [0.0; 2], material);
    builder.pane(frame, [[x1, 0.0, z0], [x1, d, z0], [x1, 0.0, z1]], [0.0; 2], material);
    builder.pane(frame, [[x0, d, z1], [x0, 0.0, z1], [x1, d, z1]], [0.0; 2], material);
    builder.pane(frame, [[x0, d, z0], [x1, d, z0], [x0, 0.0, z0]], [0.0; 2], sill);
    for x in opening.along {
        builder.edge(frame.point(x, 0.0, z0), z1 - z0);
    }
}

/// A door with its casing, handle and light switch.
pub(crate) fn door(frame: &Frame, opening: &Opening, wall: MaterialId, trims: &Trims, builder: &mut Builder) {
    let ([x0, x1], z1) = (opening.along, opening.z[1]);
    reveal(frame, opening, 0.1, wall, trims.metal, builder);
    builder.pane(frame, [[x1, -0.09, 0.0], [x0, -0.09, 0.0], [x1, -0.09, z1]], [x0 + z1; 2], trims.door);
    // Where the leaf meets the reveal.
    for x in opening.along {
        builder.edge(frame.point(x, -0.09, 0.0), z1);
    }
    // Two raised fields, casing, handle.
    for [low, high] in [[0.15, 0.85], [1.0, z1 - 0.15]] {
        builder.cuboid(frame, [x0 + 0.13, -0.09, low], [x1 - 0.13, -0.075, high], trims.door);
    }
    builder.cuboid(frame, [x0 - 0.07, 0.0, 0.0], [x0, 0.025, z1 + 0.07], trims.trim);
    builder.cuboid(frame, [x1, 0.0, 0.0], [x1 + 0.07, 0.025, z1 + 0.07], trims.trim);
    builder.cuboid(frame, [x0, 0.0, z1], [x1, 0.025, z1 + 0.07], trims.trim);
    builder.cuboid(frame, [x0 + 0.05, -0.075, 0.98], [x0 + 0.09, -0.065, 1.14], trims.metal);
    builder.cuboid(frame, [x0 + 0.05, -0.03, 1.05], [x0 + 0.18, -0.015, 1.07], trims.metal);
    // Light switch.
    builder.cuboid(frame, [x0 - 0.24, 0.0, 1.05], [x0 - 0.16, 0.012, 1.13], trims.radiator);
}

/// A window with its frame and bars, its sill, and a radiator and curtains if there are.
pub(crate) fn window(frame: &Frame, opening: &Opening, wall: MaterialId, trims: &Trims, builder: &mut Builder) {
    casement(frame, opening, wall, trims, builder);
    let ([x0, x1], [z0, z1]) = (opening.along, opening.z);
    if z0 > 0.5 {
        builder.cuboid(frame, [x0 - 0.06, -0.1, z0 - 0.03], [x1 + 0.06, 0.1, z0], trims.trim);
        radiator(&frame.then(0.5 * (x0 + x1), 0.03, 0.0, 0.0), 0.8 * (x1 - x0), z0 - 0.15, trims, builder);
    }
    if let Some(curtain) = trims.curtain {
        builder.cuboid(frame, [x0 - 0.35, 0.06, z1 + 0.1], [x1 + 0.35, 0.085, z1 + 0.125], trims.metal);
        for (from, to) in [(x0 - 0.3, x0 + 0.12), (x1 - 0.12, x1 + 0.3)] {
            drape(frame, [from, to], [0.03, z1 + 0.11], curtain, builder);
        }
    }
}

/// The pane of a window with its reveal, frame and bars.
pub(crate) fn casement(frame: &Frame, opening: &Opening, wall: MaterialId, trims: &Trims, builder: &mut Builder) {
    let ([x0, x1], [z0, z1]) = (opening.along, opening.z);
    reveal(frame, opening, 0.2, wall, trims.trim, builder);
    builder.pane(frame, [[x1, -0.16, z0], [x0, -0.16, z0], [x1, -0.16, z1]], [0.0; 2], trims.glass);
    let mut bar = |low: [f64; 2], high: [f64; 2]| {
        builder.cuboid(frame, [low[0], -0.155, low[1]], [high[0], -0.10, high[1]], trims.trim);
    };
    bar([x0, z0], [x0 + 0.06, z1]);
    bar([x1 - 0.06, z0], [x1, z1]);
    bar([x0 + 0.06, z0], [x1 - 0.06, z0 + 0.06]);
    bar([x0 + 0.06, z1 - 0.06], [x1 - 0.06, z1]);
    let [uprights, levels] = trims.bars;
    for k in 1..=uprights {
        let x = x0 + (x1 - x0) * k as f64 / (uprights + 1) as f64;
        bar([x - 0.025, z0 + 0.06], [x + 0.025, z1 - 0.06]);
    }
    for k in 1..=levels {
        let z = z0 + (z1 - z0) * k as f64 / (levels + 1) as f64;
        bar([x0 + 0.06, z - 0.018], [x1 - 0.06, z + 0.018]);
    }
}

/// A pleated curtain.
fn drape(frame: &Frame, along: [f64; 2], z: [f64; 2], material: MaterialId, builder: &mut Builder) {
    let pleats = (2.0 * (along[1] - along[0]) / 0.07).round() as usize;
    let at = |k: usize| {
        let x = along[1] + (along[0] - along[1]) * k as f64 / pleats as f64;
        (x, if k.is_multiple_of(2) { 0.11 } else { 0.165 })
    };
    for k in 0..pleats {
        let ((xa, ya), (xb, yb)) = (at(k), at(k + 1));
        builder.pane(frame, [[xa, ya, z[0]], [xb, yb, z[0]], [xa, ya, z[1]]], [k as f64 * 0.05, 0.0], material);
        builder.edge(frame.point(xa, ya, z[0]), z[1] - z[0]);
    }
    let (x, y) = at(pleats);
    builder.edge(frame.point(x, y, z[0]), z[1] - z[0]);
}

/// A panel radiator with upright fins.
fn radiator(frame: &Frame, width: f64, height: f64, trims: &Trims, builder: &mut Builder) {
    let (half, low) = (0.5 * width, 0.12);
    builder.cuboid(frame, [-half, 0.02, low], [half, 0.05, height], trims.radiator);
    let fins = (width / 0.07) as usize;
    for k in 0..fins {
        let x = -half + width * (k as f64 + 0.5) / fins as f64;
        builder.cuboid(frame, [x - 0.014, 0.05, low + 0.02], [x + 0.014, 0.075, height - 0.02], trims.radiator);
    }
    builder.post(frame, [half - 0.05, 0.035, 0.0], [half - 0.05, 0.035, low], 0.02, trims.metal);
    builder.solid(frame, [-half, 0.0], [half, 0.08]);
}
