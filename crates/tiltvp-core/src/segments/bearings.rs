//! Bearings of places between pixel centres, from a quadratic for each small square of the image.

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector2, Vector6};
use tiltvp_kernels::quadratic::{Grid, Located, PER_PIXEL, Quadratic, SIDE, evaluate};

use super::chains::Window;
use crate::camera::{Camera, STEP, bearings, cubic};
use crate::edges::RidgePixels;
use crate::parallel;

/// Places along a side of a square at which the lens is asked.
const SAMPLES: usize = 5;

/// Squares that take about as long as the entries of a table between two looks whether to end: each asks the lens 25 times.
const BLOCK: usize = 128;

/// Least number of answers of the lens in a square, for six unknowns.
const ANSWERS_MIN: usize = 8;

const _: () = assert!(SIDE == STEP);

/// The bearings of a window in the camera frame; NaN where the lens has no answer.
#[derive(Debug, Clone)]
pub(super) struct Bearings {
    squares: Vec<Quadratic>,
    grid: Grid,
}

impl Bearings {
    pub(super) fn new(camera: &Camera, window: &Window) -> Self {
        let Window { left, top, width, height } = *window;
        let [first, end] = [[left, top], [left + width, top + height]];
        let [first, end] = [first.map(|side| side / SIDE), end.map(|side| side.div_ceil(SIDE))];
        let [across, down] = [end[0] - first[0], end[1] - first[1]];
        let lens = bearings(camera, &Matrix3::identity());
        // What each node adds to the quadratic where the cubics hold, so that the lens need not be asked 25 times.
        let of_nodes = fitted(|at| {
            let [across, down] = at.map(|at| cubic(at / SIDE as f64));
            Some(SVector::<f64, 16>::from_fn(|k, _| down[k / 4] * across[k % 4]))
        });
        let square = |i: usize| {
            let number = [first[0] + i % across, first[1] + i / across];
            let [u, v] = number.map(|number| (number * SIDE) as f64);
            kept(match (lens.around(number), &of_nodes) {
                (Some(nodes), Some(of_nodes)) => {
                    Some(of_nodes * SMatrix::<f64, 3, 16>::from_columns(&nodes).transpose())
                }
                _ => fitted(|[du, dv]| camera.unproject(&Vector2::new(u + du, v + dv))),
            })
        };
        let squares = parallel::table_in_blocks(across * down, BLOCK, square);
        Self { squares, grid: Grid { origin: first.map(|side| (side * SIDE) as u32), across: across as u32 } }
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

/// Least squares over the places of a square, told from its first pixel, where there is a value.
fn fitted<const N: usize>(value: impl Fn([f64; 2]) -> Option<SVector<f64, N>>) -> Option<SMatrix<f64, 6, N>> {
    let (mut moments, mut sums, mut answers) = (Matrix6::zeros(), SMatrix::<f64, 6, N>::zeros(), 0);
    let step = SIDE as f64 / SAMPLES as f64;
    for i in 0..SAMPLES * SAMPLES {
        let at = [i % SAMPLES, i / SAMPLES].map(|k| (k as f64 + 0.5) * step - 0.5);
        if let Some(value) = value(at) {
            let [x, y] = at.map(|at| (at - 0.5 * (SIDE - 1) as f64) * f64::from(PER_PIXEL));
            let row = Vector6::new(1.0, x, y, x * x, x * y, y * y);
            moments += row * row.transpose();
            sums += row * value.transpose();
            answers += 1;
        }
    }
    if answers < ANSWERS_MIN { None } else { moments.cholesky().map(|cholesky| cholesky.solve(&sums)) }
}

/// The quadratic as it is kept; NaN where there is none.
fn kept(coefficients: Option<SMatrix<f64, 6, 3>>) -> Quadratic {
    let mut out = [[f32::NAN; 4]; 6];
    if let Some(coefficients) = coefficients {
        for (own, row) in out.iter_mut().zip(coefficients.row_iter()) {
            *own = [row[0] as f32, row[1] as f32, row[2] as f32, 0.0];
        }
    }
    out
}
