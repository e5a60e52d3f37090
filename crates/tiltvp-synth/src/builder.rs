//! Building a scene from boxes, sheared boxes, round columns and single panes, in the frame of each piece.

use nalgebra::{Vector2, Vector3};

use crate::corner::{self, Corner};
use crate::frame::Frame;
use crate::segment::Segment;
use crate::texture::{Color, Texture, rgb};

/// Index of a material in the scene.
pub(crate) type MaterialId = usize;

/// What a surface is made of.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Material {
    /// Reflects light by Lambert's law.
    Matt(Texture),
    /// Matt below a clear coat that mirrors, the given share of what polished stone does.
    Polished(Texture, f64),
    /// Shines by itself with the given radiance.
    Lamp(Color),
    /// A window pane: the outdoors shows, and shines, through it.
    Glass,
}

impl Material {
    /// What reflects light by Lambert's law, if anything does.
    pub(crate) fn texture(&self) -> Option<&Texture> {
        match self {
            Self::Matt(texture) | Self::Polished(texture, _) => Some(texture),
            Self::Lamp(_) | Self::Glass => None,
        }
    }
}

/// A flat parallelogram `origin + s du + t dv`, or the triangle of it with `s + t <= 1`; its front is `du x dv`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patch {
    pub(crate) origin: Vector3<f64>,
    pub(crate) du: Vector3<f64>,
    pub(crate) dv: Vector3<f64>,
    pub(crate) triangle: bool,
    pub(crate) material: MaterialId,
    /// Texture coordinates of the origin in metres.
    pub(crate) uv: [f64; 2],
}

/// A rectangle of a patch that is really there, in shares of `du` and `dv`: walls have holes, but one light and texture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    pub(crate) patch: usize,
    pub(crate) low: [f64; 2],
    pub(crate) high: [f64; 2],
}

/// An upright round or tapered column of a frame, around `(x, y)`, with as many sides as asked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Column {
    pub(crate) at: [f64; 2],
    pub(crate) z: [f64; 2],
    pub(crate) radius: [f64; 2],
    pub(crate) sides: usize,
}

/// A rectangle of the floor, turned with its frame, that something solid stands on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footprint {
    pub(crate) center: Vector2<f64>,
    pub(crate) x: Vector2<f64>,
    pub(crate) half: [f64; 2],
}

impl Footprint {
    /// The rectangle `low..high` of a frame.
    pub(crate) fn new(frame: &Frame, low: [f64; 2], high: [f64; 2]) -> Self {
        let center = frame.point(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.0);
        Self { center: center.xy(), x: frame.x, half: [0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1])] }
    }

    /// The corners in turn.
    pub(crate) fn corners(&self) -> [Vector2<f64>; 4] {
        let y = Vector2::new(-self.x.y, self.x.x);
        [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
            .map(|(s, t)| self.center + self.x * (s * self.half[0]) + y * (t * self.half[1]))
    }

    /// How far a point of the floor is outside the rectangle; 0 inside.
    pub(crate) fn distance(&self, point: &Vector2<f64>) -> f64 {
        let d = point - self.center;
        let y = Vector2::new(-self.x.y, self.x.x);
        let outside = Vector2::new(d.dot(&self.x).abs() - self.half[0], d.dot(&y).abs() - self.half[1]);
        outside.map(|c| c.max(0.0)).norm()
    }

    /// Whether two rectangles overlap (separating axes).
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        let axes = [self.x, Vector2::new(-self.x.y, self.x.x), other.x, Vector2::new(-other.x.y, other.x.x)];
        axes.iter().all(|axis| {
            let range = |f: &Self| {
                f.corners().iter().map(|c| c.dot(axis)).fold((f64::MAX, f64::MIN), |(a, b), d| (a.min(d), b.max(d)))
            };
            let ((a0, a1), (b0, b1)) = (range(self), range(other));
            a0 < b1 && b0 < a1
        })
    }
}

/// A scene under construction.
#[derive(Debug, Default)]
pub(crate) struct Builder {
    pub(crate) patches: Vec<Patch>,
    pub(crate) pieces: Vec<Piece>,
    pub(crate) materials: Vec<Material>,
    pub(crate) edges: Vec<Segment>,
    /// Upright edges that are painted on walls.
    pub(crate) painted: Vec<Segment>,
    /// Where an upright and two level edges meet.
    pub(crate) corners: Vec<Corner>,
    /// Where a low robot cannot stand.
    pub(crate) solids: Vec<Footprint>,
}

impl Builder {
    /// Adds a material.
    pub(crate) fn material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// Adds a matt material.
    pub(crate) fn matt(&mut self, texture: Texture) -> MaterialId {
        self.material(Material::Matt(texture))
    }

    /// Adds a paint of display levels 0 to 255.
    pub(crate) fn paint(&mut self, red: u8, green: u8, blue: u8) -> MaterialId {
        let seed = self.materials.len() as u32;
        self.matt(Texture::Paint { color: rgb(red, green, blue), mottle: 0.08, seed })
    }

    /// Adds a whole patch.
    pub(crate) fn patch(&mut self, patch: Patch) {
        self.pieces.push(Piece { patch: self.patches.len(), low: [0.0; 2], high: [1.0; 2] });
        self.patches.push(patch);
    }

    /// Adds the given rectangles `[low, high]` of a patch, in metres along its sides.
    pub(crate) fn perforated(&mut self, patch: Patch, rectangles: &[[[f64; 2]; 2]]) {
        let size = [patch.du.norm(), patch.dv.norm()];
        let share = |at: [f64; 2]| [at[0] / size[0], at[1] / size[1]];
        let index = self.patches.len();
        self.patches.push(patch);
        self.pieces.extend(rectangles.iter().map(|[low, high]| Piece {
            patch: index,
            low: share(*low),
            high: share(*high),
        }));
    }

    /// A pane from three corners of a frame: origin, end of `u`, end of `v`; texture coordinates start at `uv`.
    pub(crate) fn pane(&mut self, frame: &Frame, corners: [[f64; 3]; 3], uv: [f64; 2], material: MaterialId) {
        let [o, u, v] = corners.map(|c| frame.point(c[0], c[1], c[2]));
        self.patch(Patch { origin: o, du: u - o, dv: v - o, triangle: false, material, uv });
    }

    /// A triangle of the world, seen from where its corners turn counter-clockwise.
    pub(crate) fn triangle(&mut self, corners: [Vector3<f64>; 3], material: MaterialId) {
        let [o, u, v] = corners;
        self.patch(Patch { origin: o, du: u - o, dv: v - o, triangle: true, material, uv: [0.0, 0.0] });
    }

    /// A true vertical edge of the world.
    pub(crate) fn edge(&mut self, bottom: Vector3<f64>, height: f64) {
        self.edges.push(Segment { bottom, top: bottom + Vector3::z() * height });
    }

    /// An upright box of a frame; its vertical edges are true ones.
    pub(crate) fn cuboid(&mut self, frame: &Frame, low: [f64; 3], high: [f64; 3], material: MaterialId) {
        let size = [high[0] - low[0], high[1] - low[1], high[2] - low[2]];
        self.sheared(
            frame.point(low[0], low[1], low[2]),
            [frame.vector(size[0], 0.0, 0.0), frame.vector(0.0, size[1], 0.0), Vector3::z() * size[2]],
            material,
        );
    }

    /// A box with the given corner and edges (right-handed); those that are vertical and not tiny become true edges.
    pub(crate) fn sheared(&mut self, origin: Vector3<f64>, edges: [Vector3<f64>; 3], material: MaterialId) {
        let [a, b, c] = edges;
        // Endless textures start elsewhere on every face, so that no two boards are the same.
        let endless = matches!(
            self.materials.get(material),
            Some(Material::Matt(Texture::Wood { .. } | Texture::Paint { .. } | Texture::Cloth { .. }))
        );
        let mut face = |origin: Vector3<f64>, du: Vector3<f64>, dv: Vector3<f64>| {
            let shift = if endless { 0.37 * self.patches.len() as f64 } else { 0.0 };
            self.patch(Patch { origin, du, dv, triangle: false, material, uv: [shift, shift] });
        };
        face(origin, b, a);
        face(origin + c, a, b);
        face(origin, a, c);
        face(origin + a, b, c);
        face(origin + a + b, -a, c);
        face(origin + b, -b, c);
        if c.xy().norm() < 1e-9 && c.z > 0.1 && a.norm().min(b.norm()) > 0.01 {
            for corner in [origin, origin + a, origin + a + b, origin + b] {
                self.edge(corner, c.z);
            }
        }
        if c.xy().norm() < 1e-9 && c.z > 0.0 && a.z.abs() < 1e-9 && b.z.abs() < 1e-9 {
            self.corners.extend(corner::of_box(origin, edges));
        }
    }

    /// A square post of the given thickness from one point of a frame to another; it may lean.
    pub(crate) fn post(&mut self, frame: &Frame, from: [f64; 3], to: [f64; 3], thickness: f64, material: MaterialId) {
        let (start, end) = (frame.point(from[0], from[1], from[2]), frame.point(to[0], to[1], to[2]));
        let (a, b) = (frame.vector(thickness, 0.0, 0.0), frame.vector(0.0, thickness, 0.0));
        self.sheared(start - 0.5 * (a + b), [a, b, end - start], material);
    }

    /// A column, with caps.
    pub(crate) fn column(&mut self, frame: &Frame, column: &Column, material: MaterialId) {
        let Column { at, z, radius, sides } = *column;
        let ring = |k: usize, end: usize| {
            let (s, c) = (std::f64::consts::TAU * k as f64 / sides as f64).sin_cos();
            frame.point(at[0] + radius[end] * c, at[1] + radius[end] * s, z[end])
        };
        let (bottom, top) = (frame.point(at[0], at[1], z[0]), frame.point(at[0], at[1], z[1]));
        for k in 0..sides {
            let (b0, b1, t0, t1) = (ring(k, 0), ring(k + 1, 0), ring(k, 1), ring(k + 1, 1));
            if (radius[0] - radius[1]).abs() < 1e-12 {
                self.patch(Patch {
                    origin: b0,
                    du: b1 - b0,
                    dv: t0 - b0,
                    triangle: false,
                    material,
                    uv: [k as f64 * (b1 - b0).norm(), 0.0],
                });
            } else {
                self.triangle([b0, b1, t1], material);
                self.triangle([b0, t1, t0], material);
            }
            self.triangle([bottom, b1, b0], material);
            self.triangle([top, t0, t1], material);
        }
    }

    /// Marks a rectangle of a frame as solid for a low robot.
    pub(crate) fn solid(&mut self, frame: &Frame, low: [f64; 2], high: [f64; 2]) {
        self.solids.push(Footprint::new(frame, low, high));
    }
}
