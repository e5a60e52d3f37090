//! Edge pixels: the Scharr gradient of the band's rows, and the pixels where it is strong.

use tiltvp_kernels::gradient::{
    BLOCK, Directions, GradientKernel, GradientLevel, KeptPixels, Level, Levels, PixelBlock, REACH, Threshold, place,
    widen_gradients,
};
use tiltvp_kernels::prefetch::prefetch_bytes;

use super::options::EdgeOptions;
use super::prefilter::Prefilter;
use super::region::{Region, Span};
use crate::image::{ImageView, Smoother};

/// Edge pixels in structure-of-arrays form, in slot order.
#[derive(Debug, Clone, Default)]
pub struct EdgePixels {
    slot: Vec<u32>,
    /// Row and column.
    place: Vec<u32>,
    gx: Vec<f32>,
    gy: Vec<f32>,
    /// Gradients as the detector's kernels write them.
    raw: [Vec<i16>; 2],
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

    /// How many pixels had a strong gradient, those included that a prefilter has kept out.
    pub fn strong(&self) -> usize {
        self.strong
    }

    /// Number of each pixel within the region.
    pub fn slot(&self) -> &[u32] {
        &self.slot[..self.len]
    }

    /// Row (in the upper half) and column (in the lower) of each pixel.
    pub fn place(&self) -> &[u32] {
        &self.place[..self.len]
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

    /// Appends the pixel `slot` of a region.
    pub fn push(&mut self, region: &Region, slot: u32, gx: f32, gy: f32) {
        let [x, y] = self.put_all(&[0], slot, place_of(region, slot));
        (x[0], y[0]) = (gx, gy);
    }

    /// Makes room for so many more.
    fn make_room_for(&mut self, more: usize) {
        if self.slot.len() < self.len + more {
            self.make_room(2 * self.len + more);
        }
    }

    /// Appends the pixels that are so far beyond a first one in their row, and returns where their gradients are to be written.
    pub(super) fn put_all(&mut self, beyond: &[u32], first_slot: u32, first_place: u32) -> [&mut [f32]; 2] {
        self.make_room_for(beyond.len());
        let new = self.len..self.len + beyond.len();
        for ((slot, place), beyond) in self.slot[new.clone()].iter_mut().zip(&mut self.place[new.clone()]).zip(beyond) {
            (*slot, *place) = (first_slot + beyond, first_place + beyond);
        }
        self.len = new.end;
        self.strong += beyond.len();
        [&mut self.gx[new.clone()], &mut self.gy[new]]
    }

    /// Replaces all pixels by those of others that pass a test of slot and gradient.
    pub fn refill_where(&mut self, others: &Self, test: impl Fn(u32, f32, f32) -> bool) {
        self.make_room(others.len);
        let mut len = 0;
        let pixels = others.slot().iter().zip(others.place()).zip(others.gx().iter().zip(others.gy()));
        for ((slot, place), (gx, gy)) in pixels {
            (self.slot[len], self.place[len], self.gx[len], self.gy[len]) = (*slot, *place, *gx, *gy);
            // One that does not pass is written over by the next.
            len += usize::from(test(*slot, *gx, *gy));
        }
        (self.len, self.strong) = (len, len);
    }

    /// Replaces all pixels by these of a region.
    pub fn refill(&mut self, region: &Region, slot: &[u32], gx: &[f32], gy: &[f32]) {
        let n = slot.len().min(gx.len()).min(gy.len());
        self.make_room(n);
        self.slot[..n].copy_from_slice(&slot[..n]);
        self.gx[..n].copy_from_slice(&gx[..n]);
        self.gy[..n].copy_from_slice(&gy[..n]);
        for (place, slot) in self.place.iter_mut().zip(&slot[..n]) {
            *place = place_of(region, *slot);
        }
        (self.len, self.strong) = (n, n);
    }

    fn make_room(&mut self, pixels: usize) {
        let capacity = pixels + 2 * BLOCK;
        if self.slot.len() < capacity {
            self.slot.resize(capacity, 0);
            self.place.resize(capacity, 0);
            self.gx.resize(capacity, 0.0);
            self.gy.resize(capacity, 0.0);
            self.raw.iter_mut().for_each(|raw| raw.resize(capacity, 0));
        }
    }
}

fn place_of(region: &Region, slot: u32) -> u32 {
    let (u, v) = region.place(slot as usize);
    place(usize::from(v), usize::from(u))
}

/// Finds edge pixels, with rows of scratch that are made once.
#[derive(Debug, Clone)]
pub struct Detector {
    smoother: Smoother,
    /// Smoothed rows, row `v` in place `v % ROWS`, each one pixel wider than the region's columns on both sides.
    levels: Vec<i16>,
    /// The parts of rows that the spans' kernels reach, row by row.
    parts: Vec<Part>,
    /// The spans.
    blocks: Vec<PixelBlock>,
    kernel: GradientKernel,
}

/// Columns `first..end` of row `v`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Part {
    v: usize,
    first: usize,
    end: usize,
}

/// Rows whose pixels are tested together. Only time depends on it.
const TOGETHER: usize = 8;

/// Smoothed rows that are kept: at least [`TOGETHER`] and their two neighbours, and a power of two, so that places are found by a
/// mask.
const ROWS: usize = 16;

/// Parts of a row that are closer than this, in pixels, are smoothed as one: about what beginning anew costs. Only time depends on it.
const GAP: usize = 32;

/// The spans of a region in blocks, in slot order.
fn blocks_of<L: GradientLevel>(region: &Region, kernel: &GradientKernel) -> Vec<PixelBlock> {
    let mut blocks = Vec::new();
    for span in region.spans() {
        for first in (span.first..span.end).step_by(BLOCK) {
            let own = kernel.mask::<L>(u64::MAX >> (first + BLOCK).saturating_sub(span.end));
            let slot = (span.slot + first - span.first) as u32;
            blocks.push(PixelBlock { own, slot, place: place(span.v, first) });
        }
    }
    blocks
}

/// What the kernels of a region's spans reach.
fn reached(region: &Region) -> Vec<Part> {
    let around = |span: &Span| {
        let (first, end) = (span.first - 1, span.end + 1);
        (span.v - 1..=span.v + 1).map(move |v| Part { v, first, end })
    };
    let mut parts: Vec<Part> = region.spans().iter().flat_map(around).collect();
    parts.sort_unstable();
    parts.dedup_by(|next, last| {
        let joins = next.v == last.v && next.first <= last.end + GAP;
        if joins {
            last.end = last.end.max(next.end);
        }
        joins
    });
    parts
}

impl Detector {
    /// Scratch for a region.
    pub fn new(region: &Region, options: &EdgeOptions) -> Self {
        let width = region.columns().len() + 2;
        let (smoother, kernel) = (Smoother::new(options.smoothing_px, width), GradientKernel::default());
        if smoother.copies() {
            let blocks = blocks_of::<u8>(region, &kernel);
            return Self { smoother, levels: Vec::new(), parts: Vec::new(), blocks, kernel };
        }
        let blocks = blocks_of::<i16>(region, &kernel);
        Self { smoother, levels: vec![0; ROWS * width + REACH], parts: reached(region), blocks, kernel }
    }

    /// Writes the pixels of the region with a gradient magnitude of at least `gradient_min` that pass the prefilter, in slot
    /// order.
    ///
    /// The region must be that which the detector was made for, and the image must have the size of its camera. Grows no
    /// vector that has room for the whole region. Gradients are exact without smoothing, and multiples of 1/8 with it.
    pub fn detect(
        &mut self,
        image: &ImageView<'_>,
        region: &Region,
        gradient_min: f64,
        prefilter: Option<&Prefilter>,
        out: &mut EdgePixels,
    ) {
        out.make_room(region.len());
        out.clear();
        let (directions, limit) = prefilter.map_or((Directions::None, 0.0), Prefilter::vectors);
        let [gx, gy] = &mut out.raw;
        let mut kept = KeptPixels { slots: &mut out.slot, places: &mut out.place, gx, gy, len: 0, strong: 0 };
        let unit = if self.smoother.copies() {
            let threshold = Threshold { at_least: least_squared::<u8>(gradient_min), directions, limit };
            let levels = Levels { data: image.data(), stride: image.stride(), places: usize::MAX, left: 0 };
            self.kernel.run(&levels, &self.blocks, &threshold, &mut kept);
            self.kernel.flush::<u8>(&mut kept);
            u8::PARTS
        } else {
            let threshold = Threshold { at_least: least_squared::<i16>(gradient_min), directions, limit };
            let (left, width) = (region.columns().start - 1, region.columns().len() + 2);
            let mut parts = self.parts.iter().peekable();
            for blocks in self.blocks.chunk_by(|a, b| a.v() / TOGETHER == b.v() / TOGETHER) {
                let last = blocks[blocks.len() - 1].v();
                while let Some(Part { v, first, end }) = parts.next_if(|part| part.v <= last + 1) {
                    prefetch_bytes(image.row(v + AHEAD).get(*first..*end).unwrap_or(&[]));
                    let row = &mut self.levels[v % ROWS * width..][first - left..end - left];
                    self.smoother.fixed_row(image, *v, *first, row);
                }
                let levels = Levels { data: &self.levels[..], stride: width, places: ROWS - 1, left };
                self.kernel.run(&levels, blocks, &threshold, &mut kept);
            }
            self.kernel.flush::<i16>(&mut kept);
            i16::PARTS
        };
        (out.len, out.strong) = (kept.len, kept.strong);
        let (n, unit) = (out.len, 1.0 / unit as f32);
        widen_gradients(&gx[..n], unit, &mut out.gx[..n]);
        widen_gradients(&gy[..n], unit, &mut out.gy[..n]);
    }
}

/// Rows that are asked for before they are needed: an image is rarely in the nearest cache. Only time depends on it.
const AHEAD: usize = 6;

/// The least squared gradient in the kernels' units. Casts of numbers that are too large give the largest, which no gradient
/// reaches.
fn least_squared<L: Level>(gradient_min: f64) -> i32 {
    (gradient_min * f64::from(L::PARTS)).powi(2).ceil() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Equidistant, Model};
    use nalgebra::Matrix3;

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
