//! Bookshelves with books, cupboards, sideboards and metal racks with boxes.

use super::decor;
use super::palette::Palette;
use crate::builder::{Builder, Column};
use crate::frame::Frame;
use crate::rng::Rng;
use crate::texture::Texture;

/// An open shelf full of books, its back against `y = 0`.
pub(crate) fn bookshelf(
    frame: &Frame,
    width: f64,
    height: f64,
    palette: &Palette,
    builder: &mut Builder,
    rng: &mut Rng,
) {
    let (depth, board) = (0.3, 0.022);
    for x in [0.0, width - board] {
        builder.cuboid(frame, [x, 0.0, 0.0], [x + board, depth, height], palette.wood_v);
    }
    builder.cuboid(frame, [board, 0.0, 0.0], [width - board, 0.008, height], palette.wood_v);
    builder.cuboid(frame, [board, 0.0, 0.0], [width - board, depth - 0.03, 0.07], palette.wood);
    builder.cuboid(frame, [board, 0.0, height - board], [width - board, depth, height], palette.wood);
    let rows = ((height - 0.1) / 0.36).round().max(2.0) as usize;
    let pitch = (height - 0.07 - board) / rows as f64;
    for row in 0..rows {
        let z = 0.07 + row as f64 * pitch;
        builder.cuboid(frame, [board, 0.0, z], [width - board, depth - 0.005, z + board], palette.wood);
        let shelf = frame.then(board, 0.0, z + board, 0.0);
        match rng.below(8) {
            0 => decor::vase(&shelf.then(rng.within(0.15, width - 0.2), 0.15, 0.0, 0.0), 0.22, palette, builder, rng),
            1 => boxes(&shelf, width - 2.0 * board, depth - 0.05, pitch - 0.05, palette, builder, rng),
            _ => books(&shelf, width - 2.0 * board, pitch - board - 0.02, palette, builder, rng),
        }
    }
    builder.solid(frame, [0.0, 0.0], [width, depth]);
}

/// A row of books, some of them leaning, with gaps.
fn books(frame: &Frame, width: f64, room: f64, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let mut x = rng.within(0.0, 0.04);
    // A series of equal books now and then.
    let mut series = 0usize;
    let (mut thick, mut height, mut kind) = (0.03, 0.24, 0);
    while x < width - 0.06 {
        if series == 0 {
            thick = rng.within(0.015, 0.05);
            height = room * rng.within(0.62, 0.97);
            kind = rng.below(palette.books.len());
            series = if rng.chance(0.25) { 3 + rng.below(5) } else { 1 };
        }
        series -= 1;
        if rng.chance(0.035) {
            x += rng.within(0.05, 0.2);
        }
        let lean = if rng.chance(0.12) { rng.within(0.02, 0.28) } else { 0.0 };
        let depth = rng.within(0.18, 0.24);
        if x + thick + lean * height > width {
            break;
        }
        let book = palette.books[kind];
        let seed = rng.seed();
        let material = builder.matt(Texture::Spine { color: book.color, ink: book.ink, height, seed });
        builder.sheared(
            frame.point(x, 0.02, 0.0),
            [
                frame.vector(thick, 0.0, 0.0),
                frame.vector(0.0, depth, 0.0),
                frame.vector(lean * height, 0.0, height * 0.995),
            ],
            material,
        );
        x += thick + lean * height + 0.001;
    }
}

/// Boxes of cardboard and plastic, side by side.
fn boxes(frame: &Frame, width: f64, depth: f64, room: f64, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let mut x = rng.within(0.01, 0.1);
    loop {
        let (wide, high) = (rng.within(0.16, 0.42), room * rng.within(0.45, 0.95));
        if x + wide > width - 0.01 {
            return;
        }
        let material = rng.pick([palette.cardboard, palette.cardboard, palette.white, palette.dark, palette.cushion]);
        let turned = frame.then(x, 0.02, 0.0, 0.0);
        builder.cuboid(&turned, [0.0, 0.0, 0.0], [wide, depth * rng.within(0.7, 0.98), high], material);
        x += wide + rng.within(0.01, 0.12);
    }
}

/// A cupboard with two doors and knobs, sometimes with boxes on top.
pub(crate) fn cupboard(
    frame: &Frame,
    width: f64,
    height: f64,
    palette: &Palette,
    builder: &mut Builder,
    rng: &mut Rng,
) {
    let depth = 0.42;
    builder.cuboid(frame, [0.0, 0.0, 0.06], [width, depth - 0.02, height], palette.wood_v);
    builder.cuboid(frame, [0.02, 0.02, 0.0], [width - 0.02, depth - 0.06, 0.06], palette.dark);
    let rows: &[[f64; 2]] = if height > 1.5 && rng.chance(0.5) { &[[0.0, 0.4], [0.4, 1.0]] } else { &[[0.0, 1.0]] };
    for [low, high] in rows {
        let (z0, z1) = (0.07 + (height - 0.08) * low, 0.07 + (height - 0.08) * high - 0.01);
        for (x0, x1, knob) in
            [(0.006, 0.5 * width - 0.003, 0.5 * width - 0.05), (0.5 * width + 0.003, width - 0.006, 0.5 * width + 0.03)]
        {
            builder.cuboid(frame, [x0, depth - 0.02, z0], [x1, depth, z1], palette.front);
            let middle = 0.5 * (z0 + z1);
            builder.cuboid(
                frame,
                [knob, depth, middle - 0.07],
                [knob + 0.02, depth + 0.025, middle + 0.07],
                palette.metal,
            );
        }
    }
    if height < 2.0 && rng.chance(0.6) {
        boxes(&frame.then(0.0, 0.03, height, 0.0), width, depth - 0.1, 0.3, palette, builder, rng);
    }
    builder.solid(frame, [0.0, 0.0], [width, depth + 0.02]);
}

/// A low board on legs, with drawers, and something on top.
pub(crate) fn sideboard(
    frame: &Frame,
    width: f64,
    height: f64,
    palette: &Palette,
    builder: &mut Builder,
    rng: &mut Rng,
) {
    let (depth, foot) = (0.43, 0.14);
    builder.cuboid(frame, [0.0, 0.0, foot], [width, depth - 0.02, height], palette.wood);
    for (x, y, out) in
        [(0.08, 0.06, -1.0), (width - 0.08, 0.06, 1.0), (0.08, depth - 0.08, -1.0), (width - 0.08, depth - 0.08, 1.0)]
    {
        builder.post(frame, [x + 0.03 * out, y, 0.0], [x, y, foot], 0.035, palette.dark);
    }
    let columns = (width / 0.5).round().max(2.0) as usize;
    for k in 0..columns {
        let (x0, x1) = (width * k as f64 / columns as f64 + 0.006, width * (k + 1) as f64 / columns as f64 - 0.006);
        let middle = foot + 0.55 * (height - foot);
        for (z0, z1) in [(foot + 0.01, middle - 0.005), (middle + 0.005, height - 0.02)] {
            builder.cuboid(frame, [x0, depth - 0.02, z0], [x1, depth, z1], palette.front);
            let (cx, cz) = (0.5 * (x0 + x1), 0.5 * (z0 + z1));
            builder.cuboid(frame, [cx - 0.06, depth, cz - 0.008], [cx + 0.06, depth + 0.02, cz + 0.008], palette.metal);
        }
    }
    let top = frame.then(0.0, 0.0, height, 0.0);
    if width > 1.2 && rng.chance(0.5) {
        decor::television(&top.then(0.5 * width, 0.2, 0.0, 0.0), (width - 0.1).min(1.2), palette, builder, rng);
    } else {
        decor::vase(&top.then(rng.within(0.2, 0.4), 0.2, 0.0, 0.0), rng.within(0.2, 0.35), palette, builder, rng);
        books(&top.then(0.55 * width, 0.0, 0.0, 0.0), 0.35 * width, 0.27, palette, builder, rng);
    }
    builder.solid(frame, [0.0, 0.0], [width, depth + 0.02]);
}

/// A metal rack with boxes and cans.
pub(crate) fn rack(frame: &Frame, width: f64, height: f64, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let depth = 0.4;
    for (x, y) in [(0.0, 0.0), (width - 0.03, 0.0), (0.0, depth - 0.03), (width - 0.03, depth - 0.03)] {
        builder.cuboid(frame, [x, y, 0.0], [x + 0.03, y + 0.03, height], palette.metal);
    }
    let rows = (height / 0.45).round().max(2.0) as usize;
    for row in 0..rows {
        let z = 0.1 + (height - 0.12) * row as f64 / (rows - 1).max(1) as f64;
        builder.cuboid(frame, [0.0, 0.0, z - 0.02], [width, depth, z], palette.metal);
        let shelf = frame.then(0.03, 0.0, z, 0.0);
        if rng.chance(0.75) {
            boxes(&shelf, width - 0.06, depth - 0.05, 0.36, palette, builder, rng);
        } else {
            for k in 0..(width / 0.16) as usize {
                let material = rng.pick([palette.white, palette.metal, palette.cushion, palette.pot]);
                let (radius, tall) = (rng.within(0.04, 0.07), rng.within(0.12, 0.28));
                let at = [0.08 + 0.16 * k as f64, rng.within(0.1, 0.3)];
                builder.column(&shelf, &Column { at, z: [0.0, tall], radius: [radius, radius], sides: 12 }, material);
            }
        }
    }
    // The crossed braces of its back.
    builder.post(frame, [0.02, 0.01, 0.2], [width - 0.02, 0.01, height - 0.2], 0.012, palette.metal);
    builder.post(frame, [width - 0.02, 0.02, 0.2], [0.02, 0.02, height - 0.2], 0.012, palette.metal);
    builder.solid(frame, [0.0, 0.0], [width, depth]);
}
