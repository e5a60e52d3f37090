//! Vectors at places between pixels, by a quadratic for each small square of an image.

use fearless_simd::{Simd, SimdBase as _, dispatch, f32x4};

use crate::level::loops;
use crate::vectorised;

/// Pixels along a side of a square. Within it the third derivative of a lens is left out: half a square is a thirtieth of a radian or
/// less of it, and a sixth of its cube a thousandth of a pixel.
pub const SIDE: usize = 8;

/// Half squares in a pixel.
pub const PER_PIXEL: f32 = 2.0 / SIDE as f32;

/// The six coefficients of 1, x, y, x^2, x y, y^2 for each coordinate, x and y in half squares from the middle; of four coordinates,
/// of which the last is nothing, so that all are one vector.
pub type Quadratic = [[f32; 4]; 6];

/// Where a square begins and how many there are in a row.
#[derive(Debug, Clone, Copy, Default)]
pub struct Grid {
    /// The first pixel of the first square.
    pub origin: [u32; 2],
    /// Squares in a row.
    pub across: u32,
}

/// Places in a grid of squares, side by side.
#[derive(Debug, Clone, Default)]
pub struct Located {
    /// Column and row.
    pub pixel: Vec<[f32; 2]>,
    /// The number of the square.
    pub square: Vec<u32>,
    /// In half squares from its middle.
    pub within: Vec<[f32; 2]>,
}

impl Located {
    /// Replaces all by pixels, row in the upper half and column in the lower, shifted along `u` where `|gx| >= |gy|` and along `v`
    /// elsewhere. No place is before the grid's first.
    ///
    /// # Panics
    /// If there are fewer shifts or gradients than pixels.
    pub fn locate(&mut self, grid: Grid, packed: &[u32], shifts: &[f32], gradients: [&[f32]; 2]) {
        let n = packed.len();
        let Self { pixel, square, within } = self;
        pixel.resize(n, [0.0; 2]);
        square.resize(n, 0);
        within.resize(n, [0.0; 2]);
        locate(grid, packed, shifts, gradients, pixel, square, within);
    }
}

vectorised! {
    fn locate(
        grid: Grid,
        packed: &[u32],
        shifts: &[f32],
        [gx, gy]: [&[f32]; 2],
        pixel: &mut [[f32; 2]],
        square: &mut [u32],
        within: &mut [[f32; 2]],
    ) {
        let n = packed.len();
        let (shifts, gx, gy) = (&shifts[..n], &gx[..n], &gy[..n]);
        let (pixel, square, within) = (&mut pixel[..n], &mut square[..n], &mut within[..n]);
        let [left, top] = grid.origin.map(|first| first as i32);
        // A place before its pixel's centre is in the square of the pixel before: to cut off its fraction would take longer.
        let along = |pixel: i32, first: i32, shift: f32| {
            let place = pixel as f32 + shift;
            let number = (pixel - first - i32::from(place < pixel as f32)) / SIDE as i32;
            let within = place - (first + number * SIDE as i32) as f32;
            (place, number, (within - 0.5 * (SIDE - 1) as f32) * PER_PIXEL)
        };
        for i in 0..n {
            let in_row = gx[i].abs() >= gy[i].abs();
            let [column, row] = [packed[i] & 0xffff, packed[i] >> 16].map(|pixel| pixel as i32);
            let (u, column, x) = along(column, left, if in_row { shifts[i] } else { 0.0 });
            let (v, row, y) = along(row, top, if in_row { 0.0 } else { shifts[i] });
            pixel[i] = [u, v];
            square[i] = (row * grid.across as i32 + column) as u32;
            within[i] = [x, y];
        }
    }
}

/// The vectors at some of the located places, by their numbers, with the reciprocal length of their change by one pixel along the unit
/// vector of the place as fourth coordinate, and that change.
///
/// # Panics
/// If a number is of no place, or a place of no square.
pub fn evaluate(
    squares: &[Quadratic],
    located: &Located,
    units: &[[f32; 2]],
    numbers: &[u32],
    out: &mut [[[f32; 4]; 2]],
) {
    dispatch!(loops(), simd => evaluate_by(simd, squares, located, units, numbers, out));
}

#[inline(always)]
fn evaluate_by<S: Simd>(
    simd: S,
    squares: &[Quadratic],
    located: &Located,
    units: &[[f32; 2]],
    numbers: &[u32],
    out: &mut [[[f32; 4]; 2]],
) {
    let splat = |number: f32| f32x4::splat(simd, number);
    let n = located.square.len();
    let (square, within, units) = (&located.square[..n], &located.within[..n], &units[..n]);
    for (number, out) in numbers.iter().zip(out) {
        let i = *number as usize;
        let [one, cx, cy, cxx, cxy, cyy] =
            squares[square[i] as usize].each_ref().map(|four| f32x4::from_slice(simd, four));
        let [x, y] = within[i].map(splat);
        let [along, across] = units[i].map(splat);
        let (twice_x, twice_y) = (x + x, y + y);
        let twist = y * cxy;
        let vector = one + x * (cx + x * cxx + twist) + y * (cy + y * cyy);
        let (du, dv) = (cx + twice_x * cxx + twist, cy + twice_y * cyy + x * cxy);
        let change = (du * along + dv * across) * splat(PER_PIXEL);
        let squared = change * change;
        let squared = squared.as_slice();
        let length = (squared[0] + squared[1] + squared[2]).sqrt();
        vector.store_slice(&mut out[0]);
        out[0][3] = 1.0 / length;
        change.store_slice(&mut out[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize, seed: u32) -> Vec<f32> {
        let level = |i: usize| (seed + i as u32).wrapping_mul(747_796_405).wrapping_mul(277_803_737) >> 16;
        (0..n).map(|i| level(i) as f32 / 32768.0 - 1.0).collect()
    }

    #[test]
    fn places_and_vectors_are_those_written_out_to_the_last_bit() {
        let grid = Grid { origin: [7, 3], across: 9 };
        for n in [0, 1, 15, 16, 100, 333] {
            let (gx, gy) = (noise(n, 1), noise(n, 900));
            let shifts: Vec<f32> = noise(n, 77).iter().map(|shift| 0.5 * shift).collect();
            let packed: Vec<u32> = (0..n as u32).map(|i| ((4 + i * 31 % 60) << 16) | (8 + i * 17 % 70)).collect();
            let mut located = Located::default();
            located.locate(grid, &packed, &shifts, [&gx, &gy]);
            let coefficients = noise(24 * 9 * 8, 5);
            let squares: Vec<Quadratic> = (0..9 * 8)
                .map(|i| std::array::from_fn(|j| std::array::from_fn(|k| coefficients[24 * i + 4 * j + k])))
                .collect();
            let units: Vec<[f32; 2]> = gx.iter().zip(&gy).map(|(x, y)| [x / x.hypot(*y), y / x.hypot(*y)]).collect();
            let numbers: Vec<u32> = (0..n as u32).rev().step_by(2).collect();
            let mut out = vec![[[f32::NAN; 4]; 2]; numbers.len()];
            evaluate(&squares, &located, &units, &numbers, &mut out);
            for (number, out) in numbers.iter().zip(&out) {
                let i = *number as usize;
                let along = gx[i].abs() >= gy[i].abs();
                let u = (packed[i] & 0xffff) as f32 + if along { shifts[i] } else { 0.0 };
                let v = (packed[i] >> 16) as f32 + if along { 0.0 } else { shifts[i] };
                assert_eq!(located.pixel[i], [u, v]);
                let (from_u, from_v) = (u - 7.0, v - 3.0);
                let (column, row) = ((from_u / 8.0).floor(), (from_v / 8.0).floor());
                assert_eq!(located.square[i], (row * 9.0 + column) as u32);
                let (x, y) = ((from_u - 8.0 * column - 3.5) * 0.25, (from_v - 8.0 * row - 3.5) * 0.25);
                assert_eq!(located.within[i], [x, y]);
                let (square, [du, dv]) = (squares[located.square[i] as usize], units[i]);
                let mut squared = 0.0;
                for k in 0..3 {
                    let [one, cx, cy, cxx, cxy, cyy] = square.map(|four| four[k]);
                    assert_eq!(out[0][k], one + x * (cx + x * cxx + y * cxy) + y * (cy + y * cyy));
                    let change =
                        ((cx + 2.0 * x * cxx + y * cxy) * du + (cy + 2.0 * y * cyy + x * cxy) * dv) * PER_PIXEL;
                    assert_eq!(out[1][k], change);
                    squared += change * change;
                }
                assert_eq!(out[0][3], 1.0 / squared.sqrt());
            }
        }
    }
}
