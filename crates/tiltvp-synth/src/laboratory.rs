//! A plain laboratory with a coloured cuboid on its floor and a lamp beside it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Vector2, Vector3};
use tiltvp_core::{Error, Result, options};

use crate::builder::{Builder, Column, Footprint, Material, Patch};
use crate::corner::{Corner, CornerKind, of_box};
use crate::frame::Frame;
use crate::options::{RoomKind, WallPattern};
use crate::outdoors::Outdoors;
use crate::plan::{Filling, Opening, Plan, Wall, rectangle};
use crate::rng::Rng;
use crate::{furniture, shell};

/// Width, depth and height of the room, metres: walls stay in the background at every distance that can be asked for.
const ROOM_M: [f64; 3] = [9.0, 8.0, 2.9];

/// How far behind the middle of the room the cuboid is, seen from where it is looked at, metres.
const BEHIND_M: f64 = 0.8;

/// Modules of markers 0, 1 and 2 of OpenCV's `DICT_4X4_50`, row by row: 1 is white.
const MARKERS: [[u16; 4]; 3] =
    [[0b1011, 0b0101, 0b0011, 0b0010], [0b0000, 0b1111, 0b1001, 0b1010], [0b0011, 0b0011, 0b0010, 0b1101]];

/// Modules along a side of the card with a marker: its own four, a black rim and a white one.
const CARD_MODULES: usize = 8;

/// How far the card's surface is before the cuboid's, metres.
const CARD_M: f64 = 1e-3;

/// Radiance of the lamp beside the cuboid at full power: a choice of look, one side bright and the other dark.
const LAMP: f64 = 60.0;

options! {
    /// How a laboratory is drawn: equal options give equal worlds.
    pub struct LaboratoryOptions {
        /// Seed of furniture, of the cuboid's turn and of its place.
        seed: u64 = 0;
        /// Lengths of the cuboid's edges `x` (at the foot of the blue face's upper edge), `y` (its height) and `z`, metres.
        size_m: [f64; 3] = [0.40, 0.36, 0.34] => 0.1..=1.0, "edges x, y, z of metres in [0.1, 1]";
        /// The angle between the level edges `x` and `z`, radians.
        gamma_rad: f64 = FRAC_PI_2 => 0.5..=2.6, "radians in [0.5, 2.6]";
        /// Side of ArUco markers in the middle of the blue, the green and the red face (numbers 0, 1 and 2 of OpenCV's
        /// `DICT_4X4_50`), metres; 0 for none. Their white cards are a third larger and 1 mm before the face.
        marker_m: f64 = 0.0 => 0.0..=0.6, "metres in [0, 0.6]";
        /// How full the walls are with furniture.
        clutter: f64 = 0.3 => 0.0..=1.0, "a number in [0, 1]";
        /// Power of the lamp beside the cuboid.
        side_light: f64 = 1.0 => 0.0..=1.0, "a number in [0, 1]";
        /// Spacing of the points where light is gathered, metres.
        light_spacing_m: f64 = 0.15 => 0.02..=1.0, "metres in [0.02, 1]";
    }
}

/// Side of the card with a marker.
fn card_m(marker_m: f64) -> f64 {
    marker_m * CARD_MODULES as f64 / (CARD_MODULES - 2) as f64
}

/// Checks each option, and that the markers' cards have room on the faces.
pub(crate) fn check(options: &LaboratoryOptions) -> Result<()> {
    options.validate()?;
    let room_m = options.size_m.iter().copied().fold(f64::INFINITY, f64::min);
    if card_m(options.marker_m) > room_m {
        let expected = format!("metres, at most {:.3}, as their cards have to be on the cuboid's faces", 0.75 * room_m);
        return Err(Error::option("marker_m", options.marker_m, expected));
    }
    if options.marker_m > 0.0 && options.gamma_rad != FRAC_PI_2 {
        return Err(Error::option("gamma_rad", options.gamma_rad, "a right angle, as the cuboid has markers"));
    }
    Ok(())
}

/// Builds the room; returns its plan. The first of the builder's corners is the cuboid's coloured one.
pub(crate) fn build(options: &LaboratoryOptions, builder: &mut Builder) -> Plan {
    let mut rng = Rng::new(options.seed, 1 << 33);
    let plan = plan(rng.seed());
    shell::build_plain(&plan, builder);
    let towards = rng.within(-std::f64::consts::PI, std::f64::consts::PI);
    let middle = Vector2::new(0.5 * ROOM_M[0], 0.5 * ROOM_M[1]);
    let place = middle - Vector2::new(towards.cos(), towards.sin()) * BEHIND_M;
    let corner = cuboid(options, place, towards, builder);
    lamp(options, &corner, towards, builder);
    furniture::furnish_walls(&plan, options.clutter, builder, &mut rng);
    // The cuboid's corner is the one that is looked at.
    builder.corners.insert(0, corner);
    plan
}

/// Four walls with two doors, and the lamps of the ceiling alone.
fn plan(seed: u32) -> Plan {
    let [width, depth, height] = ROOM_M;
    let outline = rectangle(width, depth);
    let mut walls = Wall::around(&outline);
    for wall in walls.iter_mut().skip(1).step_by(2) {
        wall.openings.push(Opening { filling: Filling::Door, along: [1.1, 2.0], z: [0.0, 2.05] });
    }
    Plan {
        kind: RoomKind::Office,
        outline,
        floors: vec![[0.0, 0.0, width, depth]],
        height,
        walls,
        outdoors: Outdoors { brightness: 0.0, towards_sun: Vector3::z(), sun: 0.0, seed },
        lamps: 10.0,
        floor_gloss: 0.0,
        wall_pattern: WallPattern::Drawn,
    }
}

/// The cuboid with its corner at a place, seen from the direction `towards`: red on top, green to the left, blue to the right.
fn cuboid(options: &LaboratoryOptions, place: Vector2<f64>, towards: f64, builder: &mut Builder) -> Corner {
    let [length_x, height, length_z] = options.size_m;
    let level = |azimuth: f64, length: f64| Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * length;
    // Seen from the front, x runs to the back and the right, z to the back and the left.
    let behind = towards + std::f64::consts::PI;
    let (x, z) = (level(behind - 0.5 * options.gamma_rad, length_x), level(behind + 0.5 * options.gamma_rad, length_z));
    let up = Vector3::z() * height;
    let foot = Vector3::new(place.x, place.y, 0.0);
    let [red, green, blue] = [(176, 34, 32), (38, 138, 56), (34, 66, 168)].map(|(r, g, b)| builder.paint(r, g, b));
    let gray = builder.paint(150, 150, 150);
    let mut face = |origin: Vector3<f64>, du: Vector3<f64>, dv: Vector3<f64>, material| {
        builder.patch(Patch { origin, du, dv, triangle: false, material, uv: [0.0; 2] });
    };
    face(foot + up, x, z, red);
    face(foot, up, z, green);
    face(foot, x, up, blue);
    face(foot + x, z, up, gray);
    face(foot + z, up, x, gray);
    if options.marker_m > 0.0 {
        let [right, back, above] = [x, z, up].map(|edge| edge.normalize());
        let middle = foot + 0.5 * (x + z + up);
        let faces = [(-z, [right, above]), (-x, [-back, above]), (up, [right, back])];
        for ((outwards, sides), modules) in faces.into_iter().zip(MARKERS) {
            marker(options.marker_m, modules, middle + 0.5 * outwards, sides, builder);
        }
    }
    builder.edges.extend(
        [foot, foot + x, foot + x + z, foot + z].map(|bottom| crate::segment::Segment { bottom, top: bottom + up }),
    );
    let solid = Frame { origin: foot, x: x.xy().normalize() };
    let reach = length_x.max(length_z);
    builder.solids.push(Footprint::new(&solid, [-reach, 0.0], [length_x + reach, reach]));
    let corner = Corner::new(foot + up, -up, [x, z], CornerKind::Solid);
    builder.corners.extend(of_box(foot, [x, z, up]).filter(|other| other.position != corner.position));
    corner
}

/// A card with a marker, around a point of a face that `across` and `up` span.
fn marker(
    side_m: f64,
    modules: [u16; 4],
    middle: Vector3<f64>,
    [across, up]: [Vector3<f64>; 2],
    builder: &mut Builder,
) {
    let size = card_m(side_m);
    let module = size / CARD_MODULES as f64;
    let origin = middle - 0.5 * size * (across + up) + CARD_M * across.cross(&up);
    let is_white = |column: usize, row: usize| {
        let is_rim = |at: usize| at == 0 || at == CARD_MODULES - 1;
        let inside = |at: usize| (2..6).contains(&at).then(|| at - 2);
        let is_bit =
            || inside(row).zip(inside(column)).is_some_and(|(row, column)| modules[row] >> (3 - column) & 1 == 1);
        is_rim(column) || is_rim(row) || is_bit()
    };
    // As light as is below saturation, which would shrink what is black.
    for (white, levels) in [(true, 150), (false, 20)] {
        let every = (0..CARD_MODULES * CARD_MODULES).map(|k| (k % CARD_MODULES, k / CARD_MODULES));
        let rectangles: Vec<[[f64; 2]; 2]> = every
            .filter(|(column, row)| is_white(*column, *row) == white)
            .map(|(column, row)| {
                let ends = |column: usize, row: usize| [column as f64 * module, size - row as f64 * module];
                let ([left, high], [right, low]) = (ends(column, row), ends(column + 1, row + 1));
                [[left, low], [right, high]]
            })
            .collect();
        let material = builder.paint(levels, levels, levels);
        let (du, dv) = (size * across, size * up);
        builder.perforated(Patch { origin, du, dv, triangle: false, material, uv: [0.0; 2] }, &rectangles);
    }
}

/// A lamp on a stand, beside the cuboid.
fn lamp(options: &LaboratoryOptions, corner: &Corner, towards: f64, builder: &mut Builder) {
    if options.side_light <= 0.0 {
        return;
    }
    let azimuth = towards + 1.35;
    let stand = Frame::new(corner.position.x + 2.0 * azimuth.cos(), corner.position.y + 2.0 * azimuth.sin(), azimuth);
    let metal = builder.paint(60, 60, 64);
    builder.column(&stand, &Column { at: [0.0, 0.0], z: [0.0, 1.55], radius: [0.015, 0.015], sides: 8 }, metal);
    let shine = builder.material(Material::Lamp([1.0, 0.97, 0.92].map(|c| LAMP * options.side_light * c)));
    let center = stand.point(-0.03, 0.0, 1.65);
    let facing = (corner.position - center).normalize();
    let across = Vector3::z().cross(&facing).normalize();
    let up = facing.cross(&across);
    let (du, dv) = (across * 0.5, up * 0.4);
    let origin = center - 0.5 * (du + dv);
    builder.patch(Patch { origin, du, dv, triangle: false, material: shine, uv: [0.0; 2] });
    let back = origin - facing * 0.02;
    builder.patch(Patch { origin: back, du: dv, dv: du, triangle: false, material: metal, uv: [0.0; 2] });
    builder.solid(&stand, [-0.25, -0.25], [0.25, 0.25]);
}
