//! The measurement update: bearings of known landmarks, gated, and fused by an iterated Kalman update (Bell and Cathey 1993).

use nalgebra::{DMatrix, DVector};

use super::state::{LANDMARKS, SlidingWindow};
use super::tuning::{MINORITY, SLIP_BEARINGS, SLIP_FACTOR, UPDATE_ITERATIONS, UPDATE_LEAST_SIGMA, UPDATE_MOVED_SIGMAS};
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
        self.reject(&mut rows, &passes, &mut rejected, outcome);
        if outcome.rejected > 0 {
            cross = self.cross_covariance(&rows);
        }
        if !rows.is_empty() {
            self.iterate(rows, cross, outcome, &mut rejected);
        }
        rejected
    }

    /// Takes away the bearings that do not pass, and counts them.
    fn reject(
        &mut self,
        rows: &mut Vec<MatchedBearing>,
        passes: &[bool],
        rejected: &mut Vec<usize>,
        outcome: &mut StepOutcome,
    ) {
        let mut passed = passes.iter();
        rows.retain(|row| {
            let passed = *passed.next().unwrap_or(&false);
            if !passed {
                self.rejections[row.slot] += 1;
                rejected.push(row.slot);
            }
            passed
        });
        (outcome.used, outcome.rejected) = (rows.len(), rejected.len());
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
                if let Some(passes) = self.jointly_gated(&factor, &innovation, &y) {
                    self.reject(&mut rows, &passes, rejected, outcome);
                    let cross = self.cross_covariance(&rows);
                    return self.iterate(rows, cross, outcome, rejected);
                }
                for row in &rows {
                    self.rejections[row.slot] = 0;
                }
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

    /// Which bearings pass the gate given the others, if a minority does not: the worst is left out until the rest agree (after the joint
    /// compatibility of Neira and Tardos 2001). Where the pose is uncertain each passes by itself. `whitened` are the innovations, each
    /// given those before it.
    fn jointly_gated(
        &self,
        factor: &CholeskyFactor,
        innovation: &DVector<f64>,
        whitened: &DVector<f64>,
    ) -> Option<Vec<bool>> {
        if whitened.iter().all(|y| self.gate.passes(y * y)) {
            return None;
        }
        let mut information = factor.inverse();
        let mut weighed = &information * innovation;
        let mut passes = vec![true; innovation.len()];
        loop {
            // The square of each given the others kept: the part of the sum of squares that goes with it.
            let part = |i: usize| weighed[i] * weighed[i] / information[(i, i)];
            let kept = (0..passes.len()).filter(|i| passes[*i]);
            let worst = kept.max_by(|i, j| part(*i).total_cmp(&part(*j)))?;
            if self.gate.passes(part(worst)) {
                break;
            }
            passes[worst] = false;
            let column = information.column(worst).into_owned();
            let scale = 1.0 / column[worst];
            weighed.axpy(-scale * weighed[worst], &column, 1.0);
            information.ger(-scale, &column, &column, 1.0);
        }
        let failed = passes.iter().filter(|passed| !**passed).count();
        (failed > 0 && MINORITY * failed < passes.len()).then_some(passes)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::SelfCalibratorOptions;
    use crate::selfcalib::model::WheelMotion;

    /// After a turn that the wheels tell badly, bearings of nine landmarks tell where the robot looks, and that those of two others, each
    /// no further off than the turn may be, are wrong.
    #[test]
    fn bearings_that_the_others_contradict_are_rejected_though_each_passes_the_gate() {
        let (posts, turn, base) = (11, 0.2, 0.4);
        let options = SelfCalibratorOptions {
            wheel_base_m: base,
            odometry_k_m: 2e-3,
            bearing_sigma_rad: 2e-3,
            ..Default::default()
        };
        let mut filter = SlidingWindow::new(&options).unwrap();
        let start = options.start;
        let seen = |heading: f64, wrong: f64| -> Vec<(u64, f64)> {
            let camera = start.yaw_rad + heading;
            let place = [
                start.x_m * heading.cos() - start.y_m * heading.sin(),
                start.x_m * heading.sin() + start.y_m * heading.cos(),
            ];
            let bearing = |k: u64| {
                let (far, around) = (3.0 + 0.2 * k as f64, 0.55 * k as f64);
                let ray = [far * around.cos() - place[0], far * around.sin() - place[1]];
                wrap_angle(ray[1].atan2(ray[0]) - camera + if k < 2 { wrong } else { 0.0 })
            };
            (0..posts).map(|k| (k, bearing(k))).collect()
        };
        let motion = WheelMotion::from_motion(0.0, turn, base);
        for step in 0..20 {
            filter.step(&motion, &seen(turn * f64::from(step), 0.0));
        }
        let outcome = filter.step(&motion, &seen(turn * 20.0, 0.03));
        assert_eq!((outcome.used, outcome.rejected), (9, 2), "{outcome:?}");
    }
}
