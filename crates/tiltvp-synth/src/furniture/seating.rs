//! Chairs with legs that stand out, office chairs, stools and sofas.

use super::palette::{ChairStyle, Palette};
use crate::builder::{Builder, Column};
use crate::frame::Frame;
use crate::rng::Rng;

/// A four-legged chair around the frame's origin, its back at `-y`.
pub(crate) fn chair(frame: &Frame, style: ChairStyle, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let seat = 0.45;
    let (half, wood) = (0.2, palette.other_wood);
    builder.cuboid(frame, [-half, -half, seat - 0.035], [half, half, seat], wood);
    if rng.chance(0.4) {
        builder.cuboid(frame, [-0.18, -0.17, seat], [0.18, 0.18, seat + 0.03], palette.cushion);
    }
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let (top, foot) = (half - 0.03, half - 0.03 + style.splay);
        builder.post(frame, [x * foot, y * foot, 0.0], [x * top, y * top, seat - 0.03], 0.034, wood);
    }
    for y in [-0.16, 0.16] {
        let out = 0.5 * style.splay;
        builder.post(frame, [-0.17 - out, y, 0.2], [-0.16 - out, y, 0.225], 0.02, wood);
        builder.cuboid(frame, [-0.17 - out, y - 0.01, 0.2], [0.17 + out, y + 0.01, 0.225], wood);
    }
    let (low, high) = (seat, 0.88);
    let back = |z: f64| -half + 0.02 - style.lean * (z - low) / (high - low);
    for x in [-0.17, 0.17] {
        builder.post(frame, [x, back(low), low], [x, back(high), high], 0.032, wood);
    }
    let rail = |z: f64, height: f64, builder: &mut Builder| {
        let y = back(z);
        builder.cuboid(frame, [-0.155, y - 0.012, z], [0.155, y + 0.012, z + height], wood);
    };
    rail(high - 0.09, 0.08, builder);
    if style.slats == 0 {
        rail(high - 0.22, 0.09, builder);
    }
    for k in 0..style.slats {
        let x = -0.155 + 0.31 * (k as f64 + 0.5) / style.slats as f64;
        builder.post(frame, [x, back(low), low], [x, back(high - 0.09), high - 0.09], 0.018, wood);
    }
    builder.solid(frame, [-0.26, -0.3], [0.26, 0.26]);
}

/// A swivel chair on a star of five feet, its back at `-y`.
pub(crate) fn office_chair(frame: &Frame, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    for k in 0..5 {
        let (s, c) = (std::f64::consts::TAU * f64::from(k) / 5.0 + 0.3).sin_cos();
        builder.post(frame, [0.3 * c, 0.3 * s, 0.055], [0.02 * c, 0.02 * s, 0.12], 0.035, palette.dark);
        builder.column(
            frame,
            &Column { at: [0.3 * c, 0.3 * s], z: [0.0, 0.055], radius: [0.025, 0.025], sides: 8 },
            palette.dark,
        );
    }
    builder.column(frame, &Column { at: [0.0, 0.0], z: [0.1, 0.42], radius: [0.028, 0.022], sides: 10 }, palette.metal);
    let seat = rng.within(0.44, 0.5);
    builder.cuboid(frame, [-0.24, -0.23, seat - 0.05], [0.24, 0.25, seat + 0.03], palette.fabric);
    let lean = rng.within(0.03, 0.1);
    builder.post(frame, [0.0, -0.2, seat - 0.04], [0.0, -0.27, seat + 0.2], 0.04, palette.dark);
    let (low, up) = (frame.point(-0.22, -0.28, seat + 0.12), frame.vector(0.0, -lean, 0.48));
    builder.sheared(low, [frame.vector(0.44, 0.0, 0.0), frame.vector(0.0, 0.05, 0.0), up], palette.fabric);
    for x in [-0.27, 0.24] {
        builder.cuboid(frame, [x, -0.1, seat + 0.19], [x + 0.03, 0.12, seat + 0.22], palette.dark);
        builder.post(frame, [x + 0.015, -0.05, seat], [x + 0.015, 0.0, seat + 0.19], 0.025, palette.dark);
    }
    builder.solid(frame, [-0.32, -0.36], [0.32, 0.32]);
}

/// A sofa of the given width, its back against `y = 0`.
pub(crate) fn sofa(frame: &Frame, width: f64, palette: &Palette, builder: &mut Builder, rng: &mut Rng) {
    let (fabric, depth) = (palette.fabric, 0.86);
    builder.cuboid(frame, [0.0, 0.06, 0.12], [width, depth - 0.02, 0.32], fabric);
    for x in [0.0, width - 0.17] {
        builder.cuboid(frame, [x, 0.04, 0.1], [x + 0.17, depth, 0.6], fabric);
    }
    let (base, up) = (frame.point(0.16, 0.06, 0.3), frame.vector(0.0, -0.05, 0.54));
    builder.sheared(base, [frame.vector(width - 0.32, 0.0, 0.0), frame.vector(0.0, 0.2, 0.0), up], fabric);
    let seats = if width > 1.9 { 3 } else { 2 };
    let each = (width - 0.35) / f64::from(seats);
    for k in 0..seats {
        let x = 0.175 + each * f64::from(k);
        builder.cuboid(frame, [x + 0.01, 0.22, 0.32], [x + each - 0.01, depth - 0.02, 0.46], fabric);
        if rng.chance(0.6) {
            let pillow = frame.then(x + 0.5 * each, 0.36, 0.46, rng.within(-0.4, 0.4));
            let (base, up) = (pillow.point(-0.2, -0.07, 0.0), pillow.vector(0.02, -0.1, 0.36));
            builder.sheared(base, [pillow.vector(0.4, 0.0, 0.0), pillow.vector(0.0, 0.12, 0.0), up], palette.cushion);
        }
    }
    for (x, y) in [(0.06, 0.1), (width - 0.06, 0.1), (0.06, depth - 0.08), (width - 0.06, depth - 0.08)] {
        builder.post(frame, [x, y, 0.0], [x, y, 0.12], 0.05, palette.dark);
    }
    builder.solid(frame, [0.0, 0.0], [width, depth]);
}
