//! Symmetric positive definite matrices: factored, inverted and reduced in blocks of columns.

use nalgebra::{DMatrix, DVector};
use tiltvp_kernels::vectorised;

use crate::interrupt::check;

/// Columns of a block: 24 columns of the 200 to 800 rows that a window has are 40 to 150 kB, which stay in the second-level
/// cache. It changes the time (`just bench calibration`) and, by rounding, the last bits.
const BLOCK: usize = 24;

/// Rows and columns of a tile that is mirrored at once: 2 kB to read and 2 kB to write. It changes only the time.
const TILE: usize = 16;

/// Added to the diagonal of an indefinite matrix, relative to it and absolutely: the rounding of the sums that made it, some
/// ten million times the last bit, and enough for a parameter about which nothing is known.
const RELATIVE_REGULARISATION: f64 = 1e-9;
const REGULARISATION: f64 = 1e-12;

/// The Cholesky factor of a matrix.
pub(crate) struct CholeskyFactor {
    lower: DMatrix<f64>,
}

impl CholeskyFactor {
    /// The factor, `None` if the matrix, of which the lower triangle is read, is not positive definite.
    pub(crate) fn new(matrix: DMatrix<f64>) -> Option<Self> {
        let mut lower = matrix;
        let n = lower.nrows();
        for first in (0..n).step_by(BLOCK) {
            check();
            let width = BLOCK.min(n - first);
            if first > 0 {
                let (done, mut rest) = lower.columns_range_pair_mut(..first, first..first + width);
                let (below, own) = (done.rows(first, n - first), done.rows(first, width));
                rest.rows_mut(first, n - first).gemm(-1.0, &below, &own.transpose(), 1.0);
            }
            let block = &mut lower.as_mut_slice()[first * n..(first + width) * n];
            if !factor_block(block, n, first) {
                return None;
            }
        }
        lower.fill_upper_triangle(0.0, 1);
        Some(Self { lower })
    }

    /// The factor of an information matrix, regularised where rounding makes it indefinite.
    pub(crate) fn regularised(information: &DMatrix<f64>) -> Option<Self> {
        if let Some(factor) = Self::new(information.clone()) {
            return Some(factor);
        }
        let mut regularised = information.clone();
        for k in 0..regularised.nrows() {
            regularised[(k, k)] = regularised[(k, k)] * (1.0 + RELATIVE_REGULARISATION) + REGULARISATION;
        }
        Self::new(regularised)
    }

    /// `L^-1 b`; `None` if a number is not finite.
    pub(crate) fn whitened(&self, b: &DVector<f64>) -> Option<DVector<f64>> {
        self.lower.solve_lower_triangular(b)
    }

    /// `T L^-T`, in blocks of columns from left to right.
    pub(crate) fn whiten(&self, mut t: DMatrix<f64>) -> DMatrix<f64> {
        let (rows, columns) = t.shape();
        for first in (0..columns).step_by(BLOCK) {
            check();
            let width = BLOCK.min(columns - first);
            if first > 0 {
                let (done, mut rest) = t.columns_range_pair_mut(..first, first..first + width);
                rest.gemm(-1.0, &done, &self.lower.view((first, 0), (width, first)).transpose(), 1.0);
            }
            let block = &mut t.as_mut_slice()[first * rows..(first + width) * rows];
            whiten_block(block, rows, self.lower.as_slice(), columns, first);
        }
        t
    }

    /// The `x` that the matrix takes to `b`.
    pub(crate) fn solve(&self, b: &DVector<f64>) -> Option<DVector<f64>> {
        self.lower.tr_solve_lower_triangular(&self.whitened(b)?)
    }

    /// The inverse of the matrix.
    pub(crate) fn inverse(&self) -> DMatrix<f64> {
        let n = self.lower.nrows();
        // L^-T, upper triangular.
        let mut t = DMatrix::identity(n, n);
        for first in (0..n).step_by(BLOCK) {
            check();
            let width = BLOCK.min(n - first);
            if first > 0 {
                let (done, mut rest) = t.columns_range_pair_mut(..first, first..first + width);
                let own = self.lower.view((first, 0), (width, first)).transpose();
                rest.rows_mut(0, first).gemm(-1.0, &done.rows(0, first), &own, 1.0);
            }
            let block = &mut t.as_mut_slice()[first * n..(first + width) * n];
            whiten_block(block, n, self.lower.as_slice(), n, first);
        }
        let mut inverse = DMatrix::zeros(n, n);
        for first in (0..n).step_by(BLOCK) {
            check();
            let width = BLOCK.min(n - first);
            // Columns of L^-T before `first` are zero in these rows.
            let own = t.view((first, first), (width, n - first)).transpose();
            let below = t.view((first, first), (n - first, n - first));
            inverse.view_mut((first, first), (n - first, width)).gemm(1.0, &below, &own, 0.0);
        }
        mirror(&mut inverse);
        inverse
    }
}

/// `P - W W^T` of a symmetric `P`: its lower half in blocks of columns, and the upper half from that.
pub(crate) fn subtract_square(p: &mut DMatrix<f64>, w: &DMatrix<f64>) {
    let n = p.nrows();
    for first in (0..n).step_by(BLOCK) {
        let (width, height) = (BLOCK.min(n - first), n - first);
        let own = w.rows(first, width).transpose();
        p.view_mut((first, first), (height, width)).gemm(-1.0, &w.rows(first, height), &own, 1.0);
    }
    mirror(p);
}

/// Copies the lower triangle of a square matrix into the upper one.
pub(crate) fn mirror(p: &mut DMatrix<f64>) {
    let n = p.nrows();
    let values = p.as_mut_slice();
    for_each_pair(n, |lower, upper| values[upper] = values[lower]);
}

/// Copies the upper triangle of a square matrix into the lower one.
pub(crate) fn mirror_upper(p: &mut DMatrix<f64>) {
    let n = p.nrows();
    let values = p.as_mut_slice();
    for_each_pair(n, |lower, upper| values[lower] = values[upper]);
}

/// Calls `each` with the places of every element below the diagonal and of its mirror image, tile by tile.
#[inline]
fn for_each_pair(n: usize, mut each: impl FnMut(usize, usize)) {
    for first in (0..n).step_by(TILE) {
        for top in (first..n).step_by(TILE) {
            for c in first..(first + TILE).min(n) {
                for r in top.max(c + 1)..(top + TILE).min(n) {
                    each(c * n + r, r * n + c);
                }
            }
        }
    }
}

/// Factors a block of columns of a height, whose first diagonal element is at `first`; false if one is not positive.
fn factor_block(block: &mut [f64], height: usize, first: usize) -> bool {
    for j in 0..block.len() / height {
        let (done, rest) = block.split_at_mut(j * height);
        let column = &mut rest[first + j..height];
        subtract_columns(column, done, height, first + j, |before| before[first + j]);
        let square = column[0];
        if !(square > 0.0 && square.is_finite()) {
            return false;
        }
        scale(column, 1.0 / square.sqrt());
    }
    true
}

/// Whitens a block of columns of a height, which starts at column `first`, by a lower triangle of `columns` columns.
fn whiten_block(block: &mut [f64], height: usize, lower: &[f64], columns: usize, first: usize) {
    for j in 0..block.len() / height {
        let (done, rest) = block.split_at_mut(j * height);
        let column = &mut rest[..height];
        let mut k = first;
        subtract_columns(column, done, height, 0, |_| {
            k += 1;
            lower[(k - 1) * columns + first + j]
        });
        scale(column, 1.0 / lower[(first + j) * columns + first + j]);
    }
}

/// Subtracts columns of a height, from row `top` on, each times its factor, four at a time.
fn subtract_columns(into: &mut [f64], done: &[f64], height: usize, top: usize, mut factor: impl FnMut(&[f64]) -> f64) {
    let mut fours = done.chunks_exact(4 * height);
    for four in &mut fours {
        let columns: [&[f64]; 4] = std::array::from_fn(|k| &four[k * height..(k + 1) * height]);
        let factors = columns.map(&mut factor);
        subtract_four(into, columns.map(|column| &column[top..]), factors);
    }
    for column in fours.remainder().chunks_exact(height) {
        subtract_one(into, &column[top..], factor(column));
    }
}

vectorised! {
    fn subtract_four(into: &mut [f64], [a, b, c, d]: [&[f64]; 4], [fa, fb, fc, fd]: [f64; 4]) {
        for ((((value, a), b), c), d) in into.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *value -= (fa * a + fb * b) + (fc * c + fd * d);
        }
    }
}

vectorised! {
    fn subtract_one(into: &mut [f64], column: &[f64], factor: f64) {
        for (value, column) in into.iter_mut().zip(column) {
            *value -= factor * column;
        }
    }
}

vectorised! {
    fn scale(column: &mut [f64], factor: f64) {
        for value in column {
            *value *= factor;
        }
    }
}

vectorised! {
    /// The sum of eight columns times factors.
    pub(crate) fn combine(out: &mut [f64], columns: [&[f64]; 8], factors: [f64; 8]) {
        let n = out.len();
        let [a, b, c, d, e, f, g, h] = columns.map(|column| &column[..n]);
        let [fa, fb, fc, fd, fe, ff, fg, fh] = factors;
        for (i, value) in out.iter_mut().enumerate() {
            let first = (fa * a[i] + fb * b[i]) + (fc * c[i] + fd * d[i]);
            *value = first + ((fe * e[i] + ff * f[i]) + (fg * g[i] + fh * h[i]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_and_inverses_of_any_size() {
        for n in [1, 2, 23, 24, 25, 60, 103] {
            let root =
                DMatrix::from_fn(n, n, |r, c| ((r * 7 + c * 3 + 1) as f64).sin() + f64::from(u8::from(r == c)) * 4.0);
            let matrix = &root * root.transpose();
            let factor = CholeskyFactor::new(matrix.clone()).unwrap();
            assert!((&factor.lower * factor.lower.transpose() - &matrix).amax() < 1e-10 * matrix.amax());
            assert!((factor.inverse() * &matrix - DMatrix::identity(n, n)).amax() < 1e-9);
            let b = DVector::from_fn(n, |r, _| r as f64 - 2.0);
            assert!((&matrix * factor.solve(&b).unwrap() - &b).amax() < 1e-9);
            let t = DMatrix::from_fn(5, n, |r, c| (r as f64 - 0.3 * c as f64).cos());
            assert!((factor.whiten(t.clone()) * factor.lower.transpose() - &t).amax() < 1e-10);
            let mut left = matrix.clone();
            subtract_square(&mut left, &root);
            assert!(left.amax() < 1e-10 * matrix.amax());
            assert!(CholeskyFactor::new(&matrix - DMatrix::identity(n, n) * (2.0 * matrix.trace())).is_none());
        }
    }
}
