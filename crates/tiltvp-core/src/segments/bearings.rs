//! Bearings of places between pixel centres, from a quadratic for each small square of the image.

use nalgebra::{Matrix6, SMatrix, Vector2, Vector6};

use super::chains::Window;
use crate::camera::Camera;
use crate::parallel;

/// Pixels along a side of a square. Within it the third derivative of a lens is left out: half a square is a thirtieth of a radian or
/// less of it, and a sixth of its cube a thousandth of a pixel.
const SIDE: usize = 8;

/// Places along a side of a square at which the lens is asked.
const SAMPLES: usize = 5;

/// Squares that take about as long as the entries of a table between two looks whether to end: each asks the lens 25 times.
const BLOCK: usize = 128;

/// Least number of answers of the lens in a square, for six unknowns.
const ANSWERS_MIN: usize = 8;

/// The six coefficients of 1, x, y, x^2, x y, y^2 for each coordinate, x and y in half squares from the middle; of four coordinates,
/// of which the last is nothing, so that all are one vector.
type Quadratic = [[f32; 4]; 6];

/// The bearings of a window in the camera frame; NaN where the lens has no answer.
#[derive(Debug, Clone)]
pub(super) struct Bearings {
    squares: Vec<Quadratic>,
    across: usize,
    origin: [f32; 2],
}

impl Bearings {
    pub(super) fn new(camera: &Camera, window: &Window) -> Self {
        let Window { left, top, width, height } = *window;
        let (across, down) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
        let square = |i: usize| quadratic(camera, (left + i % across * SIDE) as f64, (top + i / across * SIDE) as f64);
        let squares = parallel::table_in_blocks(across * down, BLOCK, square);
        Self { squares, across, origin: [left as f32, top as f32] }
    }

    /// The unit bearing at a place of the window, but for some millionths, and its change by one pixel along a unit vector of the
    /// image; of four coordinates each, of which the last says nothing.
    #[inline(always)]
    pub(super) fn at(&self, [u, v]: [f32; 2], unit: [f32; 2]) -> [[f32; 4]; 2] {
        let (u, v) = (u - self.origin[0], v - self.origin[1]);
        // Places are far below what 32 bits hold, and those are faster to make.
        let (column, row) = (u as i32 as usize / SIDE, v as i32 as usize / SIDE);
        let [c0, cx, cy, cxx, cxy, cyy] = &self.squares[row * self.across + column];
        let (x, y) = (scaled(u - (column * SIDE) as f32), scaled(v - (row * SIDE) as f32));
        let (mut bearing, mut change) = ([0.0; 4], [0.0; 4]);
        for k in 0..4 {
            bearing[k] = c0[k] + x * (cx[k] + x * cxx[k] + y * cxy[k]) + y * (cy[k] + y * cyy[k]);
            let (du, dv) = (cx[k] + 2.0 * x * cxx[k] + y * cxy[k], cy[k] + 2.0 * y * cyy[k] + x * cxy[k]);
            change[k] = (du * unit[0] + dv * unit[1]) * PER_PIXEL;
        }
        [bearing, change]
    }
}

/// Half squares in a pixel.
const PER_PIXEL: f32 = 2.0 / SIDE as f32;

/// Half squares from the middle of a square, whose pixels are the next whole numbers, `from_first` pixels from the first.
#[inline(always)]
fn scaled(from_first: f32) -> f32 {
    (from_first - 0.5 * (SIDE - 1) as f32) * PER_PIXEL
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
