//! Ridge pixels: edge pixels thinned to one pixel across the edge, with the place of the edge between pixels.

use super::detect::{EdgePixels, reaching_in, scharr};
use super::options::EdgeOptions;
use super::region::Region;
use super::screen::Screen;
use crate::image::{ImageView, Smoother};

/// Edge pixels of greatest gradient magnitude across their edge, in slot order.
#[derive(Debug, Clone, Default)]
pub struct RidgePixels {
    /// The pixels and their gradients.
    pub edges: EdgePixels,
    shift_px: Vec<f32>,
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
    /// Three smoothed rows, row `v` in place `v % 3`, each two pixels wider than the region's columns on both sides.
    smoothed: [Vec<f32>; 3],
    /// Three rows of gradients, row `v` in place `v % 3`, each one pixel wider than the region's columns on both sides.
    gradients: [Gradients; 3],
    marked: Vec<f32>,
}

impl RidgeDetector {
    /// Scratch for a region.
    pub fn new(region: &Region, options: &EdgeOptions) -> Self {
        let width = region.columns().len() + 4;
        let row = || vec![0.0; width];
        let gradients = || Gradients { gx: row(), gy: row(), strength: row() };
        Self {
            smoother: Smoother::new(options.smoothing_px, width),
            smoothed: [row(), row(), row()],
            gradients: [gradients(), gradients(), gradients()],
            marked: row(),
        }
    }

    /// Writes the ridge pixels of the region with a gradient magnitude of at least `gradient_min` that pass the screen.
    ///
    /// The image must have the size of the camera that the region was made for.
    pub fn detect(
        &mut self,
        image: &ImageView<'_>,
        region: &Region,
        gradient_min: f64,
        screen: Option<&Screen>,
        out: &mut RidgePixels,
    ) {
        let threshold_squared = (gradient_min * gradient_min) as f32;
        out.edges.clear();
        out.shift_px.clear();
        // The region keeps two pixels clear of the border.
        let left = region.columns().start.saturating_sub(2);
        let inner = region.columns().len() + 2;
        let (mut next_row, mut next_gradient) = (0, 0);
        for span in region.spans() {
            for row in next_gradient.max(span.v.saturating_sub(1))..=span.v + 1 {
                for v in next_row.max(row.saturating_sub(1))..=row + 1 {
                    self.smoother.row(image, v, left, &mut self.smoothed[v % 3]);
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
            let columns = first..first + n;
            let marked = &mut self.marked[..n];
            marked.copy_from_slice(&here.strength[columns.clone()]);
            if let Some(screen) = screen {
                screen.apply(span, &here.gx[columns.clone()], &here.gy[columns], marked);
            }
            reaching_in(marked, threshold_squared, |i| {
                let (at, gx, gy) = (first + i, here.gx[first + i], here.gy[first + i]);
                let (before, after) = if gx.abs() >= gy.abs() {
                    (here.strength[at - 1], here.strength[at + 1])
                } else {
                    (above.strength[at], below.strength[at])
                };
                let middle = here.strength[at];
                if middle > before && middle >= after {
                    out.edges.push(region, (span.slot + i) as u32, gx, gy);
                    out.shift_px.push(top_of(before.sqrt(), middle.sqrt(), after.sqrt()));
                }
            });
        }
    }
}

/// Where the parabola through three values at -1, 0 and 1 is highest.
fn top_of(before: f32, middle: f32, after: f32) -> f32 {
    let bend = 2.0 * middle - before - after;
    if bend > 0.0 { (0.5 * (after - before) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}
