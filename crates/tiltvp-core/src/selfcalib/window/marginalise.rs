//! Marginalisation: the older keyframes become a prior on the mounting and on the landmarks that are still seen.

use nalgebra::{DMatrix, DVector, Matrix2, RowVector2, SMatrix, Vector2};

use super::state::SlidingWindow;
use crate::selfcalib::bundle::{BundleProblem, CholeskyFactor, Keyframe, ReducedSystem};
use crate::selfcalib::model::{InverseDistanceLandmark, between};

/// The places of the first landmark in (pose, mounting, landmarks) and in (mounting, landmarks).
const JOINT_LANDMARKS: usize = 6;
const SHARED_LANDMARKS: usize = 3;

impl SlidingWindow {
    /// Marginalises the keyframes before `at`, which becomes the first one, and drops landmarks that are not seen after it.
    /// Nothing changes where the equations are singular.
    pub(super) fn marginalise(&mut self, at: usize) {
        let mut seen = vec![false; self.problem.landmarks.len()];
        for observation in self.problem.keyframes[at + 1..].iter().flat_map(|keyframe| &keyframe.observations) {
            seen[observation.landmark] = true;
        }
        let kept: Vec<usize> =
            (0..seen.len()).filter(|slot| seen[*slot] && self.landmark_ids[*slot].is_some()).collect();
        let Some(system) = self.problem.eliminate_poses(at, true, 0.0) else { return };
        let Some(next) = marginalised(&self.problem, &system, at, &kept) else { return };
        let Some(solution) = next.solution() else { return };
        let before = std::mem::replace(&mut self.problem, next);
        if self.adopt(&solution) {
            self.landmark_ids = kept.iter().map(|slot| self.landmark_ids[*slot]).collect();
            self.rejections = kept.iter().map(|slot| self.rejections[*slot]).collect();
        } else {
            self.problem = before;
        }
    }
}

/// The problem of the keyframes from `at` on and of the landmarks that are kept. Its prior is the information of `system`, the
/// normal equations of (pose at `at`, shared parameters), in the frame of that pose.
fn marginalised(problem: &BundleProblem, system: &ReducedSystem, at: usize, kept: &[usize]) -> Option<BundleProblem> {
    let joint = CholeskyFactor::regularised(&system.equations.information)?;
    let ahead = joint.solve(&system.equations.rhs)?;
    let joint = joint.inverse();
    let origin = problem.keyframes[at].pose;
    let (sin, cos) = origin.z.sin_cos();
    let turn = Matrix2::new(cos, sin, -sin, cos);
    let width = SHARED_LANDMARKS + 2 * kept.len();
    let mut by_joint = DMatrix::zeros(width, joint.nrows());
    for k in 0..3 {
        by_joint[(k, 3 + k)] = 1.0;
    }
    let mut mean = DVector::zeros(width);
    mean.fixed_rows_mut::<3>(0).copy_from(&problem.mounting);
    let mut landmarks = Vec::with_capacity(kept.len());
    for (i, slot) in kept.iter().enumerate() {
        let old = problem.landmarks[*slot];
        let (row, column) = (SHARED_LANDMARKS + 2 * i, JOINT_LANDMARKS + 2 * slot);
        let anchor = turn * (old.anchor - origin.xy());
        let direction = old.direction - origin.z;
        let by_pose = landmark_by_pose(&anchor, direction, old.log_inverse_distance, &turn);
        by_joint.fixed_view_mut::<2, 3>(row, 0).copy_from(&by_pose);
        by_joint.fixed_view_mut::<2, 2>(row, column).copy_from(&Matrix2::identity());
        mean[row] = direction;
        mean[row + 1] = old.log_inverse_distance;
        landmarks.push(InverseDistanceLandmark { anchor, direction, log_inverse_distance: old.log_inverse_distance });
    }
    let prior = &by_joint * joint * by_joint.transpose();
    let prior = CholeskyFactor::regularised(&(0.5 * (&prior + prior.transpose())))?;
    let mut next = problem.clone();
    next.prior_mean = mean + &by_joint * ahead;
    next.prior_information = prior.inverse();
    next.landmarks = landmarks;
    next.scatters = kept.iter().map(|slot| problem.scatters[*slot]).collect();
    next.keyframes = problem.keyframes[at..].to_vec();
    next.keyframes[0] = Keyframe::anchor();
    for keyframe in &mut next.keyframes[1..] {
        keyframe.pose = between(&origin, &keyframe.pose);
        keyframe.observations.retain_mut(|observation| {
            let place = kept.iter().position(|slot| *slot == observation.landmark);
            observation.landmark = place.unwrap_or_default();
            place.is_some()
        });
    }
    Some(next)
}

/// The Jacobian of a landmark's (direction, logarithm of the inverse distance), in the frame of a pose, by that pose. `anchor` and
/// `direction` are in the frame of the pose; `turn` rotates into it.
fn landmark_by_pose(
    anchor: &Vector2<f64>,
    direction: f64,
    log_inverse_distance: f64,
    turn: &Matrix2<f64>,
) -> SMatrix<f64, 2, 3> {
    let inverse = log_inverse_distance.exp();
    let (sin, cos) = direction.sin_cos();
    let (along, across) = (RowVector2::new(cos, sin), RowVector2::new(-sin, cos));
    // The homogeneous vector of the landmark, and its derivatives by heading and place of the pose.
    let w = Vector2::new(cos, sin) + anchor * inverse;
    let by_heading = Vector2::new(w.y, -w.x);
    let by_place = turn * -inverse;
    let mut by_pose = SMatrix::<f64, 2, 3>::zeros();
    by_pose.fixed_view_mut::<1, 2>(0, 0).copy_from(&(across * by_place));
    by_pose[(0, 2)] = (across * by_heading)[0];
    by_pose.fixed_view_mut::<1, 2>(1, 0).copy_from(&-(along * by_place));
    by_pose[(1, 2)] = -(along * by_heading)[0];
    by_pose
}
