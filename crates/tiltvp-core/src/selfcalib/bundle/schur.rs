//! The normal equations with the poses eliminated (Schur complement): first inside runs of poses, then the poses between runs.
//!
//! A pose is coupled to its neighbours, to the calibration parameters, and to the landmarks seen from it. Eliminating a chain
//! from one end couples every pose to every landmark before it. A run of a few poses sees few landmarks, so its inner poses
//! are eliminated among these; only the poses between runs are coupled to all (nested dissection).

use nalgebra::{DVector, Matrix3, Vector3};

use super::cholesky::mirror_upper;
use super::linearisation::NormalEquations;
use super::pose_elimination::{EliminatedPose, PoseEquations, eliminate_pose, join};
use super::problem::BundleProblem;
use crate::interrupt::check;
use crate::selfcalib::model::{FitSummary, HomogeneousLandmark};

/// Poses of a run, and shared parameters up to which all poses are one run. Both change the time and, by rounding, the last
/// bits, not the solution (`runs_of_any_length_leave_the_same`). A run costs a matrix of the landmarks that it sees, which
/// pays only where these are far fewer than all; `just bench calibration` shows the time.
const RUN_POSES: usize = 20;
const ONE_RUN_WIDTH: usize = 48;

/// The inner poses of a run, eliminated.
struct PoseRun {
    /// The pose before them, to which all of them are coupled. 0 is the first keyframe, which is fixed.
    left: usize,
    /// The shared parameters to which they are coupled, ascending.
    columns: Vec<usize>,
    poses: Vec<EliminatedPose>,
}

/// The normal equations of (last pose if kept, shared parameters) with the other poses eliminated.
pub(crate) struct ReducedSystem {
    runs: Vec<PoseRun>,
    /// The poses between the runs, each with its place.
    between: Vec<(usize, EliminatedPose)>,
    /// Of (last pose if kept, shared parameters); symmetric.
    pub(crate) equations: NormalEquations,
    /// How well the problem fits at this linearisation.
    pub(crate) fit: FitSummary,
    /// The predicted reduction of the cost by the steps of the eliminated poses.
    pub(crate) predicted_reduction: f64,
}

impl ReducedSystem {
    /// Back substitution: the steps of all poses for a step of the shared parameters, and of the last pose if it was kept.
    pub(crate) fn pose_steps(
        &self,
        step: &DVector<f64>,
        kept: Option<Vector3<f64>>,
        keyframes: usize,
    ) -> Vec<Vector3<f64>> {
        self.back_substitute(step, kept, keyframes, 1.0)
    }

    /// The derivative of the pose steps along a step of the shared parameters, and of the last pose if it was kept: back
    /// substitution without the poses' right-hand sides.
    pub(crate) fn pose_derivatives(
        &self,
        step: &DVector<f64>,
        kept: Option<Vector3<f64>>,
        keyframes: usize,
    ) -> Vec<Vector3<f64>> {
        self.back_substitute(step, kept, keyframes, 0.0)
    }

    /// Back substitution with the poses' right-hand sides times `own`.
    fn back_substitute(
        &self,
        step: &DVector<f64>,
        kept: Option<Vector3<f64>>,
        keyframes: usize,
        own: f64,
    ) -> Vec<Vector3<f64>> {
        let mut steps = vec![Vector3::zeros(); keyframes + 1];
        let mut after = keyframes;
        if let Some(kept) = kept {
            after = keyframes - 1;
            steps[after] = kept;
        }
        for (at, pose) in self.between.iter().rev() {
            let mut rhs = pose.rhs * own - pose.next * steps[after];
            for (k, values) in pose.coupling.rows().into_iter().enumerate() {
                rhs[k] -= values.iter().zip(step.iter()).map(|(a, b)| a * b).sum::<f64>();
            }
            steps[*at] = pose.inverse * rhs;
            after = *at;
        }
        for run in &self.runs {
            let left = steps[run.left];
            for (i, pose) in run.poses.iter().enumerate().rev() {
                let at = run.left + 1 + i;
                let mut rhs = pose.rhs * own - pose.next * steps[at + 1] - pose.before * left;
                for (k, values) in pose.coupling.rows().into_iter().enumerate() {
                    rhs[k] -= values.iter().zip(&run.columns).map(|(a, c)| a * step[*c]).sum::<f64>();
                }
                steps[at] = pose.inverse * rhs;
            }
        }
        steps.truncate(keyframes);
        steps
    }
}

/// The normal equations that an eliminated run leaves: of the poses at its ends and of its columns.
struct RunEquations {
    left: PoseEquations,
    right: PoseEquations,
    /// Couples the two ends.
    across: Matrix3<f64>,
    shared: NormalEquations,
    fit: FitSummary,
    predicted_reduction: f64,
}

impl BundleProblem {
    /// The normal equations of the keyframes to `last`, damped by `damping` times their diagonal, with the poses before `last`
    /// eliminated, and its own too unless `keep`. `None` where they are singular.
    pub(crate) fn eliminate_poses(&self, last: usize, keep: bool, damping: f64) -> Option<ReducedSystem> {
        let length = if self.width() <= ONE_RUN_WIDTH { usize::MAX } else { RUN_POSES };
        self.eliminate_in_runs(last, keep, damping, length)
    }

    fn eliminate_in_runs(&self, last: usize, keep: bool, damping: f64, length: usize) -> Option<ReducedSystem> {
        let (width, calibration_width) = (self.width(), self.free.width());
        let away = self.shared() - &self.prior_mean;
        let rhs = -(&self.prior_information * &away);
        let mut fit = FitSummary { cost: self.scatter_cost() - 0.5 * away.dot(&rhs), ..FitSummary::default() };
        let mut shared = NormalEquations { information: self.prior_information.clone(), rhs };
        let (points, mut predicted_reduction) = (self.homogeneous_landmarks(), 0.0);
        if self.neighbour(0).is_none() {
            self.for_each_bearing_row(0, &points, |row| {
                fit.add(row.residual, self.loss);
                row.add_to(&mut shared, row.at, calibration_width);
            });
        }
        let mut at = PoseEquations::new(width);
        let (mut runs, mut between) = (Vec::new(), Vec::new());
        let (mut left, mut reach) = (0, calibration_width);
        while left < last {
            check();
            let right = left.saturating_add(length).min(last);
            let (run, blocks) = self.eliminate_run(left, right, damping, &points)?;
            for (c, column) in run.columns.iter().enumerate() {
                for (r, row) in run.columns[..=c].iter().enumerate() {
                    shared.information[(*row, *column)] += blocks.shared.information[(r, c)];
                }
                shared.rhs[*column] += blocks.shared.rhs[c];
            }
            fit += blocks.fit;
            predicted_reduction += blocks.predicted_reduction;
            reach = reach.max(run.columns.last().map_or(0, |c| c + 1));
            let mut next = PoseEquations::new(width);
            next.add(&blocks.right, &run.columns);
            if left > 0 {
                at.add(&blocks.left, &run.columns);
                let pose = eliminate_pose(at, blocks.across, damping, &mut next, reach, &mut shared)?;
                predicted_reduction += pose.predicted_reduction();
                between.push((left, pose));
            }
            runs.push(run);
            (at, left) = (next, right);
        }
        let mut kept = None;
        if keep {
            kept = Some(at);
        } else if last > 0 {
            let mut nothing = PoseEquations::new(width);
            let pose = eliminate_pose(at, Matrix3::zeros(), damping, &mut nothing, reach, &mut shared)?;
            predicted_reduction += pose.predicted_reduction();
            between.push((last, pose));
        }
        mirror_upper(&mut shared.information);
        for k in 0..width {
            shared.information[(k, k)] *= 1.0 + damping;
        }
        let equations = match kept {
            Some(pose) => join(&pose, &shared),
            None => shared,
        };
        Some(ReducedSystem { runs, between, equations, fit, predicted_reduction })
    }

    /// Eliminates the poses between two others.
    fn eliminate_run(
        &self,
        left: usize,
        right: usize,
        damping: f64,
        points: &[HomogeneousLandmark],
    ) -> Option<(PoseRun, RunEquations)> {
        let late = self.neighbour(left) == Some(left + 1);
        let (columns, places) = self.columns_seen(if late { left } else { left + 1 }..right + 1);
        let width = columns.len();
        let mut shared = NormalEquations::zeros(width);
        let mut ends = PoseEquations::new(width);
        let mut poses = Vec::with_capacity(right - left - 1);
        let (mut fit, mut predicted_reduction) = (FitSummary::default(), 0.0);
        let mut link = |from: usize, start: &mut PoseEquations, shared: &mut NormalEquations| {
            self.link(from, points, &places, start, shared, &mut fit)
        };
        let (across, mut at) = link(left, &mut ends, &mut shared);
        // The coupling of the current pose to the one at the left end.
        let mut before = across.transpose();
        for i in left + 1..right {
            check();
            let (across, mut next) = link(i, &mut at, &mut shared);
            let mut pose = eliminate_pose(at, across, damping, &mut next, width, &mut shared)?;
            predicted_reduction += pose.predicted_reduction();
            if left > 0 {
                pose.before = before;
                let onto = before.transpose() * pose.inverse;
                ends.own -= onto * before;
                ends.rhs -= onto * pose.rhs;
                ends.coupling.subtract_product(&onto, &pose.coupling, width);
                before = -(pose.next.transpose() * pose.inverse * before);
            }
            poses.push(pose);
            at = next;
        }
        let across = before.transpose();
        let equations = RunEquations { left: ends, right: at, across, shared, fit, predicted_reduction };
        Some((PoseRun { left, columns, poses }, equations))
    }

    /// The columns of the calibration parameters and of the landmarks that some keyframes see, and the place of each landmark
    /// among these; 0 for landmarks that are not seen.
    fn columns_seen(&self, keyframes: std::ops::Range<usize>) -> (Vec<usize>, Vec<usize>) {
        let calibration_width = self.free.width();
        let mut places = vec![0; self.landmarks.len()];
        for observation in self.keyframes[keyframes].iter().flat_map(|keyframe| &keyframe.observations) {
            places[observation.landmark] = 1;
        }
        let mut columns: Vec<usize> = (0..calibration_width).collect();
        for (slot, place) in places.iter_mut().enumerate().filter(|(_, place)| **place > 0) {
            *place = columns.len();
            columns.extend([calibration_width + 2 * slot, calibration_width + 2 * slot + 1]);
        }
        (columns, places)
    }
}

#[cfg(test)]
mod tests {
    use super::super::free_parameters::FreeParameters;
    use super::super::keyframe::{Keyframe, Observation};
    use super::*;
    use crate::selfcalib::model::{
        BearingLoss, InverseDistanceLandmark, MotionNoise, RelativeMotion, WheelMotion, camera_position, compose,
        predict,
    };
    use crate::selfcalib::options::SelfCalibratorOptions;
    use nalgebra::Vector2;

    /// A winding drive past twelve landmarks, each seen for a while and some again, with guesses that are a little off.
    fn drive(free: FreeParameters) -> BundleProblem {
        let options =
            SelfCalibratorOptions { wheel_base_m: 0.4, bearing_sigma_rad: 0.01, ..SelfCalibratorOptions::default() };
        let mut problem = BundleProblem::new(&options, &Vector3::new(0.2, -0.1, 0.3), free, BearingLoss::Huber(2.0));
        problem.noise = MotionNoise::new(1e-4);
        let wheels = problem.wheels;
        for i in 0..12 {
            let direction = f64::from(i) * 0.7 - 3.0;
            let anchor = Vector2::new(f64::from(i % 3), 0.1 * f64::from(i));
            let slot = problem.add_landmark(
                InverseDistanceLandmark { anchor, direction, log_inverse_distance: -0.8 },
                -0.8,
                1.5,
            );
            problem.scatters[slot] = 1.0 + 0.1 * f64::from(i);
        }
        for i in 0..31usize {
            let bend = 0.02 * (i as f64 * 0.4).sin();
            let reading = WheelMotion { left_m: 0.1 - bend, right_m: 0.1 + bend };
            let odometry = RelativeMotion::from_wheels(&reading, &wheels, &MotionNoise::new(1e-4));
            let last = problem.keyframes[i].pose;
            let pose = compose(&last, &odometry.motion) + Vector3::new(1e-3, -2e-3, 3e-3) * (i as f64 * 1.3).sin();
            let seen = [i / 3, (i / 3 + 1) % 12, (i / 2 + 5) % 12];
            let mounting = problem.mounting;
            let observations = seen.iter().filter(|_| i % 4 != 2).map(|slot| {
                let p = predict(&pose, &mounting, &problem.landmarks[*slot]);
                Observation::new(*slot, p.bearing + 0.02 * (i as f64 + 3.0 * *slot as f64).cos())
            });
            let observations = observations.collect();
            let keyframe = Keyframe::after(odometry, pose, 1.0);
            problem.keyframes.push(Keyframe { readings: vec![reading], observations, ..keyframe });
        }
        assert!(camera_position(&problem.keyframes[31].pose, &problem.mounting).norm() > 1.0);
        problem
    }

    #[test]
    fn runs_of_any_length_leave_the_same() {
        let all = FreeParameters::ALL;
        for (free, late) in [(FreeParameters::default(), false), (all, false), (all, true)] {
            let mut problem = drive(free);
            (problem.offset_s, problem.late) = (if free.offset { 0.3 } else { 0.0 }, late);
            for (last, keep, damping) in [(31, false, 0.0), (31, true, 0.0), (17, true, 0.0)] {
                if last == 17 && late {
                    // The bearings of the last pose depend on the one after it.
                    continue;
                }
                let whole = problem.eliminate_in_runs(last, keep, damping, usize::MAX).unwrap();
                let step = whole.equations.information.clone().lu().solve(&whole.equations.rhs).unwrap();
                for length in [1, 2, 7] {
                    let runs = problem.eliminate_in_runs(last, keep, damping, length).unwrap();
                    let scale = whole.equations.information.amax();
                    assert!(
                        (&runs.equations.information - &whole.equations.information).amax() < 1e-9 * scale,
                        "{length}"
                    );
                    assert!((&runs.equations.rhs - &whole.equations.rhs).amax() < 1e-9 * scale);
                    if last == 31 {
                        assert!((runs.fit.cost - problem.cost()).abs() < 1e-9 * runs.fit.cost);
                        let kept = keep.then(|| step.fixed_rows::<3>(0).into());
                        let shared = step.rows(if keep { 3 } else { 0 }, problem.width()).into_owned();
                        let (a, b) = (runs.pose_steps(&shared, kept, 32), whole.pose_steps(&shared, kept, 32));
                        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).amax() < 1e-8), "{length}");
                    }
                }
            }
        }
    }

    /// The residuals of a keyframe's bearings.
    fn residuals(problem: &BundleProblem, at: usize) -> Vec<f64> {
        let before: usize = problem.keyframes[..at].iter().map(|keyframe| keyframe.observations.len()).sum();
        problem.residuals()[before..][..problem.keyframes[at].observations.len()].to_vec()
    }

    #[test]
    fn rows_are_differences_by_pose_neighbour_time_centre_shutter_and_creep() {
        let mut problem = drive(FreeParameters::ALL_LOOKED_FOR);
        let uneven = Vector3::new(0.01, 0.0, -0.02);
        problem.keyframes[3].unevenness = [uneven, -uneven];
        let h = 1e-6;
        for late in [false, true] {
            (problem.offset_s, problem.late, problem.centre) = (0.4, late, Vector2::new(0.02, -0.01));
            problem.shutter_s = Vector2::new(0.5, -0.2);
            for at in [0, 1, 3, 31] {
                let difference = |change: &dyn Fn(&mut BundleProblem, f64)| -> Vec<f64> {
                    let [more, less] = [h, -h].map(|by| {
                        let mut changed = problem.clone();
                        change(&mut changed, by);
                        residuals(&changed, at)
                    });
                    more.iter().zip(less).map(|(more, less)| (more - less) / (2.0 * h)).collect()
                };
                let neighbour = problem.neighbour(at);
                assert_eq!(neighbour.is_none(), at == if late { 31 } else { 0 });
                let by_time = difference(&|problem, by| problem.offset_s += by);
                let by_centre = [0, 1].map(|axis| difference(&|problem, by| problem.centre[axis] += by));
                let by_shutter = [0, 1].map(|axis| difference(&|problem, by| problem.shutter_s[axis] += by));
                let poses = [Some(at), neighbour].map(|pose| {
                    pose.map(|pose| {
                        [0, 1, 2].map(|axis| difference(&|problem, by| problem.keyframes[pose].pose[axis] += by))
                    })
                });
                let by_yaw = difference(&|problem, by| problem.mounting.z += by);
                let mut row = 0;
                problem.for_each_bearing_row(at, &problem.homogeneous_landmarks(), |given| {
                    assert!((given.by_calibration[5] - by_time[row]).abs() < 1e-5);
                    for (axis, by_axis) in by_shutter.iter().enumerate() {
                        assert!((given.by_calibration[8 + axis] - by_axis[row]).abs() < 1e-5);
                    }
                    // At the last keyframe the camera has turned as far as it does, at the first not at all.
                    assert!((given.by_calibration[10] - by_yaw[row] * (at as f64 / 31.0 - 1.0)).abs() < 1e-5);
                    for (axis, by_axis) in by_centre.iter().enumerate() {
                        assert!((given.by_calibration[6 + axis] - by_axis[row]).abs() < 1e-5);
                    }
                    for (by_pose, given) in poses.iter().zip([given.by_pose, given.by_neighbour]) {
                        let Some(by_pose) = by_pose else { continue };
                        let by_pose = Vector3::from(by_pose.each_ref().map(|by_axis| by_axis[row]));
                        assert!((given - by_pose).amax() < 1e-5 * (1.0 + by_pose.amax()), "{given} {by_pose}");
                    }
                    row += 1;
                });
                assert_eq!(row, problem.keyframes[at].observations.len());
            }
        }
    }

    #[test]
    fn the_step_is_downhill_and_comes_to_rest() {
        let mut problem = drive(FreeParameters { wheels: true, ..FreeParameters::default() });
        let before = problem.cost();
        let descent = problem.levenberg_marquardt(50, 1e-9, 1e-3);
        assert!(descent.converged && descent.cost < before);
        let reduced = problem.eliminate_poses(31, false, 0.0).unwrap();
        assert!(
            reduced.equations.rhs.amax()
                < 1e-2 * problem.shared().len() as f64 * reduced.equations.information.amax().sqrt()
        );
    }
}
