//! Edge pixels: the Scharr gradient of the band's rows, and the pixels where it is strong.

use multiversion::multiversion;

use super::options::EdgeOptions;
use super::region::{Region, Span};
use super::screen::Screen;
use super::sieve::{BLOCK as ROOM, Dispatch, Kept, Level, Rows, Sieve, Test, Vectors, expect, sieve, unpack};
use crate::image::{ImageView, Smoother};

/// Edge pixels in structure-of-arrays form, in slot order.
#[derive(Debug, Clone, Default)]
pub struct EdgePixels {
    slot: Vec<u32>,
    gx: Vec<f32>,
    gy: Vec<f32>,
    /// Both, as the detector's kernels write them.
    packed: Vec<u32>,
    len: usize,
    strong: usize,
}

impl EdgePixels {
    /// No pixels, with room for `capacity` of them.
    pub fn with_capacity(capacity: usize) -> Self {
        let mut pixels = Self::default();
        pixels.make_room(capacity);
        pixels
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// How many pixels had a strong gradient, those included that a screen has kept out.
    pub fn strong(&self) -> usize {
        self.strong
    }

    /// Number of each pixel within the region.
    pub fn slot(&self) -> &[u32] {
        &self.slot[..self.len]
    }

    /// Gradient of each pixel along `u` (Scharr, unnormalised).
    pub fn gx(&self) -> &[f32] {
        &self.gx[..self.len]
    }

    /// Gradient of each pixel along `v`.
    pub fn gy(&self) -> &[f32] {
        &self.gy[..self.len]
    }

    /// Leaves none, and the room for them.
    pub fn clear(&mut self) {
        (self.len, self.strong) = (0, 0);
    }

    /// Appends a pixel.
    pub fn push(&mut self, slot: u32, gx: f32, gy: f32) {
        if self.slot.len() == self.len {
            self.make_room(2 * self.len + 64);
        }
        (self.slot[self.len], self.gx[self.len], self.gy[self.len]) = (slot, gx, gy);
        self.len += 1;
        self.strong += 1;
    }

    /// Replaces all pixels by these.
    pub fn refill(&mut self, slot: &[u32], gx: &[f32], gy: &[f32]) {
        let n = slot.len().min(gx.len()).min(gy.len());
        self.make_room(n);
        self.slot[..n].copy_from_slice(&slot[..n]);
        self.gx[..n].copy_from_slice(&gx[..n]);
        self.gy[..n].copy_from_slice(&gy[..n]);
        (self.len, self.strong) = (n, n);
    }

    fn make_room(&mut self, pixels: usize) {
        let capacity = pixels + ROOM;
        if self.slot.len() < capacity {
            self.slot.resize(capacity, 0);
            self.gx.resize(capacity, 0.0);
            self.gy.resize(capacity, 0.0);
            self.packed.resize(capacity, 0);
        }
    }
}

/// Finds edge pixels, with rows of scratch that are made once.
#[derive(Debug, Clone)]
pub struct Detector {
    smoother: Smoother,
    /// Three smoothed rows, row `v` in place `v % 3`, each one pixel wider than the region's columns on both sides.
    rows: [Vec<i16>; 3],
    /// The parts of rows that the spans' kernels reach, row by row: (row, first column, one past the last).
    parts: Vec<(usize, usize, usize)>,
}

/// Parts of a row that are closer than this are smoothed as one.
const GAP: usize = 32;

/// What the kernels of a region's spans reach.
fn reached(region: &Region) -> Vec<(usize, usize, usize)> {
    let around = |span: &Span| (span.v - 1..=span.v + 1).map(|v| (v, span.first - 1, span.end + 1)).collect::<Vec<_>>();
    let mut parts: Vec<_> = region.spans().iter().flat_map(around).collect();
    parts.sort_unstable();
    parts.dedup_by(|next, last| {
        let joins = next.0 == last.0 && next.1 <= last.2 + GAP;
        if joins {
            last.2 = last.2.max(next.2);
        }
        joins
    });
    parts
}

impl Detector {
    /// Scratch for a region.
    pub fn new(region: &Region, options: &EdgeOptions) -> Self {
        let width = region.columns().len() + 2;
        let smoother = Smoother::new(options.smoothing_px, width);
        let row = || if smoother.copies() { Vec::new() } else { vec![0; width] };
        let parts = if smoother.copies() { Vec::new() } else { reached(region) };
        Self { rows: [row(), row(), row()], smoother, parts }
    }

    /// Writes the pixels of the region with a gradient magnitude of at least `gradient_min` that pass the screen, in slot
    /// order.
    ///
    /// The image must have the size of the camera that the region was made for. Grows no vector that has room for the
    /// whole region. Gradients are exact without smoothing, and multiples of 1/8 with it.
    pub fn detect(
        &mut self,
        image: &ImageView<'_>,
        region: &Region,
        gradient_min: f64,
        screen: Option<&Screen>,
        out: &mut EdgePixels,
    ) {
        out.make_room(region.len());
        out.clear();
        if self.smoother.copies() {
            let least = least_squared::<u8>(gradient_min);
            for span in region.spans() {
                // The region keeps clear of the border.
                let row = |v: usize| image.row(v).get(span.first - 1..=span.end).unwrap_or(&[]);
                let rows = Rows { above: row(span.v - 1), middle: row(span.v), below: row(span.v + 1) };
                expect(row(span.v + AHEAD));
                keep(rows, span, least, screen, out);
            }
            finish::<u8>(out);
            return;
        }
        let (left, least) = (region.columns().start - 1, least_squared::<i16>(gradient_min));
        let mut parts = self.parts.iter().peekable();
        for span in region.spans() {
            while let Some((v, first, end)) = parts.next_if(|(v, ..)| *v <= span.v + 1) {
                let out = &mut self.rows[v % 3][first - left..end - left];
                expect(image.row(v + AHEAD).get(*first..*end).unwrap_or(&[]));
                self.smoother.fixed_row(image, *v, *first, out);
            }
            let columns = span.first - left - 1..span.end - left + 1;
            let [above, middle, below] = [span.v + 2, span.v, span.v + 1].map(|v| &self.rows[v % 3][columns.clone()]);
            keep(Rows { above, middle, below }, span, least, screen, out);
        }
        finish::<i16>(out);
    }
}

/// Rows that are asked for before they are needed: an image is rarely in the nearest cache.
const AHEAD: usize = 6;

/// The least squared gradient in the kernels' units. Casts of numbers that are too large give the largest, which no gradient
/// reaches.
fn least_squared<L: Level>(gradient_min: f64) -> i32 {
    (gradient_min * f64::from(L::PARTS)).powi(2).ceil() as i32
}

/// Appends the pixels of a span that pass, their gradients still packed.
fn keep<L: Level>(rows: Rows<'_, L>, span: &Span, at_least: i32, screen: Option<&Screen>, out: &mut EdgePixels)
where
    Dispatch: Sieve<L>,
{
    let n = span.end - span.first;
    if [rows.above, rows.middle, rows.below].iter().any(|row| row.len() != n + 2) {
        return;
    }
    let (vectors, limit) = screen.map_or((Vectors::None, 0.0), |screen| screen.of_span(span));
    let test = Test { at_least, vectors, limit };
    let kept = Kept { slots: &mut out.slot[out.len..], gradients: &mut out.packed[out.len..] };
    let (len, strong) = sieve(rows, n, span.slot as u32, &test, kept);
    (out.len, out.strong) = (out.len + len, out.strong + strong);
}

/// Unpacks the gradients.
fn finish<L: Level>(out: &mut EdgePixels) {
    let n = out.len;
    unpack(&out.packed[..n], 1.0 / L::PARTS as f32, &mut out.gx[..n], &mut out.gy[..n]);
}

/// Pixels that are tested together.
const BLOCK: usize = 32;

/// Calls with the place of each value that reaches the threshold.
#[inline(always)]
pub(super) fn reaching_in(values: &[f32], threshold: f32, mut with: impl FnMut(usize)) {
    for (block, start) in values.chunks(BLOCK).zip((0..values.len()).step_by(BLOCK)) {
        let mut strong = reaching(block, threshold);
        while strong != 0 {
            with(start + strong.trailing_zeros() as usize);
            strong &= strong - 1;
        }
    }
}

/// One bit for each pixel of a block, at most 32, that reaches the threshold.
#[inline(always)]
fn reaching(block: &[f32], threshold: f32) -> u32 {
    #[cfg(target_arch = "x86_64")]
    if let Ok(block) = <&[f32; BLOCK]>::try_from(block) {
        return reaching_sse2(block, threshold);
    }
    reaching_scalar(block, threshold)
}

#[inline(always)]
fn reaching_scalar(block: &[f32], threshold: f32) -> u32 {
    block.iter().enumerate().fold(0, |bits, (i, x)| bits | (u32::from(*x >= threshold) << i))
}

/// [`reaching_scalar`] with the sign bits of four comparisons at once; SSE2 is part of every x86-64.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn reaching_sse2(block: &[f32; BLOCK], threshold: f32) -> u32 {
    use std::arch::x86_64::{_mm_cmpge_ps, _mm_movemask_ps, _mm_set1_ps, _mm_setr_ps};
    // SAFETY: these intrinsics take and give values only and need no more than SSE2, which every x86-64 has.
    unsafe {
        let limit = _mm_set1_ps(threshold);
        block.as_chunks::<4>().0.iter().rev().fold(0, |bits, [a, b, c, d]| {
            let signs = _mm_movemask_ps(_mm_cmpge_ps(_mm_setr_ps(*a, *b, *c, *d), limit));
            (bits << 4) | signs as u32
        })
    }
}

/// The 3x3 Scharr derivatives (3, 10, 3) of the middle row and their squared magnitude; rows are one pixel wider on both sides.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
pub(super) fn scharr(
    above: &[f32],
    middle: &[f32],
    below: &[f32],
    gx: &mut [f32],
    gy: &mut [f32],
    strength: &mut [f32],
) {
    let n = gx.len();
    let (above, middle, below) = (&above[..n + 2], &middle[..n + 2], &below[..n + 2]);
    let (gy, strength) = (&mut gy[..n], &mut strength[..n]);
    for i in 0..n {
        let x = 3.0 * ((above[i + 2] - above[i]) + (below[i + 2] - below[i])) + 10.0 * (middle[i + 2] - middle[i]);
        let y = 3.0 * ((below[i] - above[i]) + (below[i + 2] - above[i + 2])) + 10.0 * (below[i + 1] - above[i + 1]);
        gx[i] = x;
        gy[i] = y;
        strength[i] = x * x + y * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Equidistant, Model};
    use nalgebra::Matrix3;

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn vector_bits_equal_scalar_bits() {
        for seed in 0..200u32 {
            let block: [f32; BLOCK] = std::array::from_fn(|i| {
                (seed.wrapping_mul(747_796_405).wrapping_add((i as u32).wrapping_mul(277_803_737)) >> 20) as f32
            });
            for threshold in [0.0, 100.0, 2000.0, block[7], f32::NAN, f32::INFINITY] {
                assert_eq!(reaching_sse2(&block, threshold), reaching_scalar(&block, threshold));
            }
        }
    }

    #[test]
    fn gradients_equal_the_kernel_written_out() {
        let lens = Equidistant::new(20.0, 31.5, 29.5).unwrap();
        let camera = Camera::new(64, 60, Model::Equidistant(lens)).unwrap();
        let options = EdgeOptions { gradient_min: 300.0, elevation_max_rad: 1.5, ..EdgeOptions::default() };
        let region = Region::new(&camera, &Matrix3::identity(), &options, None).unwrap();
        let data: Vec<u8> = (0..64 * 60u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let image = ImageView::new(&data, 64, 60, 64).unwrap();
        let mut edges = EdgePixels::with_capacity(region.len());
        Detector::new(&region, &options).detect(&image, &region, options.gradient_min, None, &mut edges);

        let at = |u: usize, v: usize| i32::from(data[v * 64 + u]);
        let mut k = 0;
        for (slot, (u, v, _)) in region.pixels().enumerate() {
            let gx = 3 * (at(u + 1, v - 1) - at(u - 1, v - 1) + at(u + 1, v + 1) - at(u - 1, v + 1))
                + 10 * (at(u + 1, v) - at(u - 1, v));
            let gy = 3 * (at(u - 1, v + 1) - at(u - 1, v - 1) + at(u + 1, v + 1) - at(u + 1, v - 1))
                + 10 * (at(u, v + 1) - at(u, v - 1));
            if gx * gx + gy * gy >= 300 * 300 {
                assert_eq!((edges.slot()[k], region.place(slot)), (slot as u32, (u as u16, v as u16)));
                assert_eq!((edges.gx()[k], edges.gy()[k]), (gx as f32, gy as f32));
                k += 1;
            }
        }
        assert!(k > 100 && k == edges.len());
    }
}
