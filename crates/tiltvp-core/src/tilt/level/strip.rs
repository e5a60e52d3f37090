//! Rows of the map from a level image to the leaning one, as they are written down.

use std::ops::Range;

use nalgebra::Vector2;
use tiltvp_kernels::surface::{Inside, Surface as Numbers, keep_inside, keep_seen, write};

use super::places::{Limit, is_panorama};
use super::shown::Shown;
use super::surface::{CELL, Cell};
use crate::camera::Camera;

/// From the border of the image: what is rounded where places are written must not reach beyond it unseen.
const MARGIN_PX: f64 = 0.01;

/// Columns and rows in the leaning image of some rows of the level one.
pub(super) struct Strip<'a> {
    /// Of the level image; those of whole cells.
    rows: Range<usize>,
    /// The column and the row of each pixel.
    places: [&'a mut [f32]; 2],
    /// Pixels in a row of the level image.
    width: usize,
    image: Inside,
    /// Rays of a cell.
    rays: [[f32; CELL * CELL]; 3],
}

impl<'a> Strip<'a> {
    pub(super) fn new(
        rows: Range<usize>,
        places: [&'a mut [f32]; 2],
        width: usize,
        camera: &Camera,
        unseen: f32,
    ) -> Self {
        let [columns, last_row] = [camera.width() as f32, camera.height() as f32 - 1.0];
        let image = if is_panorama(camera) {
            Inside { last: [columns, last_row], period: columns, unseen }
        } else {
            Inside { last: [columns - 1.0, last_row], period: 0.0, unseen }
        };
        Self { rows, places, width, image, rays: [[0.0; CELL * CELL]; 3] }
    }

    /// Those that are written, of the level image.
    pub(super) fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// Leaves of the pixels of a cell those that are shown and within a limit.
    pub(super) fn keep(&mut self, first: [usize; 2], size: [usize; 2], limit: Option<Limit>, shown: &Shown) {
        let (axis, least) = limit.map_or(([0.0; 3], 0.0), |limit| (limit.axis.cast().into(), limit.least as f32));
        let at = self.at(first);
        let (rays, stride) = shown.rays(first, size, &mut self.rays);
        let places = self.places.each_mut().map(|numbers| &mut numbers[at..]);
        keep_seen(rays, stride, size, (axis, least), places, self.width, self.image.unseen);
    }

    /// Pixels that are not seen.
    pub(super) fn clear(&mut self, first: [usize; 2], size: [usize; 2]) {
        let at = self.at(first);
        for numbers in &mut self.places {
            for row in numbers[at..].chunks_mut(self.width).take(size[1]) {
                row[..size[0]].fill(self.image.unseen);
            }
        }
    }

    /// Pixels whose places are interpolated.
    pub(super) fn cell(&mut self, cell: &Cell) {
        let at = self.at(cell.first);
        let [columns, rows] = &mut self.places;
        for (axis, out) in [&mut *columns, &mut *rows].into_iter().enumerate() {
            let (terms, origin) = cell.places.along(axis);
            write(&Numbers { terms, origin }, cell.size, &mut out[at..], self.width);
        }
        let last = Vector2::from(self.image.last.map(f64::from));
        if cell.places.low.min() < MARGIN_PX || (last - cell.places.high).min() < MARGIN_PX {
            keep_inside(&self.image, cell.size, [&mut columns[at..], &mut rows[at..]], self.width);
        }
    }

    /// A pixel with its place.
    pub(super) fn pixel(&mut self, pixel: [usize; 2], place: Vector2<f64>) {
        let at = self.at(pixel);
        let [columns, rows] = &mut self.places;
        (columns[at], rows[at]) = (place.x as f32, place.y as f32);
        keep_inside(&self.image, [1, 1], [&mut columns[at..], &mut rows[at..]], self.width);
    }

    fn at(&self, [u, v]: [usize; 2]) -> usize {
        (v - self.rows.start) * self.width + u
    }
}
