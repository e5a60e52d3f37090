//! From an edge pixel's gradient to the great circle that the edge lies on.

use std::array;

use nalgebra::{Matrix3, SVector, Vector2};
use tiltvp_kernels::compaction::{KeptRows, ROOM, RowBlock, compact_rows};
use tiltvp_kernels::normals::{self, BLOCK, Normals};
use tiltvp_kernels::prefetch::prefetch;

use super::detect::EdgePixels;
use super::prefilter::Prefilter;
use super::region::Region;
use super::whole::whole;
use crate::camera::{Camera, Interpolated};
use crate::parallel;
use crate::robust::Rows;

/// By how much entries may be off, as a share of the largest of a map: a third of the last bit that is kept.
const SHARE: f64 = 1e-5;

/// How the normal of an edge's great circle is made from the gradient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NormalKind {
    /// The gradient is a covector and is pulled back by the projection, `m ~ (d pixel / d bearing)^T g`: exact for every lens.
    Tangent,
    /// The gradient is pushed forward like a vector, `m ~ (d bearing / d pixel) g` (Fleer 2017, eq. 37, `v x (u x v)` in the
    /// limit of a small step): exact only where the lens is conformal.
    Gradient,
}

/// For each pixel of a region the 3x2 matrix that takes a gradient to a normal in the robot frame.
#[derive(Debug, Clone)]
pub struct LiftTable {
    /// Rows of the matrices, two entries of 16 bits in a word, in units of `unit`: half the memory of single precision, to a few
    /// thousandths of a degree.
    maps: Vec<[u32; 3]>,
    unit: f32,
}

impl LiftTable {
    /// One matrix for each pixel of the region, all divided by their root mean square, so that a gradient of one grey level
    /// per pixel gives a normal of a length about one: longer where the lens shows the edge's direction better.
    pub fn new(camera: &Camera, robot_from_camera: &Matrix3<f64>, region: &Region, kind: NormalKind) -> Self {
        let map = |pixel: Vector2<f64>| -> Option<SVector<f64, 6>> {
            let (_, back) = camera.unproject_jacobian_unlimited(&pixel)?;
            let matrix = match kind {
                // d pixel / d bearing is the pseudoinverse of d bearing / d pixel: neither has a part along the bearing.
                NormalKind::Tangent => back * (back.transpose() * back).try_inverse()?,
                NormalKind::Gradient => back,
            };
            Some(SVector::from_column_slice((robot_from_camera * matrix).as_slice()))
        };
        let lens = Interpolated::new([camera.width() as usize, camera.height() as usize], SHARE, map);
        // Twice, as the matrices would take four times the memory of the table.
        let measured = parallel::blocks(region.len(), |slots| {
            let (mut squares, mut largest) = (0.0, 0.0f64);
            region.along(&lens, slots, |_, map| {
                squares += map.norm_squared();
                largest = largest.max(map.amax());
            });
            (squares, largest)
        });
        let (squares, largest) =
            measured.iter().fold((0.0, 0.0f64), |(squares, largest), own| (squares + own.0, largest.max(own.1)));
        let mean_square = squares / (2 * region.len().max(1)) as f64;
        let scale = 1.0 / mean_square.sqrt().max(f64::MIN_POSITIVE);
        let unit = largest.max(f64::MIN_POSITIVE) / f64::from(i16::MAX);
        let entry = |value: f64| u32::from(whole(value / unit) as u16);
        let maps = parallel::filled(region.len(), |first, out: &mut [[u32; 3]]| {
            region.along(&lens, first..first + out.len(), |k, map| {
                out[k] = array::from_fn(|i| entry(map[i]) | (entry(map[i + 3]) << 16));
            });
        });
        Self { maps, unit: (unit * scale) as f32 }
    }

    /// The prefilter of the test that [`lift`](Self::lift) makes: `|m_z| <= sin_max |m|` with `|m|` no more than the largest
    /// stretch of the pixel's matrix.
    pub fn prefilter(&self, sin_max: f64) -> Prefilter {
        let vector = |map: &[u32; 3]| {
            let [[a, b], [c, d], [e, f]] = map.map(entries);
            let (xx, xy, yy) = (a * a + c * c + e * e, a * b + c * d + e * f, b * b + d * d + f * f);
            let largest = 0.5 * (xx + yy) + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
            if largest > 0.0 { [e / largest.sqrt(), f / largest.sqrt()] } else { [0.0; 2] }
        };
        Prefilter::new(self.maps.len(), |slot| vector(&self.maps[slot]), 1.0, sin_max)
    }

    /// The unit normal that [`lift`](Self::lift) makes of one edge pixel: its place in the region and its gradient. None for
    /// a pixel without a map or a gradient of zero.
    pub fn normal(&self, slot: usize, gx: f32, gy: f32) -> Option<[f32; 3]> {
        let [[a, b], [c, d], [e, f]] = self.maps.get(slot)?.map(entries);
        let [x, y, z] = [a * gx + b * gy, c * gx + d * gy, e * gx + f * gy];
        let length = (x * x + y * y + z * z).sqrt();
        (length > 0.0).then(|| [x / length, y / length, z / length])
    }

    /// Writes the unit normals of the edge pixels whose great circles pass within `asin(sin_max)` of the robot's vertical,
    /// their magnitudes of gradient as weights, their pixels within the region, and their places among the edge pixels.
    pub fn lift(
        &self,
        edges: &EdgePixels,
        sin_max: f64,
        rows: &mut Rows<f32>,
        weights: &mut Vec<f32>,
        slots: &mut Vec<u32>,
        places: &mut Vec<u32>,
    ) {
        let (n, last) = if self.maps.is_empty() { (0, 0) } else { (edges.len(), self.maps.len() - 1) };
        weights.resize(n + ROOM, 0.0);
        slots.resize(n + ROOM, 0);
        places.resize(n + ROOM, 0);
        let limit = (sin_max * sin_max) as f32;
        rows.refill(n + ROOM, |[x, y, z]| {
            let mut block = Normals::default();
            let mut kept = KeptRows { columns: [x, y, z, weights], numbers: slots, places, len: 0 };
            for start in (0..n).step_by(BLOCK) {
                let part = start..(start + BLOCK).min(n);
                let numbers = &edges.slot()[part.clone()];
                for slot in edges.slot()[part.end..].iter().take(BLOCK) {
                    prefetch(&self.maps, *slot as usize);
                }
                let [ab, cd, ef] = &mut block.maps;
                for (((slot, ab), cd), ef) in numbers.iter().zip(ab).zip(cd).zip(ef) {
                    // None is beyond the last, and to say so costs less than to look.
                    [*ab, *cd, *ef] = self.maps[(*slot as usize).min(last)];
                }
                let count = numbers.len();
                normals::lift(&mut block, &edges.gx()[part.clone()], &edges.gy()[part], limit, self.unit);
                let [x, y, z] = block.rows.each_ref().map(|row| &row[..count]);
                let columns = [x, y, z, &block.weights[..count]];
                compact_rows(&RowBlock { columns, numbers, first: start }, &mut kept);
            }
            kept.len
        });
        weights.truncate(rows.len());
        slots.truncate(rows.len());
        places.truncate(rows.len());
    }
}

/// The entries of a word, the lower first.
fn entries(pair: u32) -> [f32; 2] {
    [f32::from(pair as u16 as i16), f32::from((pair >> 16) as u16 as i16)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Equidistant, Model};
    use crate::edges::EdgeOptions;
    use nalgebra::Vector3;

    /// The gradient of an edge along a great circle is across the circle's image, whatever the lens.
    #[test]
    fn tangent_normals_are_exact_and_gradient_normals_are_not() {
        let lens = Equidistant::new(139.7, 319.5, 239.5).unwrap();
        let camera = Camera::new(640, 480, Model::Equidistant(lens)).unwrap();
        let options = EdgeOptions::default();
        let identity = Matrix3::identity();
        let region = Region::new(&camera, &identity, &options, None).unwrap();
        let truth = Vector3::new(0.8, -0.6, 0.1).normalize();
        let mut worst = [0.0f64; 2];
        for (i, kind) in [NormalKind::Tangent, NormalKind::Gradient].into_iter().enumerate() {
            let table = LiftTable::new(&camera, &identity, &region, kind);
            let mut edges = EdgePixels::with_capacity(region.len());
            for (slot, (u, v, bearing)) in region.pixels().enumerate() {
                if bearing.dot(&truth).abs() < 0.005 {
                    let (_, back) = camera.unproject_jacobian(&Vector2::new(u as f64, v as f64)).unwrap();
                    // I = f(truth . bearing): dI / d pixel = truth^T d bearing / d pixel.
                    let gradient = back.transpose() * truth * 1e4;
                    edges.push(&region, slot as u32, gradient.x as f32, gradient.y as f32);
                }
            }
            let (mut rows, mut weights) = (Rows::default(), Vec::new());
            table.lift(&edges, 1.0, &mut rows, &mut weights, &mut Vec::new(), &mut Vec::new());
            assert!(rows.len() > 50);
            for row in rows.iter() {
                worst[i] = worst[i].max(row.cross(&truth).norm().asin());
            }
        }
        assert!(worst[0] < 0.006, "tangent normals are off by {} rad", worst[0]);
        assert!(worst[1] > 0.02, "gradient normals are off by {} rad only", worst[1]);
    }
}
