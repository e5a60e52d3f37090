//! Edge offsets as rows of a cosine that is fitted to them (Fleer 2017, section 2.1).

use nalgebra::Vector2;
use tiltvp_kernels::compaction::{KeptRows, ROOM, RowBlock, compact_rows};
use tiltvp_kernels::vectorised;

use crate::edges::EdgePixels;
use crate::robust::{Moments, Problem, Rows, Weights};
use crate::tilt::correction::VanishingPoint;
use crate::tilt::work::Work;

/// Edge offsets `s = A cos phi + B sin phi` (eq. 19): rows `(g cos phi, g sin phi, -s)`, model `(A, B)`, residuals in pixels
/// (eq. 33), weights one or zero. `g` is the relative closed-form gain of the pixel, or 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Offsets<'a> {
    rows: &'a Rows<f32>,
    quality: &'a [f32],
}

impl<'a> Offsets<'a> {
    /// `quality` is that of each row for progressive sampling; without one all are alike.
    pub(super) fn new(rows: &'a Rows<f32>, quality: &'a [f32]) -> Self {
        Self { rows, quality }
    }
}

impl Problem for Offsets<'_> {
    type Model = Vector2<f64>;
    type Number = f32;
    const SAMPLE_SIZE: usize = 2;
    const WEIGHTS: Weights = Weights::Unit;

    fn rows(&self) -> &Rows<f32> {
        self.rows
    }

    fn quality(&self, index: usize) -> f32 {
        self.quality.get(index).copied().unwrap_or_default()
    }

    fn fit_minimal(&self, sample: &[usize]) -> Option<Vector2<f64>> {
        let (i, j) = (self.rows.get(*sample.first()?)?, self.rows.get(*sample.get(1)?)?);
        let determinant = i.x * j.y - i.y * j.x;
        if determinant.abs() < 1e-9 {
            return None;
        }
        Some(Vector2::new(i.y * j.z - i.z * j.y, i.z * j.x - i.x * j.z) / determinant)
    }

    fn fit_weighted(&self, moments: &Moments) -> Option<Vector2<f64>> {
        let [a, b, _] = moments.model();
        moments.step().map(|step| Vector2::new(a, b) + step)
    }

    fn coefficients(&self, model: &Vector2<f64>) -> [f64; 3] {
        [model.x, model.y, 1.0]
    }

    /// `|l_n - l_(n-1)|`, the paper's measure of convergence.
    fn distance(&self, a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
        (a.norm() - b.norm()).abs()
    }
}

/// `(cos phi, sin phi, s)` of an edge pixel at `(u, v)` from the vanishing point, eqs. 16 and 17: the half-turn of the
/// gradient with `phi` in `[0, pi)`.
#[inline(always)]
pub(in crate::tilt) fn edge_offset(u: f32, v: f32, gx: f32, gy: f32) -> [f32; 3] {
    let sign = if gy < 0.0 || (gy == 0.0 && gx < 0.0) { -1.0 } else { 1.0 };
    let scale = sign / (gx * gx + gy * gy).sqrt();
    let (cos, sin) = (gx * scale, gy * scale);
    [cos, sin, cos * u + sin * v]
}

/// Writes the rows of the edge pixels that pass the prefilter `|s| <= offset_max_px`, with unit weights, their pixels, and their
/// places.
pub(super) fn offsets(edges: &EdgePixels, centre: &VanishingPoint, gains: &[f32], offset_max_px: f64, work: &mut Work) {
    let Work { rows, weights, slots, places, .. } = work;
    let n = edges.len();
    weights.resize(n + ROOM, 0.0);
    slots.resize(n + ROOM, 0);
    places.resize(n + ROOM, 0);
    let limit = offset_max_px as f32;
    let middle = (centre.pixel.x as f32, centre.pixel.y as f32);
    rows.refill(n + ROOM, |[x, y, z]| {
        let mut block = Block::default();
        let mut kept = KeptRows { columns: [x, y, z, weights], numbers: slots, places, len: 0 };
        for start in (0..n).step_by(BLOCK) {
            let part = start..(start + BLOCK).min(n);
            let numbers = &edges.slot()[part.clone()];
            if gains.is_empty() {
                block.gain.fill(1.0);
            } else {
                look_up(gains, numbers, &mut block.gain);
            }
            let count = numbers.len();
            fill(&mut block, &edges.place()[part.clone()], middle, &edges.gx()[part.clone()], &edges.gy()[part], limit);
            let columns = [&block.u[..count], &block.v[..count], &block.s[..count], &block.gain[..count]];
            compact_rows(&RowBlock { columns, numbers, first: start }, &mut kept);
        }
        kept.len
    });
    slots.truncate(rows.len());
    places.truncate(rows.len());
    weights.clear();
    weights.resize(rows.len(), 1.0);
}

/// The gains of pixels. Numbers beyond the last, of which there are none, take the last: that costs less than to look whether
/// there are any.
fn look_up(gains: &[f32], numbers: &[u32], out: &mut [f32]) {
    let Some(last) = gains.len().checked_sub(1) else { return };
    for (gain, number) in out.iter_mut().zip(numbers) {
        *gain = gains[(*number as usize).min(last)];
    }
}

/// Edge pixels whose offsets are computed together: 2 KiB of columns, which stay in the first cache.
const BLOCK: usize = 128;

/// Gains, then rows and gains that are zero where the prefilter rejects.
struct Block {
    u: [f32; BLOCK],
    v: [f32; BLOCK],
    s: [f32; BLOCK],
    gain: [f32; BLOCK],
}

impl Default for Block {
    fn default() -> Self {
        let zero = [0.0; BLOCK];
        Self { u: zero, v: zero, s: zero, gain: zero }
    }
}

vectorised! {
    /// Makes rows of places, which hold the row in the upper half and the column in the lower.
    fn fill(block: &mut Block, places: &[u32], middle: (f32, f32), gx: &[f32], gy: &[f32], limit: f32) {
        let n = gx.len();
        let (u, v, s, gain) = (&mut block.u[..n], &mut block.v[..n], &mut block.s[..n], &mut block.gain[..n]);
        let (gy, places) = (&gy[..n], &places[..n]);
        for i in 0..n {
            let (column, row) = ((places[i] & 0xffff) as i32 as f32, (places[i] >> 16) as i32 as f32);
            let [cos, sin, offset] = edge_offset(column - middle.0, row - middle.1, gx[i], gy[i]);
            (u[i], v[i], s[i]) = (gain[i] * cos, gain[i] * sin, -offset);
            gain[i] = if offset.abs() <= limit { gain[i] } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phi_is_the_same_for_both_polarities() {
        for (gx, gy) in [(3.0, 4.0), (-3.0, 4.0), (5.0, 0.0), (0.0, -2.0)] {
            let a = edge_offset(30.0, 15.0, gx, gy);
            let b = edge_offset(30.0, 15.0, -gx, -gy);
            assert_eq!(a, b);
            let phi = a[1].atan2(a[0]);
            assert!((0.0..std::f32::consts::PI).contains(&phi));
        }
    }

    #[test]
    fn two_offsets_give_the_shift() {
        let shift = Vector2::new(7.0, -3.0);
        let mut rows = Rows::default();
        for phi in [0.3f32, 1.9] {
            rows.push(phi.cos(), phi.sin(), -(7.0 * phi.cos() - 3.0 * phi.sin()));
        }
        let model = Offsets::new(&rows, &[]).fit_minimal(&[0, 1]).unwrap();
        assert!((model - shift).norm() < 1e-5);
    }
}
