//! The measurement update: bearings of known landmarks, gated, and fused by an iterated Kalman update (Bell and Cathey 1993).

use nalgebra::{DMatrix, DVector};

use super::state::{LANDMARKS, SlidingWindow};
use super::tuning::{SLIP_BEARINGS, SLIP_FACTOR, UPDATE_ITERATIONS, UPDATE_LEAST_SIGMA, UPDATE_MOVED_SIGMAS};
use crate::geometry::wrap_angle;
use crate::selfcalib::bundle::{CholeskyFactor, combine, subtract_square};
use crate::selfcalib::model::Prediction;
use crate::selfcalib::step_outcome::StepOutcome;

/// A bearing of a known landmark with its prediction: a row of the Jacobian `H`.
pub(super) struct MatchedBearing {
    pub(super) slot: usize,
    pub(super) bearing: f64,
    pub(super) p: Prediction,
}

impl MatchedBearing {
    fn innovation(&self) -> f64 {
        wrap_angle(self.bearing - self.p.bearing)
    }
}

impl SlidingWindow {
    /// `P H^T`, a column for each bearing.
    fn cross_covariance(&self, rows: &[MatchedBearing]) -> DMatrix<f64> {
        let n = self.covariance.nrows();
        let mut cross = DMatrix::zeros(n, rows.len());
        let covariance = self.covariance.as_slice();
        for (row, out) in rows.iter().zip(cross.as_mut_slice().chunks_exact_mut(n)) {
            let entries = entries(row);
            combine(out, entries.map(|(at, _)| &covariance[at * n..(at + 1) * n]), entries.map(|(_, by)| by));
        }
        cross
    }

    /// The variance of a bearing: the assumed one, or a larger one of its landmark. A smaller one would make the gate stricter than
    /// the options say.
    fn noise(&self, row: &MatchedBearing) -> f64 {
        (self.problem.bearing_sigma * self.problem.scatters[row.slot].max(1.0)).powi(2)
    }

    /// Which bearings pass the gate.
    fn gated(&self, rows: &[MatchedBearing], cross: &DMatrix<f64>) -> Vec<bool> {
        let passes = |(column, row): (usize, &MatchedBearing)| {
            let variance = product(row, &cross.as_slice()[column * cross.nrows()..]) + self.noise(row);
            let y = row.innovation();
            self.gate.passes(y * y / variance)
        };
        rows.iter().enumerate().map(passes).collect()
    }

    /// Fuses the bearings that pass the gate. Returns the landmarks of those that do not.
    pub(super) fn fuse(&mut self, mut rows: Vec<MatchedBearing>, outcome: &mut StepOutcome) -> Vec<usize> {
        let mut cross = self.cross_covariance(&rows);
        let mut passes = self.gated(&rows, &cross);
        let failed = passes.iter().filter(|passed| !**passed).count();
        outcome.slipped = rows.len() >= SLIP_BEARINGS && 2 * failed > rows.len();
        if outcome.slipped {
            let mut pose = self.covariance.fixed_view_mut::<3, 3>(0, 0);
            pose += self.motion_noise * (SLIP_FACTOR * SLIP_FACTOR);
            cross = self.cross_covariance(&rows);
            passes = self.gated(&rows, &cross);
        }
        let mut rejected = Vec::new();
        for (row, passed) in rows.iter().zip(&passes) {
            let rejections = &mut self.rejections[row.slot];
            *rejections = if *passed { 0 } else { *rejections + 1 };
            if !passed {
                rejected.push(row.slot);
            }
        }
        outcome.rejected = rejected.len();
        if outcome.rejected > 0 {
            let mut kept = passes.iter();
            rows.retain(|_| *kept.next().unwrap_or(&false));
            cross = self.cross_covariance(&rows);
        }
        if !rows.is_empty() {
            outcome.used = rows.len();
            self.iterate(rows, cross, outcome, &mut rejected);
        }
        rejected
    }

    /// The iterated update. Bearings that contradict one another are all rejected.
    fn iterate(
        &mut self,
        mut rows: Vec<MatchedBearing>,
        mut cross: DMatrix<f64>,
        outcome: &mut StepOutcome,
        rejected: &mut Vec<usize>,
    ) {
        let before = self.mean.clone();
        for iteration in 0..UPDATE_ITERATIONS {
            let mut innovation = DVector::from_iterator(rows.len(), rows.iter().map(MatchedBearing::innovation));
            if iteration > 0 {
                cross = self.cross_covariance(&rows);
                let back = &self.mean - &before;
                for (row, y) in rows.iter().zip(innovation.iter_mut()) {
                    *y += product(row, back.as_slice());
                }
            }
            let Some(factor) = CholeskyFactor::new(self.innovation_covariance(&rows, &cross)) else { return };
            let whitened = factor.whiten(std::mem::replace(&mut cross, DMatrix::zeros(0, 0)));
            let Some(y) = factor.whitened(&innovation) else { return };
            if iteration == 0 {
                outcome.nis = y.norm_squared();
                // Each bearing may pass the gate, but all of them together do not.
                if outcome.nis > self.gate.limit() * rows.len() as f64 {
                    rejected.extend(rows.iter().map(|row| row.slot));
                    outcome.contradiction = outcome.nis;
                    (outcome.nis, outcome.used, outcome.rejected) = (0.0, 0, rejected.len());
                    return;
                }
            }
            let now = &before + &whitened * y;
            let moved = &now - &self.mean;
            let limit = |i: usize| UPDATE_MOVED_SIGMAS * self.covariance[(i, i)].sqrt().max(UPDATE_LEAST_SIGMA);
            let far = (0..LANDMARKS).any(|i| moved[i].abs() > limit(i));
            self.mean = now;
            if !far || iteration + 1 == UPDATE_ITERATIONS {
                subtract_square(&mut self.covariance, &whitened);
                break;
            }
            let viewpoint = self.viewpoint();
            for row in &mut rows {
                row.p = self.predict_bearing(row.slot, &viewpoint);
            }
        }
    }

    /// `S = H P H^T + R`, of which only the lower triangle is filled.
    fn innovation_covariance(&self, rows: &[MatchedBearing], cross: &DMatrix<f64>) -> DMatrix<f64> {
        let mut s = DMatrix::zeros(rows.len(), rows.len());
        let n = self.covariance.nrows();
        for (j, column) in cross.as_slice().chunks_exact(n).enumerate() {
            for (row, value) in rows[j..].iter().zip(&mut s.column_mut(j).as_mut_slice()[j..]) {
                *value = product(row, column);
            }
            s[(j, j)] += self.noise(&rows[j]);
        }
        s
    }
}

/// The entries of a row of the Jacobian that are not zero: places in the state, and values.
fn entries(row: &MatchedBearing) -> [(usize, f64); 8] {
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
fn product(row: &MatchedBearing, vector: &[f64]) -> f64 {
    let at = LANDMARKS + 2 * row.slot;
    let (p, head, own) = (&row.p, &vector[..LANDMARKS], &vector[at..at + 2]);
    let first = p.by_pose.x * head[0] + p.by_pose.y * head[1] + p.by_pose.z * head[2];
    let second = p.by_mounting.x * head[3] + p.by_mounting.y * head[4] + p.by_mounting.z * head[5];
    first + second + (p.by_landmark.x * own[0] + p.by_landmark.y * own[1])
}
