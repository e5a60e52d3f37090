//! Bearings of places between pixel centres, from a table of those of the centres.

use nalgebra::Vector2;

use super::chains::Window;
use crate::camera::Camera;

/// The bearings of the pixels of a window, in the camera frame; NaN where the lens has no answer.
#[derive(Debug, Clone)]
pub(super) struct Bearings {
    table: Vec<[f32; 3]>,
    width: usize,
}

impl Bearings {
    pub(super) fn new(camera: &Camera, window: &Window) -> Self {
        let Window { left, top, width, height } = *window;
        let at = |i: usize| {
            let pixel = Vector2::new((left + i % width) as f64, (top + i / width) as f64);
            camera.unproject(&pixel).map_or([f32::NAN; 3], |b| [b.x as f32, b.y as f32, b.z as f32])
        };
        Self { table: (0..width * height).map(at).collect(), width }
    }

    /// The bearing at a shift of less than a pixel from the pixel of a place, and the change of the bearing by one pixel along
    /// a unit vector of the image. First differences: within a pixel bearings bend by some millionths of a radian.
    #[inline(always)]
    pub(super) fn at(&self, place: usize, shift: [f32; 2], unit: [f32; 2]) -> ([f32; 3], [f32; 3]) {
        let here = self.table[place];
        let (left, right) = (self.table[place - 1], self.table[place + 1]);
        let (above, below) = (self.table[place - self.width], self.table[place + self.width]);
        let (mut bearing, mut change) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let (du, dv) = (0.5 * (right[k] - left[k]), 0.5 * (below[k] - above[k]));
            bearing[k] = here[k] + du * shift[0] + dv * shift[1];
            change[k] = du * unit[0] + dv * unit[1];
        }
        (bearing, change)
    }
}
