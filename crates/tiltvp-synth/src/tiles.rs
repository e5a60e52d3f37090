//! All rays of one picture, cast tile by tile: what no ray of a tile can meet is left aside for the whole tile.

use nalgebra::{Matrix3, Vector3};

use crate::builder::{Material, Piece};
use crate::scene::{Contact, Scene};

/// Sides of the nested tiles, pixels, from large to small: each halves the one before, and chooses among its candidates
/// (`tiles_lose_nothing`).
pub(crate) const SIDES: [usize; 4] = [64, 32, 16, 8];

/// A cone of directions around a unit axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cone {
    axis: Vector3<f64>,
    sin: f64,
    cos: f64,
}

impl Cone {
    /// The cone, around the middle of some directions, that holds all of them and `margin` radians more; none without any.
    pub(crate) fn around(directions: &[Vector3<f64>], margin: f64) -> Option<Self> {
        let sum: Vector3<f64> = directions.iter().sum();
        let axis = sum.try_normalize(1e-9).or_else(|| directions.first().copied())?;
        let half = directions.iter().map(|d| d.cross(&axis).norm().atan2(d.dot(&axis))).fold(0.0, f64::max) + margin;
        let (sin, cos) = half.min(std::f64::consts::PI).sin_cos();
        Some(Self { axis, sin, cos })
    }

    /// The cone in another frame.
    pub(crate) fn turned(&self, rotation: &Matrix3<f64>) -> Self {
        Self { axis: rotation * self.axis, ..*self }
    }

    /// The cone as the floor mirrors it.
    pub(crate) fn mirrored(&self) -> Self {
        Self { axis: Vector3::new(self.axis.x, self.axis.y, -self.axis.z), ..*self }
    }

    /// Least and greatest dot product of a vector and the directions of the cone, to the safe side.
    fn range(&self, v: &Vector3<f64>) -> (f64, f64) {
        let along = v.dot(&self.axis);
        let length = v.norm();
        let across = (length * length - along * along).max(0.0).sqrt();
        let low = if -along >= length * self.cos { -length } else { along * self.cos - across * self.sin };
        let high = if along >= length * self.cos { length } else { along * self.cos + across * self.sin };
        (low, high)
    }
}

/// A piece as seen from one point: the dot products of a unit direction with its three vectors are the inverse distance, and
/// the coordinates along `du` and `dv` over the distance.
struct Facet {
    patch: u32,
    triangle: bool,
    inverse: Vector3<f64>,
    s: Vector3<f64>,
    t: Vector3<f64>,
    low: [f64; 2],
    high: [f64; 2],
    /// Normals of the planes through the point and the sides: directions to the piece are on the front of all.
    sides: [Vector3<f64>; 4],
}

/// A facet that rays of a tile may meet, and its greatest inverse distance in the tile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    facet: u32,
    nearest: f64,
}

/// The facets of a room as seen from one point.
pub(crate) struct VisibleFacets {
    facets: Vec<Facet>,
}

impl VisibleFacets {
    /// Everything as seen from a point of a room.
    pub(crate) fn new(scene: &Scene, center: &Vector3<f64>) -> Self {
        Self { facets: scene.pieces.iter().filter_map(|piece| facet(scene, piece, center)).collect() }
    }

    /// What the floor mirrors, as seen from the mirror image of a point: everything but the floor itself.
    pub(crate) fn mirrored(scene: &Scene, center: &Vector3<f64>) -> Self {
        let below = Vector3::new(center.x, center.y, -center.z);
        let pieces = scene.pieces.iter().filter(|p| !matches!(scene.material(p.patch), Material::Polished(..)));
        Self { facets: pieces.filter_map(|piece| facet(scene, piece, &below)).collect() }
    }

    /// Every facet, for the largest tiles to choose from.
    pub(crate) fn all(&self) -> Vec<Candidate> {
        (0..self.facets.len() as u32).map(|facet| Candidate { facet, nearest: f64::INFINITY }).collect()
    }

    /// The facets of `from` that the first hit of some ray of a cone may be on, those that may be nearest first.
    pub(crate) fn candidates(&self, from: &[Candidate], cone: &Cone, to: &mut Vec<Candidate>) {
        to.clear();
        let mut wall = 0.0f64;
        for candidate in from {
            let facet = &self.facets[candidate.facet as usize];
            let (farthest, nearest) = cone.range(&facet.inverse);
            if nearest <= wall {
                continue;
            }
            let sides = &facet.sides[..if facet.triangle { 3 } else { 4 }];
            let least = sides.iter().map(|side| side.dot(&cone.axis)).fold(f64::INFINITY, f64::min);
            if cone.cos > 0.0 && least < -cone.sin {
                continue;
            }
            if least > cone.sin && cone.cos > 0.0 {
                // It fills the cone: nothing behind it is seen.
                wall = wall.max(farthest);
            }
            to.push(Candidate { facet: candidate.facet, nearest });
        }
        to.retain(|candidate| candidate.nearest >= wall);
        to.sort_by(|a, b| b.nearest.total_cmp(&a.nearest));
    }

    /// Whether some candidate mirrors.
    pub(crate) fn meets_polish(&self, candidates: &[Candidate], scene: &Scene) -> bool {
        candidates.iter().any(|candidate| {
            let patch = self.facets[candidate.facet as usize].patch as usize;
            matches!(scene.material(patch), Material::Polished(..))
        })
    }

    /// The first of the candidates that a ray in a unit direction meets.
    pub(crate) fn cast(&self, candidates: &[Candidate], direction: &Vector3<f64>) -> Option<Contact> {
        // How far beside a facet a ray still meets it, in parts of its sides: more than the rounding of `f64`, so that there is
        // no gap between neighbours, and less than a hundredth of a pixel.
        const SEAM: f64 = 1e-9;
        let mut best = 1e-3;
        let mut contact = None;
        for candidate in candidates {
            if candidate.nearest <= best {
                break;
            }
            let facet = &self.facets[candidate.facet as usize];
            let inverse = facet.inverse.dot(direction);
            if inverse <= best {
                continue;
            }
            let distance = 1.0 / inverse;
            let (s, t) = (facet.s.dot(direction) * distance, facet.t.dot(direction) * distance);
            let inside = s >= facet.low[0] - SEAM
                && s <= facet.high[0] + SEAM
                && t >= facet.low[1] - SEAM
                && t <= facet.high[1] + SEAM
                && !(facet.triangle && s + t > 1.0 + SEAM);
            if inside {
                best = inverse;
                let at = [s.clamp(0.0, 1.0), t.clamp(0.0, 1.0)];
                contact = Some(Contact { patch: facet.patch as usize, distance, at });
            }
        }
        contact
    }
}

/// A piece as seen from a point; none from within its plane.
fn facet(scene: &Scene, piece: &Piece, center: &Vector3<f64>) -> Option<Facet> {
    let patch = &scene.patches[piece.patch];
    let offset = patch.origin - center;
    let normal = scene.normal(piece.patch);
    let height = normal.dot(&offset);
    if height.abs() < 1e-7 {
        return None;
    }
    let inverse = normal / height;
    let [a, b] = scene.duals(piece.patch);
    // s = a . (distance direction - offset), and 1 = distance inverse . direction.
    let (s, t) = (a - inverse * a.dot(&offset), b - inverse * b.dot(&offset));
    let unit = |v: Vector3<f64>| v.try_normalize(1e-12).unwrap_or_else(Vector3::zeros);
    let sides = if patch.triangle {
        [unit(s), unit(t), unit(inverse - s - t), Vector3::zeros()]
    } else {
        [
            unit(s - inverse * piece.low[0]),
            unit(inverse * piece.high[0] - s),
            unit(t - inverse * piece.low[1]),
            unit(inverse * piece.high[1] - t),
        ]
    };
    let (patch, triangle) = (piece.patch as u32, patch.triangle);
    Some(Facet { patch, triangle, inverse, s, t, low: piece.low, high: piece.high, sides })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::options::{RoomKind, RoomOptions};
    use crate::rng::Rng;
    use crate::world::World;

    /// Tile by tile, rays meet what they meet one by one.
    #[test]
    fn tiles_lose_nothing() {
        let options = RoomOptions { light_spacing_m: 1.0, floor_gloss: 1.0, ..RoomOptions::new(RoomKind::Office, 8) };
        let world = World::new(&options).unwrap();
        let scene = world.scene();
        let pose = world.free_poses(1, 3).unwrap()[0];
        let center = Vector3::new(pose.x_m, pose.y_m, 0.37);
        let (facets, below) = (VisibleFacets::new(scene, &center), VisibleFacets::mirrored(scene, &center));
        let mut rng = Rng::new(1, 1);
        let mut other = 0;
        for _ in 0..400 {
            let mut draw = |spread: f64| Vector3::from_fn(|_, _| spread * rng.normal());
            let axis = draw(1.0).normalize();
            let directions: Vec<Vector3<f64>> = (0..24).map(|_| (axis + draw(0.05)).normalize()).collect();
            let cone = Cone::around(&directions, 0.0).unwrap();
            let (mut wide, mut near, mut under) = (Vec::new(), Vec::new(), Vec::new());
            let wider = Cone::around(&directions, 0.3).unwrap();
            facets.candidates(&facets.all(), &wider, &mut wide);
            facets.candidates(&wide, &cone, &mut near);
            below.candidates(&below.all(), &cone.mirrored(), &mut under);
            for direction in &directions {
                let (one, tiled) = (scene.cast(&center, direction, 1e3), facets.cast(&near, direction));
                let apart = match (one, tiled) {
                    (Some(a), Some(b)) => (a.distance - b.distance).abs(),
                    (None, None) => 0.0,
                    _ => f64::INFINITY,
                };
                // Rays through seams may end on either side.
                other += usize::from(apart > 1e-6);
                let Some(floor) = tiled.filter(|c| matches!(scene.material(c.patch), Material::Polished(..))) else {
                    continue;
                };
                let up = Vector3::new(direction.x, direction.y, -direction.z);
                let point = center + direction * floor.distance + Vector3::z() * 1e-6;
                let further = scene.cast(&point, &up, 1e3).map_or(0.0, |contact| contact.distance + floor.distance);
                let tiled = below.cast(&under, &up).map_or(0.0, |contact| contact.distance);
                other += usize::from((further - tiled).abs() > 1e-3);
            }
        }
        assert!(other <= 5, "{other} of 9600 rays end elsewhere");
    }
}
