//! What hangs and stands around: pictures, boards, clocks, plants, lamps, vases, bins, televisions.

use nalgebra::Vector3;

use super::palette::Palette;
use crate::builder::{Builder, Column, MaterialId, Patch};
use crate::frame::Frame;
use crate::options::RoomKind;
use crate::plan::{Filling, Plan, Wall};
use crate::rng::Rng;
use crate::texture::{Texture, rgb};

/// Hangs pictures and boards where a wall shows above its furniture: `taken` are intervals and heights.
pub(crate) fn hang(
    wall: &Wall,
    taken: &[[f64; 3]],
    plan: &Plan,
    palette: &Palette,
    clutter: f64,
    builder: &mut Builder,
    rng: &mut Rng,
) {
    let mut x = rng.within(0.2, 0.7);
    while x < wall.length - 0.5 {
        let office = matches!(plan.kind, RoomKind::Office | RoomKind::Corridor | RoomKind::Narrow);
        let board = office && rng.chance(0.35);
        let size = if board {
            [rng.within(0.9, 1.8), rng.within(0.8, 1.1)]
        } else {
            [rng.within(0.3, 0.9), rng.within(0.3, 0.7)]
        };
        let low = if board { 0.95 } else { rng.within(1.25, 1.5) };
        let (from, to) = (x - 0.06, x + size[0] + 0.06);
        let fits = to < wall.length - 0.1
            && low + size[1] < plan.height - 0.15
            && wall.is_free_of(Filling::Door, from, to, 0.27)
            && wall.is_free_of(Filling::Window, from, to, 0.4)
            && taken.iter().all(|[a, b, high]| to < *a || from > *b || *high < low - 0.05);
        if !fits {
            x += 0.25;
            continue;
        }
        if rng.chance(0.25 + 0.7 * clutter) {
            let place = wall.frame.then(x + size[0], 0.0, low, 0.0);
            if board {
                self::board(&place, size, palette, builder, rng);
            } else {
                picture(&place, size, palette, builder, rng);
            }
        }
        x = to + rng.within(0.15, 0.9);
    }
}

/// A framed picture; the frame's origin is its lower left corner seen from the front, its width runs along `-x`.
/// Some hang a little askew.
fn picture(frame: &Frame, size: [f64; 2], palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let (sky, land) = rng.pick([
        (rgb(150, 190, 220), rgb(90, 120, 60)),
        (rgb(230, 190, 140), rgb(120, 80, 60)),
        (rgb(220, 224, 228), rgb(70, 90, 110)),
        (rgb(70, 80, 110), rgb(40, 50, 50)),
    ]);
    let accent = rng.pick([rgb(240, 210, 90), rgb(200, 60, 50), rgb(245, 240, 230)]);
    let rim = rng.pick([palette.dark, palette.wood_v, palette.white, palette.metal]);
    let askew = if rng.chance(0.4) { rng.within(-0.04, 0.04) } else { 0.0 };
    let inner = [size[0] - 0.05, size[1] - 0.05];
    let texture = Texture::Picture { size: inner, sky, land, accent, seed: rng.seed() };
    framed(frame, size, askew, texture, rim, builder);
}

/// A whiteboard or a pinboard.
fn board(frame: &Frame, size: [f64; 2], palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let (seed, inner) = (rng.seed(), [size[0] - 0.05, size[1] - 0.05]);
    if rng.chance(0.6) {
        framed(frame, size, 0.0, Texture::Whiteboard { size: inner, seed }, palette.metal, builder);
        builder.cuboid(frame, [-size[0] + 0.2, 0.0, -0.02], [-0.2, 0.07, -0.005], palette.metal);
    } else {
        framed(frame, size, 0.0, Texture::Pinboard { size: inner, seed }, palette.wood_v, builder);
    }
}

/// A flat thing in a frame of 2.5 cm, turned in the plane of its wall by `askew` radians.
fn framed(frame: &Frame, size: [f64; 2], askew: f64, texture: Texture, rim: MaterialId, builder: &mut Builder) {
    let (s, c) = askew.sin_cos();
    let (right, up, out) = (frame.vector(-c, 0.0, s), frame.vector(s, 0.0, c), frame.vector(0.0, 1.0, 0.0));
    let (width, height, border) = (right * size[0], up * size[1], 0.025);
    let mut bar = |origin: Vector3<f64>, along: Vector3<f64>, upward: Vector3<f64>| {
        builder.sheared(origin, [out * 0.025, along, upward], rim);
    };
    let start = frame.origin;
    bar(start, right * border, height);
    bar(start + width - right * border, right * border, height);
    let between = right * (size[0] - 2.0 * border);
    bar(start + right * border, between, up * border);
    bar(start + right * border + height - up * border, between, up * border);
    let material = builder.matt(texture);
    builder.patch(Patch {
        origin: start + (right + up) * border + out * 0.012,
        du: between,
        dv: up * (size[1] - 2.0 * border),
        triangle: false,
        material,
        uv: [0.0; 2],
    });
}

/// A potted plant of the given height around the frame's origin.
pub(crate) fn plant(frame: &Frame, height: f64, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let pot = 0.28;
    builder.column(frame, &Column { at: [0.0, 0.0], z: [0.0, pot], radius: [0.12, 0.17], sides: 14 }, palette.pot);
    let bushy = rng.chance(0.5);
    let stems = if bushy { 9 } else { 3 };
    for _ in 0..stems {
        let (sway_x, sway_y) = (rng.within(-0.14, 0.14), rng.within(-0.14, 0.14));
        let top = pot + (height - pot) * rng.within(0.6, 1.0);
        builder.post(frame, [0.0, 0.0, pot - 0.02], [sway_x, sway_y, top], 0.012, palette.leaves[2]);
        for k in 0..if bushy { 7 } else { 16 } {
            let t = if bushy { rng.within(0.2, 1.0) } else { rng.within(0.45, 1.0) };
            let at = [sway_x * t, sway_y * t, pot + (top - pot) * t];
            leaf(frame, at, rng.within(0.12, 0.28), palette.leaves[k % 3], builder, rng);
        }
    }
    builder.solid(frame, [-0.17, -0.17], [0.17, 0.17]);
}

/// A leaf of two bent triangles that grows from a point in any direction.
fn leaf(frame: &Frame, at: [f64; 3], length: f64, material: MaterialId, builder: &mut Builder, rng: &mut Rng) {
    let (azimuth, rise) = (rng.within(0.0, std::f64::consts::TAU), rng.within(-0.2, 0.9));
    let (s, c) = azimuth.sin_cos();
    let base = frame.point(at[0], at[1], at[2]);
    let tip = base + frame.vector(length * c, length * s, length * rise);
    let middle = base + 0.45 * (tip - base) + Vector3::z() * (0.18 * length);
    let across = frame.vector(-s, c, 0.0) * (0.17 * length);
    builder.triangle([base, middle - across, middle + across], material);
    builder.triangle([middle + across, middle - across, tip], material);
}

/// A standing lamp: foot, rod, shining shade.
pub(crate) fn floor_lamp(frame: &Frame, height: f64, palette: &Palette, builder: &mut Builder) {
    let column = |z: [f64; 2], radius: [f64; 2], sides| Column { at: [0.0, 0.0], z, radius, sides };
    builder.column(frame, &column([0.0, 0.03], [0.14, 0.13], 16), palette.dark);
    builder.column(frame, &column([0.03, height - 0.25], [0.012, 0.012], 8), palette.dark);
    builder.column(frame, &column([height - 0.28, height], [0.2, 0.13], 10), palette.lampshade);
    builder.solid(frame, [-0.14, -0.14], [0.14, 0.14]);
}

/// A bin that widens upwards.
pub(crate) fn bin(frame: &Frame, palette: &Palette, builder: &mut Builder) {
    let column = Column { at: [0.0, 0.0], z: [0.0, 0.34], radius: [0.1, 0.14], sides: 16 };
    builder.column(frame, &column, palette.dark);
    builder.solid(frame, [-0.14, -0.14], [0.14, 0.14]);
}

/// A vase or cup, some with a few twigs.
pub(crate) fn vase(frame: &Frame, height: f64, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let material = rng.pick([palette.pot, palette.white, palette.cushion]);
    let body = 0.7 * height;
    let radius = 0.3 * height;
    let column = |z: [f64; 2], radius: [f64; 2]| Column { at: [0.0, 0.0], z, radius, sides: 12 };
    builder.column(frame, &column([0.0, 0.5 * body], [0.6 * radius, radius]), material);
    builder.column(frame, &column([0.5 * body, body], [radius, 0.5 * radius]), material);
    if height > 0.15 && rng.chance(0.6) {
        for k in 0..5 {
            let (x, y) = (rng.within(-0.1, 0.1), rng.within(-0.1, 0.1));
            builder.post(frame, [0.0, 0.0, body], [x, y, height * 1.6], 0.006, palette.leaves[2]);
            leaf(frame, [x, y, height * 1.5], 0.08, palette.leaves[k % 3], builder, rng);
        }
    }
}

/// A television on a foot, facing `+y`.
pub(crate) fn television(frame: &Frame, width: f64, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let (half, high) = (0.5 * width, 0.06 + 0.57 * width);
    builder.cuboid(frame, [-0.2, -0.1, 0.0], [0.2, 0.1, 0.015], palette.dark);
    builder.cuboid(frame, [-0.04, -0.03, 0.015], [0.04, 0.0, 0.1], palette.dark);
    builder.cuboid(frame, [-half, -0.03, 0.06], [half, 0.02, high], palette.dark);
    let size = [width - 0.03, high - 0.09];
    let picture = Texture::Picture {
        size,
        sky: rgb(60, 70, 90),
        land: rgb(40, 46, 50),
        accent: rgb(200, 180, 120),
        seed: rng.seed(),
    };
    let material = builder.matt(picture);
    let (x, z) = (half - 0.015, 0.075);
    builder.pane(frame, [[x, 0.021, z], [-x, 0.021, z], [x, 0.021, z + size[1]]], [0.0; 2], material);
}
