//! The image-space methods of paper 000, section 2.1: a cosine fitted to the edge offsets.

use multiversion::multiversion;
use nalgebra::Vector2;

use super::correction::VanishingPoint;
use crate::edges::{EdgePixels, Region};
use crate::robust::{Gate, Moments, Problem, Rows, Score};

/// Edge offsets `s = A cos phi + B sin phi` (eq. 19): rows `(g cos phi, g sin phi, -s)`, model `(A, B)`, residuals in pixels
/// (eq. 33). `g` is the relative closed-form gain of the pixel, or 1.
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
    type Summary = Moments;
    const SAMPLE_SIZE: usize = 2;

    fn len(&self) -> usize {
        self.rows.len()
    }

    fn fit_minimal(&self, sample: &[usize]) -> Option<Vector2<f64>> {
        let (i, j) = (self.rows.get(*sample.first()?)?, self.rows.get(*sample.get(1)?)?);
        let determinant = i.x * j.y - i.y * j.x;
        if determinant.abs() < 1e-9 {
            return None;
        }
        Some(Vector2::new(i.y * j.z - i.z * j.y, i.z * j.x - i.x * j.z) / determinant)
    }

    fn consensus(&self, model: &Vector2<f64>, threshold: f64, to_beat: usize) -> usize {
        self.rows.count_to_beat([model.x, model.y, 1.0], threshold, to_beat)
    }

    fn consensus_among(&self, observations: &[u32], model: &Vector2<f64>, threshold: f64) -> usize {
        self.rows.count_among(observations, [model.x, model.y, 1.0], threshold)
    }

    fn support(&self, model: &Vector2<f64>, threshold: f64, score: Score, to_beat: f64) -> f64 {
        self.rows.support([model.x, model.y, 1.0], threshold, score, to_beat)
    }

    fn quality(&self, index: usize) -> f32 {
        self.quality.get(index).copied().unwrap_or_default()
    }

    fn summarise(&self, model: &Vector2<f64>, gate: Gate, weights: &mut [f32]) -> Moments {
        self.rows.moments([model.x, model.y, 1.0], gate, weights)
    }

    fn trim(&self, before: &Moments, model: &Vector2<f64>, threshold: f64, weights: &mut [f32]) -> Moments {
        self.rows.trim(before, [model.x, model.y, 1.0], threshold, weights)
    }

    fn fit(&self, summary: &Moments, _near: &Vector2<f64>) -> Option<Vector2<f64>> {
        let [a, b, _] = summary.model();
        summary.step().map(|step| Vector2::new(a, b) + step)
    }

    fn rms(&self, summary: &Moments, model: &Vector2<f64>) -> f64 {
        let [a, b, _] = summary.model();
        (summary.sum_of_squares(&(model - Vector2::new(a, b))) / summary.weight).sqrt()
    }

    fn count(summary: &Moments) -> usize {
        summary.count
    }

    /// `|l_n - l_(n-1)|`, the paper's measure of convergence.
    fn distance(&self, a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
        (a.norm() - b.norm()).abs()
    }
}

/// `(cos phi, sin phi, s)` of an edge pixel at `(u, v)` from the vanishing point, eqs. 16 and 17: the half-turn of the
/// gradient with `phi` in `[0, pi)`.
#[inline(always)]
pub(super) fn edge_offset(u: f32, v: f32, gx: f32, gy: f32) -> [f32; 3] {
    let sign = if gy < 0.0 || (gy == 0.0 && gx < 0.0) { -1.0 } else { 1.0 };
    let scale = sign / (gx * gx + gy * gy).sqrt();
    let (cos, sin) = (gx * scale, gy * scale);
    [cos, sin, cos * u + sin * v]
}

/// Writes the rows of the edge pixels that pass the prefilter `|s| <= offset_max_px`, with unit weights, and their places.
#[expect(clippy::too_many_arguments, reason = "three tables in, three caller-owned vectors out")]
pub(super) fn offsets(
    edges: &EdgePixels,
    region: &Region,
    centre: &VanishingPoint,
    gains: &[f32],
    offset_max_px: f64,
    rows: &mut Rows<f32>,
    weights: &mut Vec<f32>,
    places: &mut Vec<u32>,
) {
    let n = edges.len();
    places.resize(n, 0);
    let limit = offset_max_px as f32;
    let middle = (centre.pixel.x as f32, centre.pixel.y as f32);
    rows.refill(n, |[x, y, z]| {
        let mut block = Block::default();
        let mut kept = 0;
        for start in (0..n).step_by(BLOCK) {
            let part = start..(start + BLOCK).min(n);
            let slots = &edges.slot()[part.clone()];
            for (i, slot) in slots.iter().enumerate() {
                let (u, v) = region.place(*slot as usize);
                (block.u[i], block.v[i]) = (f32::from(u) - middle.0, f32::from(v) - middle.1);
            }
            if gains.is_empty() {
                block.gain.fill(1.0);
            } else {
                for (gain, slot) in block.gain.iter_mut().zip(slots) {
                    *gain = gains.get(*slot as usize).copied().unwrap_or(1.0);
                }
            }
            fill(&mut block, &edges.gx()[part.clone()], &edges.gy()[part], limit);
            for i in 0..slots.len() {
                // Written always and kept if it passes: a branch here would be guessed wrong too often.
                (x[kept], y[kept], z[kept]) = (block.u[i], block.v[i], block.s[i]);
                places[kept] = (start + i) as u32;
                kept += usize::from(block.gain[i] > 0.0);
            }
        }
        kept
    });
    places.truncate(rows.len());
    weights.clear();
    weights.resize(rows.len(), 1.0);
}

/// Edge pixels whose offsets are computed together.
const BLOCK: usize = 128;

/// Places relative to the vanishing point and gains, then rows and gains that are zero where the prefilter rejects.
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

/// Makes rows of places, in place.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn fill(block: &mut Block, gx: &[f32], gy: &[f32], limit: f32) {
    let n = gx.len();
    let (u, v, s, gain) = (&mut block.u[..n], &mut block.v[..n], &mut block.s[..n], &mut block.gain[..n]);
    let gy = &gy[..n];
    for i in 0..n {
        let [cos, sin, offset] = edge_offset(u[i], v[i], gx[i], gy[i]);
        (u[i], v[i], s[i]) = (gain[i] * cos, gain[i] * sin, -offset);
        gain[i] = if offset.abs() <= limit { gain[i] } else { 0.0 };
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
