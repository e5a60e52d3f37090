//! What is done with places: levels of the old image are taken there, or the places are written down.

use nalgebra::Vector2;
use tiltvp_kernels::remap::{COLUMNS, Patch, fill_color, fill_gray};

use super::grid::{Cell, Sink};

/// From the last column and row: what is rounded in the kernel's places, half a weight of 1/256, must not reach beyond them.
const MARGIN_PX: f64 = 0.01;

/// Pixels that a cell may span in the old image, so that the kernel's numbers of 24 bits tell a tenth of a weight.
const LARGEST_PX: f64 = 2048.0;

/// An image of one or three bytes a pixel, without gaps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a, const CHANNELS: usize> {
    pub(super) data: &'a [u8],
    pub(super) width: usize,
    pub(super) height: usize,
    /// Whether the last column is beside the first, and beyond a pole lies the other half of the first row.
    pub(super) is_round: bool,
}

impl<const CHANNELS: usize> Source<'_, CHANNELS> {
    /// The levels of a pixel that may be a step outside: beyond the edge they go on as they are at it, about a panorama as there.
    fn at(&self, u: i64, v: i64) -> [f64; CHANNELS] {
        let (width, height) = (self.width as i64, self.height as i64);
        let row = v.clamp(0, height - 1);
        let column = match self.is_round {
            false => u.clamp(0, width - 1),
            true if v == row => u.rem_euclid(width),
            true => (u + width / 2).rem_euclid(width),
        };
        let first = (row as usize * self.width + column as usize) * CHANNELS;
        std::array::from_fn(|channel| f64::from(self.data[first + channel]))
    }

    /// Between four pixels; none half a pixel outside of the image and farther.
    fn between(&self, place: &Vector2<f64>) -> Option<[u8; CHANNELS]> {
        let inside = |at: f64, count: usize| (-0.5..count as f64 - 0.5).contains(&at);
        if !(inside(place.y, self.height) && (self.is_round || inside(place.x, self.width))) {
            return None;
        }
        // As many steps from one pixel to the next as in the kernel, so that there is no seam between what the two have made.
        let [u, v] = [place.x, place.y].map(|at| floor(at * 256.0 + 0.5));
        let [right, below] = [u, v].map(|at| (at & 255) as f64 / 256.0);
        let (u, v) = (u >> 8, v >> 8);
        let [a, b, c, d] = [(u, v), (u + 1, v), (u, v + 1), (u + 1, v + 1)].map(|(u, v)| self.at(u, v));
        Some(std::array::from_fn(|k| {
            let (above, under) = (a[k] + (b[k] - a[k]) * right, c[k] + (d[k] - c[k]) * right);
            (above + (under - above) * below + 0.5) as u8
        }))
    }
}

/// The same as the function of floats, by instructions that every processor has.
fn floor(x: f64) -> i64 {
    let cut = x as i64;
    if (cut as f64) > x { cut - 1 } else { cut }
}

/// Fills an image.
pub(super) struct Fill<'a, const CHANNELS: usize> {
    pub(super) source: Source<'a, CHANNELS>,
    pub(super) out: &'a mut [u8],
    pub(super) width: usize,
}

impl<const CHANNELS: usize> Fill<'_, CHANNELS> {
    /// By the kernel, where all places have neighbours in the image.
    fn at_once(&mut self, cell: &Cell) -> bool {
        let (low, high) = cell.places.bounds(cell.size);
        let last = Vector2::new(self.source.width as f64 - 1.0, self.source.height as f64 - 1.0);
        let origin = low.map(|at| floor(at) as f64);
        let is_inside = low.min() >= 0.0 && (last - high).min() >= MARGIN_PX && (high - origin).max() < LARGEST_PX;
        if !is_inside {
            return false;
        }
        let place = (origin.y as usize * self.source.width + origin.x as usize) * CHANNELS;
        let Ok(origin_byte) = u32::try_from(place) else { return false };
        let (stride, out_stride) = (self.source.width * CHANNELS, self.width * CHANNELS);
        for column in (0..cell.size[0]).step_by(COLUMNS) {
            let from_here = cell.places.starting_at(column);
            let patch = Patch {
                size: [COLUMNS.min(cell.size[0] - column), cell.size[1]],
                places: [from_here.along(0, origin.x), from_here.along(1, origin.y)],
                origin: origin_byte,
            };
            let out = &mut self.out[(cell.first[1] * self.width + cell.first[0] + column) * CHANNELS..];
            let is_filled = match CHANNELS {
                1 => fill_gray(self.source.data, stride, &patch, out, out_stride),
                3 => fill_color(self.source.data, stride, &patch, out, out_stride),
                _ => false,
            };
            if !is_filled {
                return false;
            }
        }
        true
    }
}

impl<const CHANNELS: usize> Sink for Fill<'_, CHANNELS> {
    fn cell(&mut self, cell: &Cell) {
        if !self.at_once(cell) {
            one_by_one(cell, self);
        }
    }

    fn pixel(&mut self, [u, v]: [usize; 2], place: Vector2<f64>) {
        if let Some(levels) = self.source.between(&place) {
            self.out[(v * self.width + u) * CHANNELS..][..CHANNELS].copy_from_slice(&levels);
        }
    }
}

/// Writes places down.
pub(super) struct Map<'a> {
    pub(super) out: &'a mut [[f32; 2]],
    pub(super) width: usize,
    /// Columns of a panorama, to whose images places are brought back.
    pub(super) period: Option<f64>,
}

impl Sink for Map<'_> {
    fn cell(&mut self, cell: &Cell) {
        one_by_one(cell, self);
    }

    fn pixel(&mut self, [u, v]: [usize; 2], mut place: Vector2<f64>) {
        if let Some(period) = self.period {
            place.x = (place.x + 0.5).rem_euclid(period) - 0.5;
        }
        self.out[v * self.width + u] = [place.x as f32, place.y as f32];
    }
}

/// Each pixel of a cell with its interpolated place.
fn one_by_one(cell: &Cell, sink: &mut impl Sink) {
    for (row, column) in (0..cell.size[1]).flat_map(|row| (0..cell.size[0]).map(move |column| (row, column))) {
        sink.pixel([cell.first[0] + column, cell.first[1] + row], cell.places.at([column, row]));
    }
}
