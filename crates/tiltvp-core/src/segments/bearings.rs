//! Bearings of places between pixel centres, from a quadratic for each small square of the image.

use nalgebra::{Matrix6, SMatrix, Vector2, Vector6};
use tiltvp_kernels::quadratic::{Grid, Located, PER_PIXEL, Quadratic, SIDE, evaluate};

use super::chains::Window;
use crate::camera::Camera;
use crate::edges::RidgePixels;
use crate::parallel;

/// Places along a side of a square at which the lens is asked.
const SAMPLES: usize = 5;

/// Squares that take about as long as the entries of a table between two looks whether to end: each asks the lens 25 times.
const BLOCK: usize = 128;

/// Least number of answers of the lens in a square, for six unknowns.
const ANSWERS_MIN: usize = 8;

/// The bearings of a window in the camera frame; NaN where the lens has no answer.
#[derive(Debug, Clone)]
pub(super) struct Bearings {
    squares: Vec<Quadratic>,
    grid: Grid,
}

impl Bearings {
    pub(super) fn new(camera: &Camera, window: &Window) -> Self {
        let Window { left, top, width, height } = *window;
        let (across, down) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
        let square = |i: usize| quadratic(camera, (left + i % across * SIDE) as f64, (top + i / across * SIDE) as f64);
        let squares = parallel::table_in_blocks(across * down, BLOCK, square);
        Self { squares, grid: Grid { origin: [left as u32, top as u32], across: across as u32 } }
    }

    /// Writes down where the edge passes each ridge pixel.
    pub(super) fn locate(&self, ridge: &RidgePixels, out: &mut Located) {
        let edges = &ridge.edges;
        out.locate(self.grid, edges.place(), ridge.shift_px(), [edges.gx(), edges.gy()]);
    }

    /// The unit bearings of some of these, but for some millionths, with the pixels in a radian across the edge as fourth coordinate, and
    /// their changes by one pixel along the unit vector of each. `out` is scratch.
    pub(super) fn of<'a>(
        &self,
        located: &Located,
        units: &[[f32; 2]],
        numbers: &[u32],
        out: &'a mut Vec<[[f32; 4]; 2]>,
    ) -> &'a [[[f32; 4]; 2]] {
        if out.len() < numbers.len() {
            out.resize(numbers.len(), [[0.0; 4]; 2]);
        }
        let out = &mut out[..numbers.len()];
        evaluate(&self.squares, located, units, numbers, out);
        out
    }
}

/// Least squares of a square whose first pixel is `(u, v)`, over the places where the lens has an answer.
fn quadratic(camera: &Camera, u: f64, v: f64) -> Quadratic {
    let (mut moments, mut sums, mut answers) = (Matrix6::zeros(), SMatrix::<f64, 6, 3>::zeros(), 0);
    let step = SIDE as f64 / SAMPLES as f64;
    for i in 0..SAMPLES * SAMPLES {
        let at = |k: usize| (k as f64 + 0.5) * step - 0.5;
        let (du, dv) = (at(i % SAMPLES), at(i / SAMPLES));
        if let Some(bearing) = camera.unproject(&Vector2::new(u + du, v + dv)) {
            let middle = 0.5 * (SIDE - 1) as f64;
            let (x, y) = ((du - middle) * f64::from(PER_PIXEL), (dv - middle) * f64::from(PER_PIXEL));
            let row = Vector6::new(1.0, x, y, x * x, x * y, y * y);
            moments += row * row.transpose();
            sums += row * bearing.transpose();
            answers += 1;
        }
    }
    let solved = if answers < ANSWERS_MIN { None } else { moments.cholesky().map(|cholesky| cholesky.solve(&sums)) };
    let mut out = [[f32::NAN; 4]; 6];
    if let Some(coefficients) = solved {
        for (own, row) in out.iter_mut().zip(coefficients.row_iter()) {
            *own = [row[0] as f32, row[1] as f32, row[2] as f32, 0.0];
        }
    }
    out
}
