//! The update of the default filter: bearings of known landmarks, gated and iterated.

use nalgebra::{DMatrix, DVector};

use super::dense::{Factor, combine, subtract_square};
use super::measurement::Prediction;
use super::outcome::Outcome;
use super::recursive::{LANDMARKS, Recursive};
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
        let covariance = self.covariance.as_slice();
        for (row, out) in rows.iter().zip(spread.as_mut_slice().chunks_exact_mut(n)) {
            let entries = entries(row);
            combine(out, entries.map(|(at, _)| &covariance[at * n..(at + 1) * n]), entries.map(|(_, by)| by));
        }
        spread
    }

    /// The variance of a row's bearing: that which is assumed, or more, so that innovations are judged by what was assumed.
    fn noise(&self, row: &Row) -> f64 {
        (self.graph.bearing_sigma * self.graph.spreads[row.slot].max(1.0)).powi(2)
    }

    /// Which rows pass the gate.
    fn gated(&self, rows: &[Row], spread: &DMatrix<f64>) -> Vec<bool> {
        let passes = |(column, row): (usize, &Row)| {
            let variance = along(row, &spread.as_slice()[column * spread.nrows()..]) + self.noise(row);
            let y = wrap_angle(row.bearing - row.p.bearing);
            self.gate.passes(y * y / variance)
        };
        rows.iter().enumerate().map(passes).collect()
    }

    /// Fuses the rows that pass the gate, and says which slots did not.
    pub(super) fn fuse(&mut self, mut rows: Vec<Row>, outcome: &mut Outcome) -> Vec<usize> {
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
                    *y += along(row, back.as_slice());
                }
            }
            let mut s = DMatrix::zeros(rows.len(), rows.len());
            let n = self.covariance.nrows();
            for (j, spread) in spread.as_slice().chunks_exact(n).enumerate() {
                for (row, value) in rows[j..].iter().zip(&mut s.column_mut(j).as_mut_slice()[j..]) {
                    *value = along(row, spread);
                }
                s[(j, j)] += self.noise(&rows[j]);
            }
            let Some(factor) = Factor::new(s) else { return rejected };
            let whitened = factor.whiten(std::mem::replace(&mut spread, DMatrix::zeros(0, 0)));
            let Some(y) = factor.whitened(&innovation) else { return rejected };
            if iteration == 0 {
                outcome.nis = y.norm_squared();
                // Each for itself may be where it could be, but not all of them together.
                if outcome.nis > self.gate.limit() * rows.len() as f64 {
                    rejected.extend(rows.iter().map(|row| row.slot));
                    outcome.contradiction = outcome.nis;
                    (outcome.nis, outcome.used, outcome.rejected) = (0.0, 0, rejected.len());
                    return rejected;
                }
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
            let view = self.view();
            for row in &mut rows {
                row.p = self.expect(row.slot, &view);
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

/// The product of a row of the Jacobian and a vector.
fn along(row: &Row, vector: &[f64]) -> f64 {
    let at = LANDMARKS + 2 * row.slot;
    let (p, head, own) = (&row.p, &vector[..LANDMARKS], &vector[at..at + 2]);
    let first = p.by_pose.x * head[0] + p.by_pose.y * head[1] + p.by_pose.z * head[2];
    let second = p.by_mounting.x * head[3] + p.by_mounting.y * head[4] + p.by_mounting.z * head[5];
    first + second + (p.by_landmark.x * own[0] + p.by_landmark.y * own[1])
}
