//! The memory of the default filter: poses and bearings that are solved anew, and summed up when there are too many.

use nalgebra::{DMatrix, DVector, Matrix2, RowVector2, SMatrix, Vector2, Vector3};

use super::dense::Factor;
use super::descent::Settled;
use super::graph::Node;
use super::loss::{Fit, LIMIT, Loss};
use super::measurement::Landmark;
use super::odometry::between;
use super::recursive::{FIRST, MOUNTING, Recursive, YOUNG};

/// Poses up to which other starts are tried where bearings do not fit.
const SETTLED: usize = 160;

/// Share of the bearings that may be far off: then they count not at all.
const FEW: f64 = 0.03;

/// How far the cost may be from what the linear problem foretells where the memory is at rest.
const TOLERANCE: f64 = 0.05;

impl Recursive {
    /// Linearises the memory about its own solution, and takes that for mean and covariance; the search for it starts where
    /// the filter is, if that is `trusted`.
    pub(super) fn linearise(&mut self, iterations: u32, trusted: bool) {
        let before = self.graph.landmarks.clone();
        self.graph.loss = FIRST;
        let old = trusted && self.graph.nodes.len() >= YOUNG && !self.alarm.uneasy();
        if old {
            self.take_filtered();
        }
        self.graph.reanchor();
        let mut solved = self.graph.settle(iterations, TOLERANCE, old);
        // A landmark may have been caught at a wrong distance; while little is known, all of them with a wrong yaw.
        let sigma = self.options.start_covariance[(2, 2)].sqrt();
        let turns: &[f64] = if self.graph.nodes.len() > SETTLED { &[0.0] } else { &[0.0, 0.0, 1.0, -1.0, 2.0, -2.0] };
        for (i, turn) in turns.iter().enumerate() {
            let fit = solved.as_ref().map(|solved| solved.fit);
            if fit.is_some_and(|fit| fit.beyond == 0) {
                break;
            }
            let mut other = self.graph.clone();
            if *turn != 0.0 {
                other.mounting = self.options.start.vector() + Vector3::z() * (turn * sigma);
            }
            other.place_landmarks(0, if i == 0 { LIMIT } else { 0.0 });
            let descent = other.descend(2 * iterations, TOLERANCE, 1e-3);
            if fit.is_none_or(|fit| descent.cost < fit.cost) {
                self.graph = other;
                solved = self.graph.settled();
            }
        }
        let fit = solved.as_ref().map(|solved| solved.fit);
        let few = |fit: Fit| (fit.beyond as f64) < FEW * fit.bearings as f64;
        if fit.is_some_and(|fit| fit.beyond > 0 && few(fit)) {
            solved = self.leave_out(iterations);
        } else if self.graph.nodes.len() >= YOUNG && fit.is_some_and(few) && self.graph.weigh_landmarks() {
            solved = self.graph.settle(iterations, TOLERANCE, false);
        }
        if !solved.is_some_and(|solved| self.adopt(&solved)) {
            // The filter's mean and covariance are about these.
            self.graph.landmarks = before;
        }
    }

    /// Solves the memory without the bearings that are far off, and with less of landmarks that are no points.
    fn leave_out(&mut self, iterations: u32) -> Option<Settled> {
        self.graph.loss = Loss::Cut(LIMIT);
        let solved = self.graph.settle(2, TOLERANCE, false);
        if !self.graph.weigh_landmarks() {
            return solved;
        }
        self.graph.loss = FIRST;
        self.graph.settle(iterations, TOLERANCE, false);
        self.graph.loss = Loss::Cut(LIMIT);
        self.graph.settle(2, TOLERANCE, false)
    }

    /// Starts the memory from the filter's mean: the poses since the last solution are bent to end where the filter is.
    fn take_filtered(&mut self) {
        self.graph.set_dense(&self.mean.rows(3, self.mean.len() - 3).into_owned());
        let (here, nodes) = (self.pose(), &mut self.graph.nodes);
        let Some(away) = nodes.last().map(|node| here - node.pose) else { return };
        let count = nodes.len().saturating_sub(self.solved) as f64;
        for (k, node) in nodes.iter_mut().skip(self.solved).enumerate() {
            node.pose += away * ((k + 1) as f64 / count);
        }
    }

    /// Takes the memory's solution for mean and covariance, unless it has none.
    fn adopt(&mut self, solved: &Settled) -> bool {
        let Some(factor) = Factor::touched(solved.equations.information.clone()) else { return false };
        self.covariance = factor.inverse();
        self.widening = self.graph.widening(&solved.equations, &self.covariance);
        self.mean = self.graph.dense().insert_rows(0, 3, 0.0);
        if let Some(node) = self.graph.nodes.last() {
            self.mean.fixed_rows_mut::<3>(0).copy_from(&node.pose);
        }
        self.solved = self.graph.nodes.len();
        self.solved_covariance = self.covariance.fixed_view::<3, 3>(MOUNTING, MOUNTING).into();
        true
    }

    /// Sums up the nodes to `at` in the prior, seen from there, and forgets landmarks that have not been seen since.
    pub(super) fn fold(&mut self, at: usize) {
        let Some(eliminated) = self.graph.eliminate(at, true, 0.0) else { return };
        let Some(joint) = Factor::touched(eliminated.information) else { return };
        let Some(ahead) = joint.solve(&eliminated.rhs) else { return };
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
        let Some(prior) = Factor::touched(0.5 * (&prior + prior.transpose())) else { return };
        let mut next = self.graph.clone();
        next.prior_mean = mean + &by_joint * ahead;
        next.prior_information = prior.inverse();
        next.landmarks = landmarks;
        next.spreads = kept.iter().map(|slot| self.graph.spreads[*slot]).collect();
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
        let Some(solved) = next.settled() else { return };
        let before = std::mem::replace(&mut self.graph, next);
        if self.adopt(&solved) {
            self.names = kept.iter().map(|slot| self.names[*slot]).collect();
            self.misses = kept.iter().map(|slot| self.misses[*slot]).collect();
        } else {
            self.graph = before;
        }
    }
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
