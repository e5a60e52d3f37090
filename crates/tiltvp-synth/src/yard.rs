//! A yard between the fronts of houses and garden walls, under the open sky.

use nalgebra::Vector3;

use crate::builder::{Builder, Column, Footprint, Material, MaterialId};
use crate::corner::{Corner, CornerKind};
use crate::frame::Frame;
use crate::openings::{Trims, casement, door, door_leaf};
use crate::plan::{Filling, Opening, Plan, Wall};
use crate::rng::Rng;
use crate::shell::{lay, panels, skirting};
use crate::texture::{Texture, rgb};

/// How far behind the fronts ridges and the rim of the sky are, metres.
const RIDGE_M: f64 = 5.0;
const RIM_M: f64 = 12.0;

/// How far eaves are before the front, and how thick they are, metres.
const EAVES_M: [f64; 2] = [0.35, 0.12];

/// Least width of a window with the wall beside it, metres.
const BAY_M: f64 = 2.0;

/// Things in a yard that is as full as can be.
const THINGS: f64 = 9.0;

/// What all houses of a yard have in common.
struct Style {
    storeys: usize,
    storey_m: f64,
    /// Rise of the roofs over their depth.
    slope: f64,
    roof: MaterialId,
    eaves: MaterialId,
    lamp: MaterialId,
}

impl Style {
    fn draw(builder: &mut Builder, rng: &mut Rng) -> Self {
        let color = rng.pick([rgb(150, 74, 52), rgb(92, 94, 100), rgb(120, 84, 66)]);
        let seed = rng.seed();
        let tiles =
            Texture::Tiles { color, joint: rgb(50, 46, 44), size: [0.3, 0.25], gap: 0.02, variation: 0.2, seed };
        Self {
            storeys: 1 + rng.below(3),
            storey_m: rng.within(2.7, 3.2),
            slope: rng.within(0.5, 1.0),
            roof: builder.matt(tiles),
            eaves: if rng.chance(0.5) { builder.paint(92, 66, 48) } else { builder.paint(214, 210, 202) },
            lamp: builder.material(Material::Lamp([20.0, 18.0, 14.0])),
        }
    }

    /// Height of the eaves, metres.
    fn eaves_m(&self) -> f64 {
        self.storeys as f64 * self.storey_m
    }
}

/// Builds a yard on a plan, whose walls get their openings. The builder's first corners are those at the feet of the walls.
pub(crate) fn build(plan: &mut Plan, clutter: f64, builder: &mut Builder, rng: &mut Rng) {
    lay(paving(rng), plan, builder);
    sky(plan, builder);
    let style = Style::draw(builder, rng);
    let is_house = [true, rng.chance(0.6), rng.chance(0.8), rng.chance(0.6)];
    let tops = is_house.map(|house| if house { style.eaves_m() } else { rng.within(1.7, 2.4) });
    builder.corners.extend((0..4).map(|k| foot(&plan.walls, &tops, k)));
    for (k, wall) in plan.walls.iter_mut().enumerate() {
        let [before, after] = [(k + 3) % 4, (k + 1) % 4];
        builder.edge(wall.frame.origin, tops[k].min(tops[before]));
        if is_house[k] {
            // Beyond its ends a roof goes on where that of the next house meets it in a valley.
            let beyond = [before, after].map(|next| if is_house[next] { RIDGE_M } else { 0.0 });
            house(wall, &style, beyond, builder, rng);
        } else {
            garden_wall(wall, tops[k], builder, rng);
        }
    }
    furnish(plan, clutter, builder, rng);
}

/// What sheds light from above and from over the roofs.
fn sky(plan: &Plan, builder: &mut Builder) {
    let glass = builder.material(Material::Glass);
    let world = Frame::new(0.0, 0.0, 0.0);
    let (low, high) = plan.bounds();
    let ([x0, x1], [y0, y1], top) = ([low.x - RIM_M, high.x + RIM_M], [low.y - RIM_M, high.y + RIM_M], plan.height);
    builder.pane(&world, [[x0, y0, top], [x0, y1, top], [x1, y0, top]], [0.0; 2], glass);
    for [from, to] in [[[x0, y0], [x1, y0]], [[x1, y0], [x1, y1]], [[x1, y1], [x0, y1]], [[x0, y1], [x0, y0]]] {
        let corners = [[to[0], to[1], 0.0], [from[0], from[1], 0.0], [to[0], to[1], top]];
        builder.pane(&world, corners, [0.0; 2], glass);
    }
}

fn paving(rng: &mut Rng) -> Texture {
    let seed = rng.seed();
    rng.pick([
        Texture::Tiles {
            color: rgb(150, 148, 142),
            joint: rgb(96, 94, 88),
            size: [0.5; 2],
            gap: 0.01,
            variation: 0.12,
            seed,
        },
        Texture::Brick { color: rgb(140, 96, 80), joint: rgb(110, 104, 96), seed },
        Texture::Carpet { color: rgb(142, 134, 122), speckle: rgb(90, 84, 76), seed },
    ])
}

/// The corner at the foot of wall `k` and the one before it.
fn foot(walls: &[Wall], tops: &[f64], k: usize) -> Corner {
    let (wall, before) = (&walls[k], &walls[(k + 3) % 4]);
    let level = [wall.frame.vector(wall.length, 0.0, 0.0), before.frame.vector(-before.length, 0.0, 0.0)];
    let top = tops[k].min(tops[(k + 3) % 4]);
    Corner::new(wall.frame.origin, Vector3::z() * top, level, CornerKind::Hollow)
}

fn garden_wall(wall: &Wall, top: f64, builder: &mut Builder, rng: &mut Rng) {
    let material = builder.matt(front_texture(rng));
    panels(wall, &[], [0.0, top], material, builder);
    let coping = builder.paint(170, 166, 158);
    builder.cuboid(&wall.frame, [0.0, -0.3, top], [wall.length, 0.05, top + 0.08], coping);
}

fn front_texture(rng: &mut Rng) -> Texture {
    let seed = rng.seed();
    let color = rng.pick([rgb(226, 218, 200), rgb(208, 176, 130), rgb(196, 204, 206), rgb(214, 160, 140)]);
    if rng.chance(0.4) {
        let color = rng.pick([rgb(156, 80, 60), rgb(180, 150, 110), rgb(120, 70, 60)]);
        Texture::Brick { color, joint: rgb(190, 182, 170), seed }
    } else {
        Texture::Paint { color, mottle: 0.12, seed }
    }
}

/// The front of a house with its roof; `beyond` is how far the roof goes on behind its ends.
fn house(wall: &mut Wall, style: &Style, beyond: [f64; 2], builder: &mut Builder, rng: &mut Rng) {
    let material = builder.matt(front_texture(rng));
    let trims = Trims {
        trim: match rng.below(3) {
            0 => builder.paint(104, 74, 52),
            1 => builder.paint(120, 122, 126),
            _ => builder.paint(236, 234, 228),
        },
        door: door_leaf(builder, rng),
        metal: builder.paint(62, 64, 68),
        radiator: builder.paint(200, 198, 190),
        // Rooms are darker than the day.
        glass: builder.paint(44, 50, 58),
        curtain: None,
        bars: [1 + rng.below(2), rng.below(2)],
    };
    let storeys = pierce(wall, style, rng);
    let shutters = rng.chance(0.4).then(|| door_leaf(builder, rng));
    for (k, openings) in storeys.iter().enumerate() {
        let band = [k, k + 1].map(|storey| storey as f64 * style.storey_m);
        panels(wall, openings, band, material, builder);
        for opening in openings {
            match opening.filling {
                Filling::Door => entrance(&wall.frame, opening, material, &trims, style.lamp, builder),
                Filling::Window => window(&wall.frame, opening, material, &trims, shutters, builder),
            }
        }
    }
    wall.openings = storeys.into_iter().flatten().collect();
    relief(wall, style, &trims, builder, rng);
    roof(wall, style, beyond, &trims, builder, rng);
}

/// The openings of each storey, above each other: one door, and windows.
fn pierce(wall: &Wall, style: &Style, rng: &mut Rng) -> Vec<Vec<Opening>> {
    let bays = ((wall.length / (BAY_M * rng.within(1.0, 1.5))) as usize).max(1);
    let bay = wall.length / bays as f64;
    let (entrance, width, sill, height) =
        (rng.below(bays), rng.within(0.8, 1.2), rng.within(0.75, 1.0), rng.within(1.1, 1.5));
    let opening = |storey: usize, k: usize| {
        let is_door = storey == 0 && k == entrance;
        let half = if is_door { 0.48 } else { 0.5 * width };
        let (middle, floor) = ((k as f64 + 0.5) * bay, storey as f64 * style.storey_m);
        Opening {
            filling: if is_door { Filling::Door } else { Filling::Window },
            along: [middle - half, middle + half],
            z: if is_door { [0.0, 2.1] } else { [floor + sill, floor + sill + height] },
        }
    };
    (0..style.storeys).map(|storey| (0..bays).map(|k| opening(storey, k)).collect()).collect()
}

fn entrance(
    frame: &Frame,
    opening: &Opening,
    wall: MaterialId,
    trims: &Trims,
    lamp: MaterialId,
    builder: &mut Builder,
) {
    door(frame, opening, wall, trims, builder);
    let ([x0, x1], top) = (opening.along, opening.z[1]);
    builder.cuboid(frame, [x0 - 0.3, 0.0, top + 0.25], [x1 + 0.3, 0.7, top + 0.33], trims.metal);
    builder.cuboid(frame, [x1 + 0.2, 0.0, 1.75], [x1 + 0.32, 0.06, 1.95], trims.metal);
    builder.pane(frame, [[x1 + 0.32, 0.065, 1.75], [x1 + 0.2, 0.065, 1.75], [x1 + 0.32, 0.065, 1.95]], [0.0; 2], lamp);
}

fn window(
    frame: &Frame,
    opening: &Opening,
    wall: MaterialId,
    trims: &Trims,
    shutters: Option<MaterialId>,
    builder: &mut Builder,
) {
    casement(frame, opening, wall, trims, builder);
    let ([x0, x1], [z0, z1]) = (opening.along, opening.z);
    builder.cuboid(frame, [x0 - 0.08, -0.1, z0 - 0.06], [x1 + 0.08, 0.08, z0], trims.trim);
    if let Some(material) = shutters {
        let half = 0.5 * (x1 - x0);
        for [from, to] in [[x0 - half, x0 - 0.02], [x1 + 0.02, x1 + half]] {
            builder.cuboid(frame, [from, 0.0, z0], [to, 0.04, z1], material);
        }
    }
}

/// What stands out of a front: plinth, courses between storeys, pilasters or timber, a balcony, a downpipe.
fn relief(wall: &Wall, style: &Style, trims: &Trims, builder: &mut Builder, rng: &mut Rng) {
    let (frame, length, top) = (&wall.frame, wall.length, style.eaves_m());
    let stone = builder.paint(164, 158, 148);
    if rng.chance(0.6) {
        skirting(wall, [0.04, 0.45], stone, builder);
    }
    if rng.chance(0.5) {
        for storey in 1..style.storeys {
            let z = storey as f64 * style.storey_m;
            builder.cuboid(frame, [0.0, 0.0, z - 0.07], [length, 0.06, z + 0.05], stone);
        }
    }
    match rng.below(4) {
        0 => {
            for x in [0.0, length - 0.4] {
                builder.cuboid(frame, [x, 0.0, 0.0], [x + 0.4, 0.05, top], stone);
            }
        }
        1 => timber(wall, style, builder),
        _ => {}
    }
    let upper: Vec<Opening> = wall.openings.iter().filter(|o| o.z[0] > style.storey_m).copied().collect();
    if let Some(opening) = upper.get(rng.below(2 * upper.len())) {
        balcony(frame, opening, stone, trims.metal, builder);
    }
    builder.column(frame, &Column { at: [0.2, 0.1], z: [0.0, top], radius: [0.05, 0.05], sides: 8 }, trims.metal);
}

/// Beams of a half-timbered upper part, of which the braces lean.
fn timber(wall: &Wall, style: &Style, builder: &mut Builder) {
    let (wood, thickness) = (builder.paint(70, 48, 36), 0.12);
    let bays = wall.openings.len() / style.storeys;
    let bay = wall.length / bays as f64;
    for storey in 1..style.storeys {
        let [low, high] = [storey, storey + 1].map(|k| k as f64 * style.storey_m);
        for k in 0..=bays {
            let x = (k as f64 * bay).clamp(0.07, wall.length - 0.07);
            builder.post(&wall.frame, [x, 0.0, low], [x, 0.0, high], thickness, wood);
        }
        for (k, towards) in [(0, 1.0), (bays, -1.0)] {
            let x = k as f64 * bay + 0.1 * towards;
            builder.post(&wall.frame, [x, 0.0, high], [x + 0.35 * bay * towards, 0.0, low], thickness, wood);
        }
    }
}

fn balcony(frame: &Frame, opening: &Opening, slab: MaterialId, metal: MaterialId, builder: &mut Builder) {
    let ([x0, x1], floor) = ([opening.along[0] - 0.5, opening.along[1] + 0.5], opening.z[0] - 0.2);
    let (depth, rail) = (1.0, floor + 0.95);
    builder.cuboid(frame, [x0, 0.0, floor - 0.15], [x1, depth, floor], slab);
    builder.cuboid(frame, [x0, depth - 0.05, rail - 0.04], [x1, depth, rail], metal);
    let bars = ((x1 - x0) / 0.12) as usize;
    for k in 0..=bars {
        let x = x0 + (x1 - x0 - 0.02) * k as f64 / bars as f64;
        builder.cuboid(frame, [x, depth - 0.035, floor], [x + 0.02, depth - 0.015, rail - 0.04], metal);
    }
}

fn roof(wall: &Wall, style: &Style, beyond: [f64; 2], trims: &Trims, builder: &mut Builder, rng: &mut Rng) {
    let (frame, length, eaves) = (&wall.frame, wall.length, style.eaves_m());
    let [out, thickness] = EAVES_M;
    builder.cuboid(frame, [0.0, 0.0, eaves - thickness], [length, out, eaves], style.eaves);
    let rise = (RIDGE_M + out) * style.slope;
    let [x0, x1] = [-beyond[0], length + beyond[1]];
    let corners = [[x1, out, eaves], [x0, out, eaves], [x1, -RIDGE_M, eaves + rise]];
    builder.pane(frame, corners, [0.0; 2], style.roof);
    let height = |y: f64| eaves + (out - y) * style.slope;
    for _ in 0..rng.below(3) {
        let x = rng.within(1.0, length - 1.0);
        let (y, low) = (-1.0, height(-1.0));
        builder.cuboid(frame, [x - 0.6, -3.5, low - 0.3], [x + 0.6, y, low + 1.2], trims.trim);
        let pane = [[x + 0.45, y + 0.01, low + 0.1], [x - 0.45, y + 0.01, low + 0.1], [x + 0.45, y + 0.01, low + 1.0]];
        builder.pane(frame, pane, [0.0; 2], trims.glass);
    }
    if rng.chance(0.5) {
        let x = rng.within(0.5, length - 0.5);
        builder.cuboid(frame, [x - 0.3, -3.0, eaves], [x + 0.3, -2.4, height(-3.0) + 1.2], style.roof);
    }
}

/// Stands planters, bins, benches and trees in the yard, half of them askew.
fn furnish(plan: &Plan, clutter: f64, builder: &mut Builder, rng: &mut Rng) {
    let wood = builder.paint(128, 96, 68);
    let (grey, green, leaves) = (builder.paint(96, 100, 104), builder.paint(52, 84, 60), builder.paint(70, 100, 56));
    let (_, end) = plan.bounds();
    for _ in 0..(THINGS * clutter).round() as usize {
        let yaw = if rng.chance(0.5) { 0.0 } else { rng.within(0.0, std::f64::consts::FRAC_PI_2) };
        let frame = Frame::new(rng.within(1.0, end.x - 1.0), rng.within(1.0, end.y - 1.0), yaw);
        let (half, kind) = (rng.within(0.3, 0.7), rng.below(4));
        let low_high = ([-half, -0.3], [half, 0.3]);
        let footprint = Footprint::new(&frame, low_high.0, low_high.1);
        if builder.solids.iter().any(|other| other.overlaps(&footprint)) {
            continue;
        }
        builder.solid(&frame, low_high.0, low_high.1);
        match kind {
            0 => builder.cuboid(&frame, [-half, -0.25, 0.0], [half, 0.25, 0.5], wood),
            1 => {
                builder.cuboid(&frame, [-0.29, -0.29, 0.0], [0.29, 0.29, 0.95], grey);
                builder.cuboid(&frame, [-0.3, -0.3, 0.95], [0.3, 0.3, 1.02], green);
            }
            2 => {
                for x in [0.1 - half, half - 0.18] {
                    builder.cuboid(&frame, [x, -0.2, 0.0], [x + 0.08, 0.2, 0.42], grey);
                }
                builder.cuboid(&frame, [-half, -0.25, 0.42], [half, 0.25, 0.47], wood);
            }
            _ => {
                let top = rng.within(1.6, 2.4);
                let trunk = Column { at: [0.0; 2], z: [0.0, top], radius: [0.11, 0.08], sides: 9 };
                let crown = Column { at: [0.0; 2], z: [top, top + 2.0], radius: [1.0, 0.4], sides: 9 };
                builder.column(&frame, &trunk, wood);
                builder.column(&frame, &crown, leaves);
            }
        }
    }
}
