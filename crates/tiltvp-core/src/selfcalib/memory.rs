//! The memory of the default filter: poses and bearings that are solved anew, and summed up when there are too many.

use nalgebra::{DMatrix, DVector, Matrix2, RowVector2, SMatrix, Vector2, Vector3};

use super::graph::{Graph, Node, factor};
use super::loss::Loss;
use super::measurement::Landmark;
use super::odometry::between;
use super::recursive::{MOUNTING, Recursive};

/// Poses up to which other starts are tried where bearings do not fit.
const SETTLED: usize = 160;

/// How bearings count in the memory: first those far off linearly, then not at all, if these are few.
pub(super) const FIRST: Loss = Loss::Linear(3.0);
pub(super) const LIMIT: f64 = 4.5;
const FEW: f64 = 0.03;

impl Recursive {
    /// Linearises the memory about its own solution, and takes that for mean and covariance.
    pub(super) fn linearise(&mut self, iterations: u32) {
        let mut next = self.graph.clone();
        next.loss = FIRST;
        next.reanchor();
        next.descend(iterations, 0.01, 0.0);
        // A landmark may have been caught at a wrong distance; while little is known, all of them with a wrong yaw.
        let sigma = self.options.start_covariance[(2, 2)].sqrt();
        let turns: &[f64] = if next.nodes.len() > SETTLED { &[0.0] } else { &[0.0, 0.0, 1.0, -1.0, 2.0, -2.0] };
        for (i, turn) in turns.iter().enumerate() {
            if next.farthest() > LIMIT {
                let mut other = next.clone();
                if *turn != 0.0 {
                    other.mounting = self.options.start.vector() + Vector3::z() * (turn * sigma);
                }
                other.place_landmarks(0, if i == 0 { LIMIT } else { 0.0 });
                let descent = other.descend(2 * iterations, 0.01, 1e-3);
                if descent.cost < next.cost() {
                    next = other;
                }
            }
        }
        let residuals = next.residuals();
        let outliers = residuals.iter().filter(|r| r.abs() > LIMIT).count();
        if outliers > 0 && (outliers as f64) < FEW * residuals.len() as f64 {
            next.loss = Loss::Cut(LIMIT);
            next.descend(2, 0.01, 0.0);
        }
        self.adopt(next);
    }

    /// Takes a solution of the memory for mean and covariance, unless it has none.
    fn adopt(&mut self, graph: Graph) -> bool {
        let Some(covariance) = joint_covariance(&graph) else { return false };
        let dense = graph.dense();
        self.mean = dense.insert_rows(0, 3, 0.0);
        if let Some(node) = graph.nodes.last() {
            self.mean.fixed_rows_mut::<3>(0).copy_from(&node.pose);
        }
        self.graph = graph;
        self.covariance = covariance;
        self.solved_sigma = Vector3::from_fn(|i, _| self.covariance[(MOUNTING + i, MOUNTING + i)].sqrt());
        true
    }

    /// Sums up the nodes to `at` in the prior, seen from there, and forgets landmarks that have not been seen since.
    pub(super) fn fold(&mut self, at: usize) {
        let Some(eliminated) = self.graph.eliminate(at, true, 0.0) else { return };
        let Some(joint) = factor(eliminated.information) else { return };
        let ahead = joint.solve(&eliminated.rhs);
        let joint = joint.inverse();
        let origin = self.graph.nodes[at].pose;
        let (sin, cos) = origin.z.sin_cos();
        let turn = Matrix2::new(cos, sin, -sin, cos);
        let mut keep = vec![false; self.graph.landmarks.len()];
        for sight in self.graph.nodes[at + 1..].iter().flat_map(|node| &node.sights) {
            keep[sight.landmark] = true;
        }
        let kept: Vec<usize> = (0..keep.len()).filter(|i| keep[*i] && self.names[*i].is_some()).collect();
        let width = 3 + 2 * kept.len();
        let mut by_joint = DMatrix::zeros(width, joint.nrows());
        for k in 0..3 {
            by_joint[(k, 3 + k)] = 1.0;
        }
        let mut mean = DVector::zeros(width);
        mean.fixed_rows_mut::<3>(0).copy_from(&self.graph.mounting);
        let mut landmarks = Vec::with_capacity(kept.len());
        for (i, slot) in kept.iter().enumerate() {
            let old = self.graph.landmarks[*slot];
            let anchor = turn * (old.anchor - origin.xy());
            let direction = old.direction - origin.z;
            let (by_pose, by_landmark) = reanchored(&anchor, direction, old.closeness, &turn);
            by_joint.fixed_view_mut::<2, 3>(3 + 2 * i, 0).copy_from(&by_pose);
            by_joint.fixed_view_mut::<2, 2>(3 + 2 * i, 6 + 2 * slot).copy_from(&by_landmark);
            mean[3 + 2 * i] = direction;
            mean[4 + 2 * i] = old.closeness;
            landmarks.push(Landmark { anchor, direction, closeness: old.closeness });
        }
        let prior = &by_joint * joint * by_joint.transpose();
        let Some(prior) = factor(0.5 * (&prior + prior.transpose())) else { return };
        let mut next = self.graph.clone();
        next.prior_mean = mean + &by_joint * ahead;
        next.prior_information = prior.inverse();
        next.landmarks = landmarks;
        next.nodes = self.graph.nodes[at..].to_vec();
        next.nodes[0] = Node::anchor();
        for node in &mut next.nodes[1..] {
            node.pose = between(&origin, &node.pose);
            node.sights.retain_mut(|sight| {
                let place = kept.iter().position(|slot| *slot == sight.landmark);
                sight.landmark = place.unwrap_or_default();
                place.is_some()
            });
        }
        if self.adopt(next) {
            self.names = kept.iter().map(|slot| self.names[*slot]).collect();
            self.misses = kept.iter().map(|slot| self.misses[*slot]).collect();
        }
    }
}

/// The covariance of (last pose, mounting, landmarks).
fn joint_covariance(graph: &Graph) -> Option<DMatrix<f64>> {
    let last = graph.nodes.len() - 1;
    if last > 0 {
        let inverse = factor(graph.eliminate(last, true, 0.0)?.information)?.inverse();
        return Some(inverse);
    }
    let inverse = factor(graph.eliminate(0, false, 0.0)?.information)?.inverse();
    let mut covariance = DMatrix::zeros(inverse.nrows() + 3, inverse.nrows() + 3);
    covariance.view_mut((3, 3), inverse.shape()).copy_from(&inverse);
    Some(covariance)
}

/// How the direction and the closeness of a landmark, as seen from the place of the robot, change with the pose that
/// was the origin's and with what they were before; `anchor` and `direction` are seen from there, `turn` leads there.
fn reanchored(
    anchor: &Vector2<f64>,
    direction: f64,
    closeness: f64,
    turn: &Matrix2<f64>,
) -> (SMatrix<f64, 2, 3>, Matrix2<f64>) {
    let inverse = closeness.exp();
    let (sin, cos) = direction.sin_cos();
    let (along, across) = (RowVector2::new(cos, sin), RowVector2::new(-sin, cos));
    // The homogeneous vector of the landmark, by the pose's heading and place.
    let w = Vector2::new(cos, sin) + anchor * inverse;
    let by_heading = Vector2::new(w.y, -w.x);
    let by_place = turn * -inverse;
    let mut by_pose = SMatrix::<f64, 2, 3>::zeros();
    by_pose.fixed_view_mut::<1, 2>(0, 0).copy_from(&(across * by_place));
    by_pose[(0, 2)] = (across * by_heading)[0];
    by_pose.fixed_view_mut::<1, 2>(1, 0).copy_from(&-(along * by_place));
    by_pose[(1, 2)] = -(along * by_heading)[0];
    (by_pose, Matrix2::identity())
}
