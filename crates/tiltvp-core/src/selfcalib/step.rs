//! A step of the default filter: it moves, looks, and solves its memory anew where it should.

use nalgebra::Vector3;

use super::graph::Sight;
use super::loss::LIMIT;
use super::measurement::predict;
use super::odometry::WheelMotion;
use super::outcome::Outcome;
use super::recursive::{MOUNTING, Recursive, YOUNG};
use super::update::Row;
use crate::geometry::wrap_angle;

/// Growth of the memory after which it is linearised anew where innovations are as they should be, and where they are not.
const GROWTH: f64 = 2.0;
const GROWTH_UNEASY: f64 = 1.15;

/// Standard deviations that the mounting may move before the memory is linearised anew, likewise.
const MOVED: f64 = 1.0;
const MOVED_UNEASY: f64 = 0.5;

/// Share of the mounting's standard deviations at the last solution from which on it is solved anew: where so much is learned
/// at once the Jacobians that it was learned with are not those of the answer. If the solution knows nothing of it, as on an arc
/// that tells the mounting in part, it was an illusion, and is not asked about again soon.
const SHRUNK: f64 = 0.6;

/// Poses before that is asked again: at least so many, and one for so many that there are.
const DOUBTED: usize = 5;
const DOUBTED_SHARE: usize = 20;

/// Standard deviations beyond which the filter is not believed to have moved the mounting: the memory is solved from where it
/// was.
const WILD: f64 = 3.0;

/// Rejections in a row after which a landmark is taken to be another one.
const MAX_MISSES: u32 = 5;

/// Rejections in a row after which the memory is asked what is right.
const DISPUTED: u32 = 3;

/// Poses after which a landmark that is seen again, and not where it should be, closes a loop: the memory is solved anew.
const AWAY: usize = 10;

impl Recursive {
    /// Moves, then looks.
    pub(super) fn step(&mut self, motion: &WheelMotion, seen: &[(u64, f64)]) -> Outcome {
        self.predict(motion);
        let mut outcome = Outcome::default();
        let rejected = self.update(seen, &mut outcome);
        let nodes = self.graph.nodes.len();
        let moved = self.mean.fixed_rows::<3>(MOUNTING) - self.graph.mounting;
        let limit = if self.alarm.uneasy() { MOVED_UNEASY } else { MOVED };
        let solved: Vector3<f64> = self.solved_covariance.diagonal().map(f64::sqrt);
        let sigmas = moved.component_div(&solved).amax();
        let shrunk = nodes >= self.illusory_until && self.is_below(&(solved * SHRUNK));
        let disputed = outcome.contradiction > 0.0
            || rejected.iter().any(|slot| self.misses[*slot] >= DISPUTED || self.was_away(*slot));
        let due = nodes >= self.next_linearisation || sigmas > limit || shrunk || disputed || outcome.slipped;
        let mut judged = outcome;
        if due && nodes > 2 && self.graph.nodes.last().is_some_and(|node| !node.sights.is_empty()) {
            let trusted = outcome.contradiction == 0.0 && !shrunk && sigmas < WILD;
            self.linearise(if nodes < YOUNG || !trusted { 12 } else { 4 }, trusted);
            self.judge(&rejected, &mut judged);
            if nodes > self.options.memory as usize {
                self.fold(nodes / 2);
            }
            let nodes = self.graph.nodes.len();
            let growth = if self.alarm.uneasy() { GROWTH_UNEASY } else { GROWTH };
            let grown = if nodes < YOUNG { nodes + 1 } else { (nodes as f64 * growth) as usize };
            self.next_linearisation = grown.max(nodes + 1);
            let soon = nodes + (nodes / DOUBTED_SHARE).max(DOUBTED);
            let illusory = shrunk && !self.is_below(&(solved * SHRUNK));
            self.illusory_until = if illusory { soon } else { self.illusory_until.min(soon) };
        }
        for (name, misses) in self.names.iter_mut().zip(&self.misses) {
            if *misses >= MAX_MISSES {
                *name = None;
            }
        }
        self.alarm.note(&judged, self.gate.limit());
        outcome
    }

    /// Whether a standard deviation of the mounting is below one of these.
    fn is_below(&self, sigmas: &Vector3<f64>) -> bool {
        (0..3).any(|i| self.covariance[(MOUNTING + i, MOUNTING + i)].sqrt() < sigmas[i])
    }

    /// Whether a landmark that is seen now was not seen from the poses before.
    fn was_away(&self, slot: usize) -> bool {
        let before = self.graph.nodes.iter().rev().skip(1).take(AWAY);
        !before.flat_map(|node| &node.sights).any(|sight| sight.landmark == slot)
    }

    /// Counts bearings that did not pass the gate as fused where the memory, solved anew, agrees with them; but a contradiction
    /// that it could solve only by a motion far from what the wheels tell stays one.
    fn judge(&mut self, rejected: &[usize], outcome: &mut Outcome) {
        let Some(node) = self.graph.nodes.last() else { return };
        let (pose, _) = self.graph.pose_of_sights(node);
        if outcome.contradiction > 0.0 && self.graph.slipped(self.graph.nodes.len() - 1) {
            (outcome.nis, outcome.used, outcome.rejected) = (outcome.contradiction, rejected.len(), 0);
            return;
        }
        for sight in node.sights.iter().filter(|sight| rejected.contains(&sight.landmark)) {
            let p = predict(&pose, &self.graph.mounting, &self.graph.landmarks[sight.landmark]);
            let r = wrap_angle(p.bearing - sight.bearing) / self.graph.bearing_sigma;
            if r.abs() <= LIMIT {
                self.misses[sight.landmark] = 0;
                outcome.rejected -= 1;
                outcome.used += 1;
                outcome.nis += r * r;
            }
        }
    }

    fn update(&mut self, seen: &[(u64, f64)], outcome: &mut Outcome) -> Vec<usize> {
        let mut rows = Vec::with_capacity(seen.len());
        let mut fresh = Vec::new();
        let view = self.view();
        for &(name, bearing) in seen {
            match self.names.iter().position(|known| *known == Some(name)) {
                Some(slot) => {
                    // The robot has not moved since it was seen: nothing new.
                    let again = self.graph.nodes.last().is_some_and(|n| n.sights.iter().any(|s| s.landmark == slot));
                    if !again {
                        rows.push(Row { slot, bearing, p: self.expect(slot, &view) });
                    }
                }
                None => fresh.push((name, bearing)),
            }
        }
        if let Some(node) = self.graph.nodes.last_mut() {
            node.sights.extend(rows.iter().map(|row| Sight::new(row.slot, row.bearing)));
        }
        let rejected = self.fuse(rows, outcome);
        for (name, bearing) in fresh {
            self.start(name, bearing);
            outcome.started += 1;
        }
        rejected
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Vector2;

    use super::*;
    use crate::selfcalib::SelfCalibratorOptions;

    /// On a circle, which tells nothing of how far the camera is from the axle, the filter takes that for learned step by step:
    /// the memory is not asked each time, and what is said of the mounting remains as wide as it is.
    #[test]
    fn illusions_of_a_circle_cost_little_and_are_not_told() {
        let (posts, radius, turn) = (20, 1.0, 0.04);
        let scattered = |k: usize| ((k as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0);
        let options = SelfCalibratorOptions { wheel_base_m: 0.4, ..SelfCalibratorOptions::default() };
        let (x, mut filter) = (options.start.x_m + 0.05, Recursive::new(&options).unwrap());
        let known = options.start_covariance[(0, 0)].sqrt();
        let (mut solutions, mut solved, mut steps) = (0, 0, 0);
        for step in 0..200 {
            let heading = turn * (step + 1) as f64;
            let robot = Vector2::new(heading.sin(), 1.0 - heading.cos()) * radius;
            let camera = robot + Vector2::new(heading.cos(), heading.sin()) * x;
            let seen: Vec<(u64, f64)> = (0..posts)
                .map(|k| {
                    let (far, around) = (2.0 + 3.0 * scattered(k), TAU * scattered(posts + k));
                    let ray = Vector2::new(around.cos(), around.sin()) * far - camera;
                    let noise = 0.03 * (scattered(posts * (step + 2) + k) - 0.5);
                    (k as u64, wrap_angle(ray.y.atan2(ray.x) - heading + noise))
                })
                .collect();
            filter.step(&WheelMotion::from_motion(radius * turn, turn, 0.4), &seen);
            if step >= YOUNG {
                steps += 1;
                solutions += usize::from(filter.solved != solved);
                let (_, covariance) = filter.mounting();
                let widest = covariance.symmetric_eigenvalues().max().sqrt();
                assert!(widest > 0.5 * known, "{widest} m at step {step}");
            }
            solved = filter.solved;
        }
        assert!(solutions < steps / 4, "{solutions} solutions in {steps} steps");
    }
}
