//! The update of the default filter: bearings of known landmarks, gated and iterated.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::measurement::Prediction;
use super::recursive::{LANDMARKS, Outcome, Recursive};
use crate::geometry::wrap_angle;

/// Most linearisations of one update.
const MAX_ITERATIONS: u32 = 4;

/// Factor of the standard deviations of a step's motion if most landmarks are not where they should be after it.
const SLIPPED: f64 = 300.0;

/// Bearings from which on most of them can tell that the wheels slipped.
const WITNESSES: usize = 3;

/// A bearing of a known landmark, linearised.
pub(super) struct Row {
    pub(super) slot: usize,
    pub(super) bearing: f64,
    pub(super) p: Prediction,
}

impl Recursive {
    /// The Jacobian of a row times the covariance, a column for each row.
    fn spread(&self, rows: &[Row]) -> DMatrix<f64> {
        let n = self.covariance.nrows();
        let mut spread = DMatrix::zeros(n, rows.len());
        for (row, mut out) in rows.iter().zip(spread.column_iter_mut()) {
            for (at, by) in entries(row) {
                out.axpy(by, &self.covariance.column(at), 1.0);
            }
        }
        spread
    }

    /// Which rows pass the gate.
    fn gated(&self, rows: &[Row], spread: &DMatrix<f64>) -> Vec<bool> {
        let noise = self.options.bearing_sigma_rad.powi(2);
        let passes = |(column, row): (usize, &Row)| {
            let variance = entries(row).iter().map(|(at, by)| by * spread[(*at, column)]).sum::<f64>() + noise;
            let y = wrap_angle(row.bearing - row.p.bearing);
            self.gate.passes(y * y / variance)
        };
        rows.iter().enumerate().map(passes).collect()
    }

    /// Fuses the rows that pass the gate, and says which slots did not.
    pub(super) fn fuse(&mut self, mut rows: Vec<Row>, outcome: &mut Outcome) -> Vec<usize> {
        let noise = self.options.bearing_sigma_rad.powi(2);
        let mut spread = self.spread(&rows);
        let mut passes = self.gated(&rows, &spread);
        let failed = passes.iter().filter(|passed| !**passed).count();
        outcome.slipped = rows.len() >= WITNESSES && 2 * failed > rows.len();
        if outcome.slipped {
            let mut pose = self.covariance.fixed_view_mut::<3, 3>(0, 0);
            pose += self.motion_noise * (SLIPPED * SLIPPED);
            spread = self.spread(&rows);
            passes = self.gated(&rows, &spread);
        }
        let mut rejected = Vec::new();
        for (row, passed) in rows.iter().zip(&passes) {
            let misses = &mut self.misses[row.slot];
            *misses = if *passed { 0 } else { *misses + 1 };
            if !passed {
                rejected.push(row.slot);
            }
        }
        outcome.rejected = rejected.len();
        if outcome.rejected > 0 {
            let mut kept = passes.iter();
            rows.retain(|_| *kept.next().unwrap_or(&false));
            spread = self.spread(&rows);
        }
        if rows.is_empty() {
            return rejected;
        }
        outcome.used = rows.len();
        let before = self.mean.clone();
        for iteration in 0..MAX_ITERATIONS {
            let mut innovation =
                DVector::from_iterator(rows.len(), rows.iter().map(|r| wrap_angle(r.bearing - r.p.bearing)));
            if iteration > 0 {
                spread = self.spread(&rows);
                let back = &self.mean - &before;
                for (row, y) in rows.iter().zip(innovation.iter_mut()) {
                    *y += entries(row).iter().map(|(at, by)| by * back[*at]).sum::<f64>();
                }
            }
            let mut s = DMatrix::zeros(rows.len(), rows.len());
            for (i, row) in rows.iter().enumerate() {
                let entries = entries(row);
                for j in 0..=i {
                    s[(i, j)] = entries.iter().map(|(at, by)| by * spread[(*at, j)]).sum();
                }
                s[(i, i)] += noise;
            }
            let Some(lower) = Cholesky::new(s).map(Cholesky::unpack) else { return rejected };
            let whitened = whiten(spread.clone(), &lower);
            let Some(y) = lower.solve_lower_triangular(&innovation) else { return rejected };
            if iteration == 0 {
                outcome.nis = y.norm_squared();
            }
            let step = &whitened * y;
            let now = &before + &step;
            let moved = &now - &self.mean;
            let far = (0..LANDMARKS).any(|i| moved[i].abs() > 0.05 * self.covariance[(i, i)].sqrt().max(1e-6));
            self.mean = now;
            if !far || iteration + 1 == MAX_ITERATIONS {
                subtract_square(&mut self.covariance, &whitened);
                break;
            }
            for row in &mut rows {
                row.p = self.expect(row.slot);
            }
        }
        rejected
    }
}

/// The entries of a row of the Jacobian that are not zero.
fn entries(row: &Row) -> [(usize, f64); 8] {
    let at = LANDMARKS + 2 * row.slot;
    let p = &row.p;
    [
        (0, p.by_pose.x),
        (1, p.by_pose.y),
        (2, p.by_pose.z),
        (3, p.by_mounting.x),
        (4, p.by_mounting.y),
        (5, p.by_mounting.z),
        (at, p.by_landmark.x),
        (at + 1, p.by_landmark.y),
    ]
}

/// Columns that are worked on at once.
const BLOCK: usize = 24;

/// `T L^-T`, block by block of columns: what the blocks before have in it is taken out first.
fn whiten(mut t: DMatrix<f64>, lower: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, columns) = t.shape();
    for first in (0..columns).step_by(BLOCK) {
        let width = BLOCK.min(columns - first);
        let (done, mut rest) = t.columns_range_pair_mut(..first, first..first + width);
        if first > 0 {
            rest.gemm(-1.0, &done, &lower.view((first, 0), (width, first)).transpose(), 1.0);
        }
        let block = &mut t.as_mut_slice()[first * rows..(first + width) * rows];
        for j in 0..width {
            let (done, rest) = block.split_at_mut(j * rows);
            let column = &mut rest[..rows];
            for (k, before) in done.chunks_exact(rows).enumerate() {
                let factor = lower[(first + j, first + k)];
                for (value, before) in column.iter_mut().zip(before) {
                    *value -= factor * before;
                }
            }
            let scale = 1.0 / lower[(first + j, first + j)];
            for value in column.iter_mut() {
                *value *= scale;
            }
        }
    }
    t
}

/// `P - W W^T` of a symmetric `P`: its lower half in blocks of columns, and the upper half from that.
fn subtract_square(p: &mut DMatrix<f64>, w: &DMatrix<f64>) {
    let n = p.nrows();
    for first in (0..n).step_by(BLOCK) {
        let (width, height) = (BLOCK.min(n - first), n - first);
        let own = w.rows(first, width).transpose();
        p.view_mut((first, first), (height, width)).gemm(-1.0, &w.rows(first, height), &own, 1.0);
    }
    p.fill_upper_triangle_with_lower_triangle();
}
