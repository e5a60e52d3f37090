//! The solution of a bundle problem: Gauss-Newton where it is nearly solved, Levenberg-Marquardt elsewhere.

use nalgebra::{DVector, Vector2, Vector3};

use super::cholesky::CholeskyFactor;
use super::problem::BundleProblem;
use super::schur::ReducedSystem;
use crate::interrupt::check;
use crate::selfcalib::model::{FitSummary, InverseDistanceLandmark, between, between_jacobians, compose};

/// Damping, as a share of the normal equations' diagonal, with which Levenberg-Marquardt starts where little is known: small
/// against every parameter that the drive determines, large against those that it does not.
pub(crate) const FIRST_DAMPING: f64 = 1e-3;

/// Damping with which it starts, or goes on, after a Gauss-Newton step that led up.
const SMALL_DAMPING: f64 = 1e-4;

/// Damping below which it is set to zero: there a step is that of Gauss-Newton to rounding.
const LEAST_DAMPING: f64 = 1e-9;

/// Damping above which there is no way down: a step is then below rounding.
const MOST_DAMPING: f64 = 1e9;

/// Damping from which on a small gain means nothing: the step is short because of the damping.
const CONVERGED_DAMPING: f64 = 1e-2;

/// What an undamped step may be predicted to gain where a descent that makes no way has converged: the rise of the cost at one standard
/// deviation. Beside a kink of a robust loss, and where one slip after another loses its weight, there is less to gain than is predicted.
const PROMISED_MOST: f64 = 0.5;

/// Relative difference of two costs that may be rounding of sums over some ten thousand residuals.
const ROUNDING: f64 = 1e-9;

/// How an optimisation ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DescentReport {
    pub(crate) iterations: u32,
    pub(crate) converged: bool,
    pub(crate) cost: f64,
}

/// The normal equations of (last pose, shared parameters) at a solution, and how well it fits.
pub(crate) struct Solution {
    pub(crate) system: ReducedSystem,
    pub(crate) fit: FitSummary,
}

/// The values of all unknowns, and the anchors of the landmarks.
struct SavedValues {
    poses: Vec<Vector3<f64>>,
    shared: DVector<f64>,
    landmarks: Vec<InverseDistanceLandmark>,
}

impl BundleProblem {
    fn save(&self) -> SavedValues {
        SavedValues { poses: self.poses(), shared: self.shared(), landmarks: self.landmarks.clone() }
    }

    fn restore(&mut self, saved: &SavedValues) {
        for (keyframe, pose) in self.keyframes.iter_mut().zip(&saved.poses) {
            keyframe.pose = *pose;
        }
        self.landmarks.clone_from(&saved.landmarks);
        self.set_shared(&saved.shared);
    }

    fn poses(&self) -> Vec<Vector3<f64>> {
        self.keyframes.iter().map(|keyframe| keyframe.pose).collect()
    }

    /// Takes the step of the poses as one of the motions between them. Where the far end of a long way moves by decimetres, poses that step
    /// straight stretch each motion by the square of how far they turn.
    fn recompose_poses(&mut self, before: &[Vector3<f64>], straight: &[Vector3<f64>]) {
        for at in 1..straight.len() {
            let [(old_start, start), (old_end, end)] = [at - 1, at].map(|at| (&before[at], &straight[at]));
            let motion = between(old_start, old_end);
            let (by_start, by_end) = between_jacobians(old_start, &motion);
            let motion = motion + by_start * (start - old_start) + by_end * (end - old_end);
            self.keyframes[at].pose = compose(&self.keyframes[at - 1].pose, &motion);
        }
    }

    /// Takes the step again as one of the motions between poses, and of landmarks in the frames of the poses that first see them, whose anchors
    /// it moves with these: to first order it is the same. From a fixed anchor the step of a landmark that goes with a pose by decimetres errs
    /// by its square, in all of its bearings. Does nothing, and says so, where the prior knows the direction of a landmark.
    fn take_relative_step(&mut self, before: &SavedValues) -> bool {
        let free = self.free.width();
        let knows = |i: usize| self.prior_information[(free + 2 * i, free + 2 * i)] > 0.0;
        if (0..self.landmarks.len()).any(knows) {
            return false;
        }
        let straight = self.poses();
        self.recompose_poses(&before.poses, &straight);
        let mut carried = vec![false; self.landmarks.len()];
        for ((keyframe, old_pose), straight) in self.keyframes.iter().zip(&before.poses).zip(&straight) {
            let step = straight - old_pose;
            for seen in &keyframe.observations {
                if std::mem::replace(&mut carried[seen.landmark], true) {
                    continue;
                }
                let old = before.landmarks[seen.landmark];
                let point = old.homogeneous();
                // How the landmark moves with the pose, in units of its distance, and the step from a fixed anchor that makes it so.
                let from_pose = (old.anchor - old_pose.xy()) * point.inverse_distance + point.along;
                let moved = step.xy() * point.inverse_distance + Vector2::new(-from_pose.y, from_pose.x) * step.z;
                let anchor = Vector3::new(old.anchor.x, old.anchor.y, 0.0);
                let landmark = &mut self.landmarks[seen.landmark];
                landmark.anchor = compose(&keyframe.pose, &between(old_pose, &anchor)).xy();
                landmark.direction += keyframe.pose.z - old_pose.z - point.along.perp(&moved);
                landmark.log_inverse_distance += point.along.dot(&moved);
            }
        }
        true
    }

    /// Moves all unknowns by the solution of normal equations. Returns the predicted reduction of the cost by the step of the
    /// parameters that were not eliminated. `None`, without a move, where the equations are singular or the step is not finite.
    pub(crate) fn take_step(&mut self, system: &ReducedSystem) -> Option<f64> {
        let step = CholeskyFactor::regularised(&system.equations.information)?.solve(&system.equations.rhs)?;
        let predicted_reduction = 0.5 * step.dot(&system.equations.rhs);
        let width = self.width();
        let kept = (step.len() > width).then(|| step.fixed_rows::<3>(0).into());
        let step = step.rows(step.len() - width, width).into_owned();
        let shared = self.shared() + &step;
        if !shared.iter().all(|x| x.is_finite()) {
            return None;
        }
        let steps = system.pose_steps(&step, kept, self.keyframes.len());
        for (keyframe, step) in self.keyframes.iter_mut().zip(steps) {
            keyframe.pose += step;
        }
        self.set_shared(&shared);
        Some(predicted_reduction)
    }

    /// Levenberg-Marquardt until the cost falls by less than `tolerance`, or would: beside a kink of a robust loss a step that
    /// is predicted to gain less may lead up.
    pub(crate) fn levenberg_marquardt(&mut self, max_iterations: u32, tolerance: f64, damping: f64) -> DescentReport {
        self.descend(max_iterations, tolerance, damping, false)
    }

    /// The same where the anchors of landmarks may be moved: not in a sliding window, whose prior is about them. Along a long way even little
    /// damping hides what bends it: only an undamped step tells that there is nothing to gain.
    pub(crate) fn levenberg_marquardt_carrying(
        &mut self,
        max_iterations: u32,
        tolerance: f64,
        damping: f64,
    ) -> DescentReport {
        self.descend(max_iterations, tolerance, damping, true)
    }

    fn descend(&mut self, max_iterations: u32, tolerance: f64, mut damping: f64, carrying: bool) -> DescentReport {
        let mut cost = self.cost();
        let mut iterations = 0;
        // What the last undamped step was predicted to gain, if no step has gained much since.
        let mut promised = None;
        while iterations < max_iterations {
            iterations += 1;
            check();
            let before = self.save();
            let last = self.keyframes.len() - 1;
            let system = self.eliminate_poses(last, false, damping);
            let moved = system.and_then(|system| Some(system.predicted_reduction + self.take_step(&system)?));
            let is_lower = |next: &f64| next.is_finite() && *next <= cost + ROUNDING * cost;
            let fixed = moved.map(|_| self.cost()).filter(is_lower);
            let carried = carrying && fixed.is_none() && moved.is_some() && self.take_relative_step(&before);
            let lower = fixed.or_else(|| carried.then(|| self.cost()).filter(is_lower));
            let gain = lower.map(|next| cost - next);
            if let Some(next) = lower {
                cost = next;
            } else if moved.is_some() {
                self.restore(&before);
            }
            if damping == 0.0 {
                promised = moved;
            }
            let is_small = |gain: Option<f64>| gain.is_some_and(|gain| gain < tolerance);
            let rests = damping < CONVERGED_DAMPING && (is_small(moved) || is_small(gain));
            if rests && (promised.is_some() || !carrying) {
                let converged = !carrying || promised.is_some_and(|gain| gain < PROMISED_MOST);
                return DescentReport { iterations, converged, cost };
            }
            if lower.is_some() {
                promised = None;
            }
            damping = match lower {
                _ if rests => 0.0,
                Some(_) if damping < LEAST_DAMPING => 0.0,
                Some(_) => 0.1 * damping,
                None if damping == 0.0 => SMALL_DAMPING,
                None => 10.0 * damping,
            };
            if damping > MOST_DAMPING {
                break;
            }
        }
        DescentReport { iterations, converged: false, cost }
    }

    /// Gauss-Newton until the linear problem predicts the cost to within `tolerance`, or [`Self::levenberg_marquardt`] where a
    /// step leads up. After a `rough` start the first prediction is not compared. Returns the normal equations at the solution;
    /// `None` where they are singular.
    pub(crate) fn gauss_newton(&mut self, max_iterations: u32, tolerance: f64, rough: bool) -> Option<Solution> {
        let last = self.keyframes.len() - 1;
        let mut reached = f64::INFINITY;
        let mut before = self.save();
        for iteration in 0..max_iterations {
            check();
            let here = self.eliminate_poses(last, true, 0.0).filter(|here| !rises(here.fit.cost, reached));
            let Some(here) = here else { break };
            before = self.save();
            reached = here.fit.cost;
            let Some(predicted_reduction) = self.take_step(&here) else { break };
            if rough && iteration == 0 {
                continue;
            }
            let fit = self.fit();
            if (fit.cost - (here.fit.cost - here.predicted_reduction - predicted_reduction)).abs() < tolerance {
                return Some(Solution { system: here, fit });
            }
            if rises(fit.cost, reached) {
                self.restore(&before);
                self.levenberg_marquardt(max_iterations - iteration, tolerance, SMALL_DAMPING);
                return self.solution();
            }
            reached = fit.cost;
        }
        let solution = self.solution().filter(|solution| !rises(solution.fit.cost, reached));
        if solution.is_some() {
            return solution;
        }
        self.restore(&before);
        self.levenberg_marquardt(max_iterations, tolerance, SMALL_DAMPING);
        self.solution()
    }

    /// The normal equations and the fit at the current values.
    pub(crate) fn solution(&self) -> Option<Solution> {
        let here = self.eliminate_poses(self.keyframes.len() - 1, true, 0.0)?;
        let fit = here.fit;
        Some(Solution { system: here, fit })
    }
}

/// Whether a cost is above another one beyond rounding, or NaN.
fn rises(cost: f64, reached: f64) -> bool {
    cost.is_nan() || cost > reached * (1.0 + ROUNDING)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::bundle::{FreeParameters, Keyframe, Observation};
    use crate::selfcalib::model::BearingLoss;
    use crate::selfcalib::options::SelfCalibratorOptions;

    const LANDMARK: InverseDistanceLandmark =
        InverseDistanceLandmark { anchor: Vector2::new(2.0, -1.0), direction: 0.4, log_inverse_distance: -1.6 };

    /// A pose that sees a landmark.
    fn problem() -> BundleProblem {
        let options = SelfCalibratorOptions::default();
        let mut problem =
            BundleProblem::new(&options, &Vector3::zeros(), FreeParameters::default(), BearingLoss::Huber(2.0));
        problem.add_landmark(LANDMARK, -1.6, 1.0);
        let seen = Observation::new(0, 0.3);
        problem.keyframes.push(Keyframe { pose: Vector3::new(3.0, 1.5, 0.8), ..Keyframe::anchor() });
        problem.keyframes[1].observations.push(seen);
        problem
    }

    fn point(landmark: &InverseDistanceLandmark) -> Vector3<f64> {
        let point = landmark.homogeneous();
        (point.anchor + point.along / point.inverse_distance).push(0.0)
    }

    #[test]
    fn a_landmark_that_goes_with_its_pose_stays_in_its_frame() {
        let mut problem = problem();
        let before = problem.save();
        let step = Vector3::new(0.2, -0.1, 0.05);
        // What the step makes of the landmark from its fixed anchor, to first order.
        let (pose, along) = (before.poses[1], LANDMARK.homogeneous().along);
        let from_pose = point(&LANDMARK).xy() - pose.xy();
        let moved =
            (step.xy() + Vector2::new(-from_pose.y, from_pose.x) * step.z) * LANDMARK.log_inverse_distance.exp();
        problem.keyframes[1].pose += step;
        problem.landmarks[0].direction += along.perp(&moved);
        problem.landmarks[0].log_inverse_distance -= along.dot(&moved);
        let in_frame = |problem: &BundleProblem| between(&problem.keyframes[1].pose, &point(&problem.landmarks[0]));
        let expected = between(&pose, &point(&LANDMARK)).xy();
        assert!((in_frame(&problem).xy() - expected).norm() > 1e-3);
        assert!(problem.take_relative_step(&before));
        assert!((in_frame(&problem).xy() - expected).norm() < 1e-12);
        problem.restore(&before);
        assert!(problem.landmarks[0] == LANDMARK && problem.keyframes[1].pose == pose);
    }

    #[test]
    fn a_way_that_turns_as_a_whole_is_not_stretched() {
        let mut problem = problem();
        let poses: Vec<_> =
            (0..5).map(|k| Vector3::new(f64::from(k), 0.1 * f64::from(k * k), 0.2 * f64::from(k))).collect();
        let turned: Vec<_> = poses.iter().map(|p| p + 0.1 * Vector3::new(-p.y, p.x, 1.0)).collect();
        problem.keyframes = turned.iter().map(|pose| Keyframe { pose: *pose, ..Keyframe::anchor() }).collect();
        problem.recompose_poses(&poses, &turned);
        for at in 1..poses.len() {
            let [old, straight, new] = [&poses, &turned, &problem.poses()].map(|way| between(&way[at - 1], &way[at]));
            assert!((straight - old).norm() > 1e-3 && (new - old).norm() < 1e-12, "{straight} {new} {old}");
        }
    }

    #[test]
    fn landmarks_whose_direction_the_prior_knows_stay() {
        let mut problem = problem();
        let before = problem.save();
        let at = problem.free.width();
        problem.prior_information[(at, at)] = 1.0;
        problem.keyframes[1].pose.x += 0.2;
        assert!(!problem.take_relative_step(&before) && problem.landmarks[0] == LANDMARK);
    }
}
