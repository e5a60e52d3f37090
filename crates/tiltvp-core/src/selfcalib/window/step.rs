//! A step of the sliding window: predict, update, and relinearise where one of five triggers says so.

use nalgebra::Vector3;

use super::state::{MOUNTING, SlidingWindow};
use super::tuning::{
    DISPUTED_REJECTIONS, EVERY_STEP_KEYFRAMES, GROWTH, INCONSISTENT_GROWTH, INCONSISTENT_MOVED_SIGMAS, ITERATIONS,
    LOOP_KEYFRAMES, LOST_REJECTIONS, MOVED_SIGMAS, SEEN_ONCE_MAX, SIGMA_RATIO, SPURIOUS_KEYFRAMES, SPURIOUS_SHARE,
    TRUSTED_SIGMAS, UNTRUSTED_ITERATIONS,
};
use super::update::MatchedBearing;
use crate::geometry::wrap_angle;
use crate::selfcalib::bundle::Observation;
use crate::selfcalib::model::{OUTLIER_SIGMAS, WheelMotion, predict};
use crate::selfcalib::step_outcome::StepOutcome;

impl SlidingWindow {
    /// Moves by the odometry, then takes the bearings of landmarks by their identifiers.
    pub(crate) fn step(&mut self, motion: &WheelMotion, seen: &[(u64, f64)]) -> StepOutcome {
        self.predict(motion);
        let mut outcome = StepOutcome::default();
        let rejected = self.update(seen, &mut outcome);
        let keyframes = self.problem.keyframes.len();
        let solved: Vector3<f64> = self.solved_covariance.diagonal().map(f64::sqrt);
        let moved = self.mean.fixed_rows::<3>(MOUNTING) - self.problem.mounting;
        let moved = moved.component_div(&solved).amax();
        let limit = if self.monitor.is_inconsistent() { INCONSISTENT_MOVED_SIGMAS } else { MOVED_SIGMAS };
        let shrunk = keyframes >= self.spurious_until && self.any_sigma_below(&(solved * SIGMA_RATIO));
        let disputed = outcome.contradiction > 0.0
            || rejected.iter().any(|slot| self.rejections[*slot] >= DISPUTED_REJECTIONS || self.closes_loop(*slot));
        let due = keyframes >= self.next_relinearisation || moved > limit || shrunk || disputed || outcome.slipped;
        let mut recorded = outcome;
        if due && keyframes > 2 && self.problem.keyframes.last().is_some_and(|last| !last.observations.is_empty()) {
            let trusted = outcome.contradiction == 0.0 && !shrunk && moved < TRUSTED_SIGMAS;
            let every_step = keyframes < EVERY_STEP_KEYFRAMES;
            self.relinearise(if every_step || !trusted { UNTRUSTED_ITERATIONS } else { ITERATIONS }, trusted);
            self.recheck_rejected(&rejected, &mut recorded);
            // Not so soon that what is left is solved at every step.
            let crowded = keyframes >= 2 * EVERY_STEP_KEYFRAMES && self.landmarks_seen_once() > SEEN_ONCE_MAX;
            if keyframes > self.options.keyframes_max as usize || crowded {
                self.marginalise(keyframes / 2);
            }
            self.schedule(shrunk && !self.any_sigma_below(&(solved * SIGMA_RATIO)));
        }
        for (id, rejections) in self.landmark_ids.iter_mut().zip(&self.rejections) {
            if *rejections >= LOST_REJECTIONS {
                *id = None;
            }
        }
        self.monitor.record(&recorded, self.gate.limit());
        outcome
    }

    /// Sets when the window is solved next after a solution, which may have found that the information before was `spurious`.
    fn schedule(&mut self, spurious: bool) {
        let keyframes = self.problem.keyframes.len();
        let growth = if self.monitor.is_inconsistent() { INCONSISTENT_GROWTH } else { GROWTH };
        let every_step = keyframes < EVERY_STEP_KEYFRAMES;
        let grown = if every_step { keyframes + 1 } else { (keyframes as f64 * growth) as usize };
        self.next_relinearisation = grown.max(keyframes + 1);
        let soon = keyframes + (keyframes / SPURIOUS_SHARE).max(SPURIOUS_KEYFRAMES);
        self.spurious_until = if spurious { soon } else { self.spurious_until.min(soon) };
    }

    /// How many landmarks have one bearing in the window.
    fn landmarks_seen_once(&self) -> usize {
        let mut bearings = vec![0; self.problem.landmarks.len()];
        self.problem.observations().for_each(|observation| bearings[observation.landmark] += 1);
        bearings.iter().filter(|count| **count == 1).count()
    }

    /// Whether a standard deviation of the mounting is below its limit.
    fn any_sigma_below(&self, limits: &Vector3<f64>) -> bool {
        (0..3).any(|i| self.covariance[(MOUNTING + i, MOUNTING + i)].sqrt() < limits[i])
    }

    /// Whether a landmark that is seen now was not seen from the keyframes before: a loop closure.
    fn closes_loop(&self, slot: usize) -> bool {
        let before = self.problem.keyframes.iter().rev().skip(1).take(LOOP_KEYFRAMES);
        !before.flat_map(|keyframe| &keyframe.observations).any(|observation| observation.landmark == slot)
    }

    /// Counts rejected bearings as used where the solution agrees with them. A contradiction stays one where the solution needs
    /// a slip of the wheels.
    fn recheck_rejected(&mut self, rejected: &[usize], outcome: &mut StepOutcome) {
        let Some(keyframe) = self.problem.keyframes.last() else { return };
        if outcome.contradiction > 0.0 && self.problem.slipped(self.problem.keyframes.len() - 1) {
            (outcome.nis, outcome.used, outcome.rejected) = (outcome.contradiction, rejected.len(), 0);
            return;
        }
        for observation in keyframe.observations.iter().filter(|observation| rejected.contains(&observation.landmark)) {
            let landmark = &self.problem.landmarks[observation.landmark];
            let (pose, _) = self.problem.observation_pose(self.problem.keyframes.len() - 1, &observation.along);
            let bearing = predict(&pose, &self.problem.mounting, landmark).bearing;
            let r = wrap_angle(bearing - observation.bearing) / self.problem.bearing_sigma;
            if r.abs() <= OUTLIER_SIGMAS {
                self.rejections[observation.landmark] = 0;
                outcome.rejected -= 1;
                outcome.used += 1;
                outcome.nis += r * r;
            }
        }
    }

    /// Takes bearings: fuses those of known landmarks, initialises new ones. Returns the landmarks whose bearings were rejected.
    fn update(&mut self, seen: &[(u64, f64)], outcome: &mut StepOutcome) -> Vec<usize> {
        let mut matched = Vec::with_capacity(seen.len());
        let mut new = Vec::new();
        let viewpoint = self.viewpoint();
        for &(id, bearing) in seen {
            match self.landmark_ids.iter().position(|known| *known == Some(id)) {
                Some(slot) => {
                    // At a standstill a second bearing of a landmark tells nothing new: its error may be the same.
                    let last = self.problem.keyframes.last();
                    let again = last.is_some_and(|last| last.observations.iter().any(|seen| seen.landmark == slot));
                    if !again {
                        matched.push(MatchedBearing { slot, bearing, p: self.predict_bearing(slot, &viewpoint) });
                    }
                }
                None => new.push((id, bearing)),
            }
        }
        if let Some(keyframe) = self.problem.keyframes.last_mut() {
            keyframe.observations.extend(matched.iter().map(|seen| Observation::new(seen.slot, seen.bearing)));
        }
        let rejected = self.fuse(matched, outcome);
        self.initialise_landmarks(&new);
        outcome.started += new.len();
        rejected
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Vector2;

    use super::*;
    use crate::selfcalib::SelfCalibratorOptions;

    /// On a circle, which does not tell how far the camera is from the axle, the filter gains spurious information about that with
    /// every step. The window is not solved each time, and the reported covariance stays as wide as at the start.
    #[test]
    fn spurious_information_of_a_circle_costs_little_and_is_not_reported() {
        let (posts, radius, turn) = (20, 1.0, 0.04);
        let scattered = |k: usize| ((k as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0);
        let options = SelfCalibratorOptions { wheel_base_m: 0.4, ..SelfCalibratorOptions::default() };
        let (x, mut filter) = (options.start.x_m + 0.05, SlidingWindow::new(&options).unwrap());
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
            if step >= EVERY_STEP_KEYFRAMES {
                steps += 1;
                solutions += usize::from(filter.solved_keyframes != solved);
                let (_, covariance) = filter.mounting();
                let widest = covariance.symmetric_eigenvalues().max().sqrt();
                assert!(widest > 0.5 * known, "{widest} m at step {step}");
            }
            solved = filter.solved_keyframes;
        }
        assert!(solutions < steps / 4, "{solutions} solutions in {steps} steps");
    }

    /// Names that are seen once, as of tracks that break, are dropped.
    #[test]
    fn names_that_are_seen_once_do_not_fill_the_window() {
        let options = SelfCalibratorOptions { wheel_base_m: 0.4, ..SelfCalibratorOptions::default() };
        let mut filter = SlidingWindow::new(&options).unwrap();
        let mut most = 0;
        for step in 0..150u64 {
            let seen: Vec<(u64, f64)> = (0..5).map(|k| (5 * step + k, wrap_angle((5 * step + k) as f64))).collect();
            filter.step(&WheelMotion::from_motion(0.05, 0.02, 0.4), &seen);
            most = most.max(filter.landmarks());
        }
        assert!((SEEN_ONCE_MAX..500).contains(&most), "{most}");
    }
}
