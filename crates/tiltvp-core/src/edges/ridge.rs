//! Ridge pixels: edge pixels thinned to one pixel across the edge, with the place of the edge between pixels.

use tiltvp_kernels::gradient::place;
use tiltvp_kernels::marks::{BEYOND, places};
use tiltvp_kernels::ridge::{Around, KeptRidge, MARKED, keep, mark, mark_directed, scharr, tops};

use super::detect::EdgePixels;
use super::options::EdgeOptions;
use super::prefilter::Prefilter;
use super::region::Region;
use crate::image::{ImageView, Smoother};
use crate::interrupt::check;

/// Edge pixels of greatest gradient magnitude across their edge, in slot order.
#[derive(Debug, Clone, Default)]
pub struct RidgePixels {
    /// The pixels and their gradients.
    pub edges: EdgePixels,
    shift_px: Vec<f32>,
    /// Squared magnitudes before, at and after the pixels, across their edges.
    across: [Vec<f32>; 3],
}

impl RidgePixels {
    /// How far beyond each pixel's centre the edge is, in `[-0.5, 0.5]`: along `u` where `|gx| >= |gy|`, along `v` elsewhere.
    ///
    /// The magnitudes in a row (or column) across a straight edge are the edge's profile, stretched: the top of the parabola
    /// through three of them is on the edge, whatever its slope.
    pub fn shift_px(&self) -> &[f32] {
        &self.shift_px
    }
}

/// One row of gradients.
#[derive(Debug, Clone)]
struct Gradients {
    gx: Vec<f32>,
    gy: Vec<f32>,
    strength: Vec<f32>,
}

/// Finds ridge pixels, with rows of scratch that are made once. The region must have been made with a margin of at least 1.
#[derive(Debug, Clone)]
pub struct RidgeDetector {
    smoother: Smoother,
    /// Three smoothed rows, row `v` in place `v % 3`, each at least two pixels wider than the region's columns on both sides.
    smoothed: [Vec<f32>; 3],
    /// Three rows of gradients, row `v` in place `v % 3`, each at least one pixel wider than the region's columns on both sides.
    gradients: [Gradients; 3],
    marks: Vec<u8>,
    /// Columns of a span that are marked.
    marked: Vec<u32>,
    /// The prefilter's vectors of a span, where they are not stored.
    vectors: Vec<[i16; 2]>,
}

impl RidgeDetector {
    /// Scratch for a region.
    pub fn new(region: &Region, options: &EdgeOptions) -> Self {
        let width = region.columns().len() + 4;
        let row = || vec![0.0; width + MARKED];
        let gradients = || Gradients { gx: row(), gy: row(), strength: row() };
        Self {
            smoother: Smoother::new(options.smoothing_px, width),
            smoothed: [row(), row(), row()],
            gradients: [gradients(), gradients(), gradients()],
            marks: vec![0; width + MARKED],
            marked: vec![0; width + BEYOND],
            vectors: Vec::new(),
        }
    }

    /// Writes the ridge pixels of the region with a gradient magnitude of at least `gradient_min` that pass the prefilter.
    ///
    /// The image must have the size of the camera that the region was made for.
    pub fn detect(
        &mut self,
        image: &ImageView<'_>,
        region: &Region,
        gradient_min: f64,
        prefilter: Option<&Prefilter>,
        out: &mut RidgePixels,
    ) {
        let least = (gradient_min * gradient_min) as f32;
        let RidgePixels { edges, shift_px, across } = out;
        let [before, middle, after] = across;
        edges.clear();
        [&mut *before, middle, after].into_iter().for_each(Vec::clear);
        // The region keeps two pixels clear of the border.
        let left = region.columns().start.saturating_sub(2);
        let inner = region.columns().len() + 2;
        let (mut next_row, mut next_gradient) = (0, 0);
        for span in region.spans() {
            check();
            for row in next_gradient.max(span.v.saturating_sub(1))..=span.v + 1 {
                for v in next_row.max(row.saturating_sub(1))..=row + 1 {
                    self.smoother.row(image, v, left, &mut self.smoothed[v % 3][..inner + 2]);
                }
                next_row = row + 2;
                let [above, middle, below] = [row + 2, row, row + 1].map(|v| &self.smoothed[v % 3][..inner + 2]);
                let Gradients { gx, gy, strength } = &mut self.gradients[row % 3];
                scharr(above, middle, below, &mut gx[..inner], &mut gy[..inner], &mut strength[..inner]);
            }
            next_gradient = span.v + 2;
            let n = span.end - span.first;
            // Gradients begin one column to the right of `left`.
            let first = span.first - left - 1;
            let [above, here, below] = [span.v + 2, span.v, span.v + 1].map(|v| &self.gradients[v % 3]);
            // Whole blocks: what comes after the span is not looked at.
            let wide = n.next_multiple_of(MARKED);
            let around = Around {
                gx: &here.gx[first..first + wide],
                gy: &here.gy[first..first + wide],
                above: &above.strength[first..first + wide],
                here: &here.strength[first - 1..=first + wide],
                below: &below.strength[first..first + wide],
            };
            let marks = &mut self.marks[..wide];
            match prefilter {
                Some(prefilter) => {
                    let (vectors, limit) = prefilter.of_span(span, wide, &mut self.vectors);
                    mark_directed(&around, least, vectors, limit, marks);
                }
                None => mark(&around, least, marks),
            }
            let count = places(&marks[..n], &mut self.marked);
            let marked = &self.marked[..count];
            let across = [&mut *before, &mut *middle, &mut *after].map(|values| {
                let first = values.len();
                values.resize(first + count, 0.0);
                &mut values[first..]
            });
            let [gx, gy] = edges.put_all(marked, span.slot as u32, place(span.v, span.first));
            keep(&around, marked, KeptRidge { gx, gy, across });
        }
        shift_px.resize(middle.len(), 0.0);
        tops(before, middle, after, shift_px);
    }
}
