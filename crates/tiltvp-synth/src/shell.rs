//! The shell of a room: floor, ceiling with its lights, walls with their openings, skirting.

use nalgebra::Vector3;

use crate::builder::{Builder, Column, Material, MaterialId, Patch};
use crate::frame::Frame;
use crate::openings::{Trims, curtain, door, door_leaf, window};
use crate::options::{RoomKind, WallPattern};
use crate::plan::{Filling, Opening, Plan, Wall};
use crate::rng::Rng;
use crate::segment::Segment;
use crate::texture::{Motif, Texture, rgb, scale};

/// Thickness and height of the boards at the foot of a room's walls, metres.
const SKIRTING_M: [f64; 2] = [0.015, 0.09];

/// Builds the shell of a plan.
pub(crate) fn build(plan: &Plan, builder: &mut Builder, rng: &mut Rng) {
    floor(plan, builder, rng);
    ceiling(plan, builder, rng);
    let tone = rng.within(0.85, 1.0);
    let plain = wall_texture(plan.kind, false, tone, rng);
    let accent = wall_texture(plan.kind, true, tone, rng);
    let (plain, accent) = repeated_texture(plan.wall_pattern).map_or((plain, accent), |same| (same, same));
    let textures = [plain, accent];
    let (plain, accent) = (builder.matt(plain), builder.matt(accent));
    let chosen = rng.below(plan.walls.len());
    let trims = Trims {
        trim: match rng.below(3) {
            0 => builder.paint(110, 72, 46),
            1 => builder.paint(150, 150, 154),
            _ => builder.paint(238, 236, 230),
        },
        door: door_leaf(builder, rng),
        metal: builder.paint(70, 72, 76),
        radiator: builder.paint(228, 226, 220),
        glass: builder.material(Material::Glass),
        curtain: (plan.kind == RoomKind::LivingRoom || (plan.kind == RoomKind::UnderTable && rng.chance(0.6)))
            .then(|| curtain(builder, rng)),
        bars: [1 + rng.below(3), rng.below(3)],
    };
    for (k, wall) in plan.walls.iter().enumerate() {
        let own = if k == chosen { accent } else { plain };
        panels(wall, &wall.openings, [0.0, plan.height], own, builder);
        builder.edge(wall.frame.origin, plan.height);
        paint_edges(wall, plan.height, &textures[usize::from(k == chosen)], builder);
        if plan.wall_pattern == WallPattern::Panels {
            battens(wall, plan.height, trims.trim, builder);
        }
        skirting(wall, SKIRTING_M, trims.trim, builder);
        for opening in &wall.openings {
            match opening.filling {
                Filling::Door => door(&wall.frame, opening, own, &trims, builder),
                Filling::Window => window(&wall.frame, opening, own, &trims, builder),
            }
        }
    }
}

/// Builds a shell without colours: grey floor, white walls, grey doors, tiled ceiling.
pub(crate) fn build_plain(plan: &Plan, builder: &mut Builder) {
    lay(Texture::Paint { color: rgb(128, 128, 126), mottle: 0.12, seed: 1 }, plan, builder);
    ceiling(plan, builder, &mut Rng::new(0, 0));
    let wall = builder.matt(Texture::Paint { color: rgb(216, 216, 212), mottle: 0.05, seed: 2 });
    let trims = Trims {
        trim: builder.paint(150, 150, 154),
        door: builder.paint(176, 178, 180),
        metal: builder.paint(70, 72, 76),
        radiator: builder.paint(228, 226, 220),
        glass: builder.material(Material::Glass),
        curtain: None,
        bars: [1, 1],
    };
    for own in &plan.walls {
        panels(own, &own.openings, [0.0, plan.height], wall, builder);
        builder.edge(own.frame.origin, plan.height);
        skirting(own, SKIRTING_M, trims.trim, builder);
        for opening in &own.openings {
            door(&own.frame, opening, wall, &trims, builder);
        }
    }
}

/// The texture that all walls share, if they do.
fn repeated_texture(pattern: WallPattern) -> Option<Texture> {
    let (light, dark) = (rgb(222, 214, 196), rgb(150, 132, 104));
    match pattern {
        WallPattern::Drawn => None,
        WallPattern::Stripes => {
            Some(Texture::Wallpaper { base: light, ink: dark, motif: Motif::Stripes, period: 0.3, seed: 1 })
        }
        WallPattern::Panels => Some(Texture::Paint { color: light, mottle: 0.0, seed: 1 }),
        WallPattern::Tiles => {
            Some(Texture::Tiles { color: light, joint: dark, size: [0.4, 0.3], gap: 0.016, variation: 0.0, seed: 1 })
        }
    }
}

/// The heights at which a wall is there, `x` metres along it.
fn solid_heights(wall: &Wall, x: f64, height: f64) -> [[f64; 2]; 2] {
    let hole = wall.openings.iter().find(|o| o.along[0] < x && x < o.along[1]);
    hole.map_or([[0.0, height], [height, height]], |o| [[0.0, o.z[0]], [o.z[1], height]])
}

/// The true upright edges of a wall's texture.
fn paint_edges(wall: &Wall, height: f64, texture: &Texture, builder: &mut Builder) {
    // Texture coordinates grow to the right, seen from the front, and the wall's x to the left.
    for x in texture.upright_edges(-wall.length, 0.0).into_iter().map(|u| -u) {
        for [low, high] in solid_heights(wall, x, height) {
            if high - low > 0.1 {
                builder
                    .painted
                    .push(Segment { bottom: wall.frame.point(x, 0.0, low), top: wall.frame.point(x, 0.0, high) });
            }
        }
    }
}

/// Upright battens, equally spaced, wherever no opening is.
fn battens(wall: &Wall, height: f64, material: MaterialId, builder: &mut Builder) {
    for k in 1..(wall.length / 0.45) as usize {
        let x = 0.45 * k as f64;
        if wall.openings.iter().all(|o| x + 0.1 < o.along[0] || x - 0.06 > o.along[1]) {
            builder.cuboid(&wall.frame, [x, 0.0, 0.09], [x + 0.045, 0.014, height], material);
        }
    }
}

fn floor(plan: &Plan, builder: &mut Builder, rng: &mut Rng) {
    let seed = rng.seed();
    let planks = |light, dark| Texture::Planks { light, dark, width: 0.14, length: 1.3, seed };
    let carpet = |color, speckle| Texture::Carpet { color, speckle, seed };
    let tiles =
        |color, joint, size| Texture::Tiles { color, joint, size: [size, size], gap: 0.008, variation: 0.12, seed };
    let texture = match plan.kind {
        RoomKind::Office => rng.pick([
            carpet(rgb(84, 92, 104), rgb(40, 46, 56)),
            carpet(rgb(120, 108, 96), rgb(66, 58, 52)),
            planks(rgb(190, 160, 124), rgb(150, 116, 80)),
        ]),
        RoomKind::Corridor | RoomKind::Narrow => rng.pick([
            tiles(rgb(176, 170, 160), rgb(110, 106, 100), 0.4),
            tiles(rgb(140, 84, 64), rgb(180, 170, 160), 0.3),
            carpet(rgb(70, 78, 92), rgb(36, 40, 50)),
        ]),
        _ => rng.pick([
            planks(rgb(184, 134, 84), rgb(124, 80, 46)),
            planks(rgb(120, 84, 56), rgb(76, 48, 30)),
            tiles(rgb(206, 196, 178), rgb(140, 132, 120), 0.45),
        ]),
    };
    lay(texture, plan, builder);
}

/// Lays a floor of one texture.
pub(crate) fn lay(texture: Texture, plan: &Plan, builder: &mut Builder) {
    let material = builder.material(if plan.floor_gloss > 0.0 {
        Material::Polished(texture, plan.floor_gloss)
    } else {
        Material::Matt(texture)
    });
    let world = Frame::new(0.0, 0.0, 0.0);
    let (_, end) = plan.bounds();
    let patch = Patch {
        origin: world.origin,
        du: Vector3::x() * end.x,
        dv: Vector3::y() * end.y,
        triangle: false,
        material,
        uv: [0.0; 2],
    };
    let rectangles: Vec<_> = plan.floors.iter().map(|[x0, y0, x1, y1]| [[*x0, *y0], [*x1, *y1]]).collect();
    builder.perforated(patch, &rectangles);
}

fn ceiling(plan: &Plan, builder: &mut Builder, rng: &mut Rng) {
    let seed = rng.seed();
    let tiled = matches!(plan.kind, RoomKind::Office | RoomKind::Corridor);
    let material = builder.matt(if tiled {
        Texture::CeilingTiles { color: rgb(232, 230, 222), size: 0.6, seed }
    } else {
        Texture::Paint { color: rgb(236, 232, 224), mottle: 0.05, seed }
    });
    let lamp = builder.material(Material::Lamp(scale([1.0, 0.95, 0.85], plan.lamps)));
    let rim = builder.paint(120, 120, 124);
    let (beam_wood, pitch, beams) = (rng.chance(0.5), rng.within(0.7, 1.1), rng.chance(0.6) && !tiled);
    let beam = if beam_wood { builder.paint(96, 64, 40) } else { builder.paint(216, 208, 194) };
    let world = Frame::new(0.0, 0.0, 0.0);
    let h = plan.height;
    let (_, end) = plan.bounds();
    let patch = Patch {
        origin: world.point(0.0, 0.0, h),
        du: Vector3::y() * end.y,
        dv: Vector3::x() * end.x,
        triangle: false,
        material,
        uv: [0.0; 2],
    };
    let rectangles: Vec<_> = plan.floors.iter().map(|[x0, y0, x1, y1]| [[*y0, *x0], [*y1, *x1]]).collect();
    builder.perforated(patch, &rectangles);
    for [x0, y0, x1, y1] in plan.floors.iter().copied() {
        let (nx, ny) = (((x1 - x0) / 1.8).round().max(1.0) as usize, ((y1 - y0) / 2.0).round().max(1.0) as usize);
        for k in 0..nx * ny {
            let mut x = x0 + (x1 - x0) * ((k % nx) as f64 + 0.5) / nx as f64;
            let mut y = y0 + (y1 - y0) * ((k / nx) as f64 + 0.5) / ny as f64;
            if tiled {
                // On the tiles' own grid.
                x = (x / 0.6).floor() * 0.6 + 0.3;
                y = if y1 - y0 > 2.5 { (y / 0.6).floor() * 0.6 + 0.3 } else { y };
                builder.cuboid(&world, [x - 0.3, y - 0.3, h - 0.02], [x + 0.3, y + 0.3, h - 0.004], rim);
                builder.pane(
                    &world,
                    [[x - 0.27, y - 0.27, h - 0.025], [x - 0.27, y + 0.27, h - 0.025], [x + 0.27, y - 0.27, h - 0.025]],
                    [0.0; 2],
                    lamp,
                );
            } else if plan.kind == RoomKind::Narrow {
                builder.cuboid(&world, [x - 0.6, y - 0.06, h - 0.06], [x + 0.6, y + 0.06, h], rim);
                builder.pane(
                    &world,
                    [[x - 0.58, y - 0.05, h - 0.065], [x - 0.58, y + 0.05, h - 0.065], [x + 0.58, y - 0.05, h - 0.065]],
                    [0.0; 2],
                    lamp,
                );
            } else if k == nx * ny / 2 || nx * ny < 3 {
                pendant(&world.then(x, y, h, 0.0), lamp, rim, builder);
            }
        }
        if beams {
            let count = ((x1 - x0) / pitch) as usize;
            for k in 0..count {
                let x = x0 + (x1 - x0) * (k as f64 + 0.5) / count as f64;
                builder.cuboid(&world, [x - 0.07, y0, h - 0.16], [x + 0.07, y1, h], beam);
            }
        }
    }
}

/// A lantern on a cord below the ceiling.
fn pendant(frame: &Frame, lamp: MaterialId, rim: MaterialId, builder: &mut Builder) {
    builder.column(frame, &Column { at: [0.0, 0.0], z: [-0.45, 0.0], radius: [0.006, 0.006], sides: 4 }, rim);
    builder.column(frame, &Column { at: [0.0, 0.0], z: [-0.50, -0.45], radius: [0.14, 0.05], sides: 12 }, rim);
    builder.column(frame, &Column { at: [0.0, 0.0], z: [-0.64, -0.50], radius: [0.15, 0.14], sides: 8 }, lamp);
}

fn wall_texture(kind: RoomKind, accent: bool, tone: f64, rng: &mut Rng) -> Texture {
    let seed = rng.seed();
    let paint = |color| Texture::Paint { color: scale(color, tone), mottle: 0.10, seed };
    let home = matches!(kind, RoomKind::LivingRoom | RoomKind::UnderTable | RoomKind::LShaped);
    let motif = rng.pick([Motif::Stripes, Motif::Diamonds, Motif::Flowers]);
    let (base, ink) = rng.pick([
        (rgb(226, 214, 188), rgb(178, 150, 110)),
        (rgb(196, 208, 200), rgb(130, 156, 146)),
        (rgb(214, 196, 190), rgb(170, 120, 112)),
        (rgb(150, 160, 176), rgb(196, 204, 214)),
    ]);
    if home && rng.chance(if accent { 0.8 } else { 0.45 }) {
        let period = rng.within(0.16, 0.34);
        return Texture::Wallpaper { base, ink, motif, period, seed };
    }
    if accent {
        return rng.pick([
            Texture::Brick { color: rgb(164, 84, 62), joint: rgb(190, 182, 170), seed },
            paint(rgb(120, 140, 160)),
            paint(rgb(176, 120, 84)),
            paint(rgb(130, 150, 124)),
        ]);
    }
    rng.pick([
        paint(rgb(232, 228, 218)),
        paint(rgb(222, 214, 196)),
        paint(rgb(208, 216, 218)),
        paint(rgb(214, 206, 200)),
    ])
}

/// The wall itself between two heights, around its openings there, which are not above each other.
pub(crate) fn panels(
    wall: &Wall,
    openings: &[Opening],
    [bottom, top]: [f64; 2],
    material: MaterialId,
    builder: &mut Builder,
) {
    let mut cuts = vec![0.0, wall.length];
    for opening in openings {
        cuts.extend(opening.along);
    }
    cuts.sort_by(f64::total_cmp);
    let mut rectangles = Vec::new();
    for pair in cuts.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let hole = openings.iter().find(|o| o.along[0] < 0.5 * (from + to) && o.along[1] > 0.5 * (from + to));
        let parts = hole.map_or([[bottom, top], [bottom, bottom]], |o| [[bottom, o.z[0]], [o.z[1], top]]);
        for [low, high] in parts {
            if high - low > 1e-6 && to - from > 1e-6 {
                // Seen from the front, the wall's x runs to the left.
                rectangles.push([[wall.length - to, low - bottom], [wall.length - from, high - bottom]]);
            }
        }
    }
    let patch = Patch {
        origin: wall.frame.point(wall.length, 0.0, bottom),
        du: wall.frame.vector(-wall.length, 0.0, 0.0),
        dv: Vector3::z() * (top - bottom),
        triangle: false,
        material,
        uv: [-wall.length, bottom],
    };
    builder.perforated(patch, &rectangles);
}

/// Boards of a thickness and a height along the foot of a wall, but for its doors with their casings.
pub(crate) fn skirting(wall: &Wall, [thickness, height]: [f64; 2], material: MaterialId, builder: &mut Builder) {
    let mut from = 0.0;
    let mut doors: Vec<[f64; 2]> =
        wall.openings.iter().filter(|o| o.filling == Filling::Door).map(|o| o.along).collect();
    doors.sort_by(|a, b| a[0].total_cmp(&b[0]));
    doors.push([wall.length + 0.07, wall.length]);
    for [start, end] in doors {
        if start - 0.07 > from {
            builder.cuboid(&wall.frame, [from, 0.0, 0.0], [start - 0.07, thickness, height], material);
        }
        from = end + 0.07;
    }
}
