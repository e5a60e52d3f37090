//! The default filter: landmarks by the logarithm of inverse distance, gated and iterated updates, and a memory that is linearised anew.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix2, Matrix3, RowVector2, SMatrix, Vector2, Vector3};

use super::alarm::Alarm;
use super::graph::{Free, Graph, Node, Sight, factor, information};
use super::loss::{Loss, Slip};
use super::measurement::{Landmark, Prediction, camera, predict};
use super::odometry::{Leg, WheelMotion, Wheels, between, compose, compose_jacobians};
use super::options::SelfCalibratorOptions;
use crate::error::Result;
use crate::filter::Gate;
use crate::geometry::wrap_angle;

/// Where the mounting and the first landmark are in the state (pose, mounting, landmarks).
const MOUNTING: usize = 3;
const LANDMARKS: usize = 6;

/// Most linearisations of one update.
const MAX_ITERATIONS: u32 = 4;

/// Poses up to which the memory is solved anew at every step.
const YOUNG: usize = 40;

/// Poses up to which other starts are tried where bearings do not fit.
const SETTLED: usize = 160;

/// Growth of the memory after which it is linearised anew.
const GROWTH: f64 = 1.15;

/// Standard deviations that the mounting may move before the memory is linearised anew.
const MOVED: f64 = 0.5;

/// Rejections in a row after which a landmark is taken to be another one.
const MAX_MISSES: u32 = 5;

/// How bearings count in the memory: first those far off linearly, then not at all.
const FIRST: Loss = Loss::Linear(3.0);
const LIMIT: f64 = 4.5;

/// How far a motion may be from what the wheels tell before it counts less.
const SLIP: Slip = Slip(5.0);

/// What a step found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Outcome {
    /// Normalised innovation squared of the bearings that were fused.
    pub(super) nis: f64,
    pub(super) used: usize,
    pub(super) rejected: usize,
    pub(super) started: usize,
}

/// The filter's state: (pose, mounting, landmarks) with its covariance, and the memory that it came from.
#[derive(Debug, Clone)]
pub(super) struct Recursive {
    options: SelfCalibratorOptions,
    gate: Gate,
    /// The memory, at its last solution.
    graph: Graph,
    /// (pose, mounting, landmarks) now.
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Names of the landmarks; `None` once a name means another one.
    names: Vec<Option<u64>>,
    misses: Vec<u32>,
    next_linearisation: usize,
    /// Standard deviations of the mounting when the memory was last solved.
    solved_sigma: Vector3<f64>,
    pub(super) alarm: Alarm,
}

/// A bearing of a known landmark, linearised.
struct Row {
    slot: usize,
    bearing: f64,
    p: Prediction,
}

impl Recursive {
    pub(super) fn new(options: &SelfCalibratorOptions) -> Result<Self> {
        let start = options.start.vector();
        let graph = Graph {
            mounting: start,
            wheels: Wheels::new(options.wheel_base_m),
            offset_s: 0.0,
            free: Free::default(),
            k_m: options.odometry_k_m,
            landmarks: Vec::new(),
            nodes: vec![Node::anchor()],
            prior_mean: DVector::from_column_slice(start.as_slice()),
            prior_information: DMatrix::from_column_slice(3, 3, inverse3(&options.start_covariance).as_slice()),
            bearing_sigma: options.bearing_sigma_rad,
            loss: FIRST,
            slip: SLIP,
        };
        let mut mean = DVector::zeros(LANDMARKS);
        mean.fixed_rows_mut::<3>(MOUNTING).copy_from(&start);
        let mut covariance = DMatrix::zeros(LANDMARKS, LANDMARKS);
        covariance.fixed_view_mut::<3, 3>(MOUNTING, MOUNTING).copy_from(&options.start_covariance);
        Ok(Self {
            options: *options,
            gate: Gate::new(options.gate_probability, 1)?,
            graph,
            mean,
            covariance,
            names: Vec::new(),
            misses: Vec::new(),
            next_linearisation: 3,
            solved_sigma: options.start_covariance.diagonal().map(f64::sqrt),
            alarm: Alarm::default(),
        })
    }

    pub(super) fn mounting(&self) -> (Vector3<f64>, Matrix3<f64>) {
        (self.mean.fixed_rows::<3>(MOUNTING).into(), self.covariance.fixed_view::<3, 3>(MOUNTING, MOUNTING).into())
    }

    /// The least-squares problem of what has been seen.
    pub(super) fn into_graph(self) -> Graph {
        self.graph
    }

    pub(super) fn landmarks(&self) -> usize {
        self.names.iter().flatten().count()
    }

    /// Moves, then looks.
    pub(super) fn step(&mut self, motion: &WheelMotion, seen: &[(u64, f64)]) -> Outcome {
        self.predict(motion);
        let outcome = self.update(seen);
        let nodes = self.graph.nodes.len();
        let moved = self.mean.fixed_rows::<3>(MOUNTING) - self.graph.mounting;
        let far = moved.iter().zip(&self.solved_sigma).any(|(moved, sigma)| moved.abs() > MOVED * sigma);
        let due = nodes >= self.next_linearisation || far;
        if due && nodes > 2 && self.graph.nodes.last().is_some_and(|node| !node.sights.is_empty()) {
            self.linearise(if nodes < YOUNG { 12 } else { 4 });
            if nodes > self.options.memory as usize {
                self.fold(nodes / 2);
            }
            let nodes = self.graph.nodes.len();
            let grown = if nodes < YOUNG { nodes + 1 } else { (nodes as f64 * GROWTH) as usize };
            self.next_linearisation = grown.max(nodes + 1);
        }
        outcome
    }

    fn predict(&mut self, motion: &WheelMotion) {
        if motion.left_m == 0.0 && motion.right_m == 0.0 {
            return;
        }
        let leg = Leg::from_wheels(motion, &self.graph.wheels, self.graph.k_m);
        let nodes = &mut self.graph.nodes;
        let alone = nodes.len() == 1;
        let Some(last) = nodes.last_mut() else { return };
        let pose = compose(&last.pose, &leg.motion);
        if alone || !last.sights.is_empty() {
            let information = information(&leg.covariance);
            nodes.push(Node { pose, leg, information, ..Node::anchor() });
        } else {
            last.leg = last.leg.then(&leg);
            last.information = information(&last.leg.covariance);
            last.pose = pose;
        }
        let before = self.pose();
        self.mean.fixed_rows_mut::<3>(0).copy_from(&compose(&before, &leg.motion));
        let (first, second) = compose_jacobians(&before, &leg.motion);
        let noise = second * leg.covariance * second.transpose();
        let n = self.covariance.nrows();
        for c in 0..n {
            let column: Vector3<f64> = self.covariance.fixed_view::<3, 1>(0, c).into();
            self.covariance.fixed_view_mut::<3, 1>(0, c).copy_from(&(first * column));
        }
        let own: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(0, 0).into();
        let own = own * first.transpose() + noise;
        self.covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&(0.5 * (own + own.transpose())));
        for c in 3..n {
            for r in 0..3 {
                self.covariance[(c, r)] = self.covariance[(r, c)];
            }
        }
    }

    fn pose(&self) -> Vector3<f64> {
        self.mean.fixed_rows::<3>(0).into()
    }

    /// What is expected of a landmark.
    fn expect(&self, slot: usize) -> Prediction {
        let at = LANDMARKS + 2 * slot;
        let anchor = self.graph.landmarks[slot].anchor;
        let landmark = Landmark { anchor, direction: self.mean[at], closeness: self.mean[at + 1] };
        predict(&self.pose(), &self.mean.fixed_rows::<3>(MOUNTING).into(), &landmark)
    }

    fn update(&mut self, seen: &[(u64, f64)]) -> Outcome {
        let mut outcome = Outcome::default();
        let mut rows = Vec::with_capacity(seen.len());
        let mut fresh = Vec::new();
        for &(name, bearing) in seen {
            match self.names.iter().position(|known| *known == Some(name)) {
                Some(slot) => {
                    // The robot has not moved since it was seen: nothing new.
                    let again = self.graph.nodes.last().is_some_and(|n| n.sights.iter().any(|s| s.landmark == slot));
                    if !again {
                        rows.push(Row { slot, bearing, p: self.expect(slot) });
                    }
                }
                None => fresh.push((name, bearing)),
            }
        }
        if let Some(node) = self.graph.nodes.last_mut() {
            node.sights.extend(rows.iter().map(|row| Sight { landmark: row.slot, bearing: row.bearing }));
        }
        self.fuse(rows, &mut outcome);
        for (name, bearing) in fresh {
            self.start(name, bearing);
            outcome.started += 1;
        }
        self.alarm.note(&outcome, self.gate.limit());
        outcome
    }

    /// The Jacobian of a row times the covariance, a column for each row.
    fn spread(&self, rows: &[Row]) -> DMatrix<f64> {
        let n = self.covariance.nrows();
        let mut spread = DMatrix::zeros(n, rows.len());
        for (row, mut out) in rows.iter().zip(spread.column_iter_mut()) {
            for (at, by) in entries(row) {
                out.axpy(by, &self.covariance.column(at), 1.0);
            }
        }
        spread
    }

    fn fuse(&mut self, mut rows: Vec<Row>, outcome: &mut Outcome) {
        let noise = self.options.bearing_sigma_rad.powi(2);
        let mut spread = self.spread(&rows);
        let variance = |row: &Row, column: usize, spread: &DMatrix<f64>| {
            entries(row).iter().map(|(at, by)| by * spread[(*at, column)]).sum::<f64>() + noise
        };
        let passes: Vec<bool> = rows
            .iter()
            .enumerate()
            .map(|(i, row)| {
                let y = wrap_angle(row.bearing - row.p.bearing);
                self.gate.passes(y * y / variance(row, i, &spread))
            })
            .collect();
        for (row, passed) in rows.iter().zip(&passes) {
            let misses = &mut self.misses[row.slot];
            *misses = if *passed { 0 } else { *misses + 1 };
            if *misses >= MAX_MISSES {
                self.names[row.slot] = None;
            }
        }
        outcome.rejected = passes.iter().filter(|passed| !**passed).count();
        if outcome.rejected > 0 {
            let mut kept = passes.iter();
            rows.retain(|_| *kept.next().unwrap_or(&false));
            spread = self.spread(&rows);
        }
        if rows.is_empty() {
            return;
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
                    *y += entries(row).iter().map(|(at, by)| by * back[*at]).sum::<f64>();
                }
            }
            let mut s = DMatrix::zeros(rows.len(), rows.len());
            for (i, row) in rows.iter().enumerate() {
                let entries = entries(row);
                for j in 0..=i {
                    s[(i, j)] = entries.iter().map(|(at, by)| by * spread[(*at, j)]).sum();
                }
                s[(i, i)] += noise;
            }
            let Some(lower) = Cholesky::new(s).map(Cholesky::unpack) else { return };
            let whitened = whiten(spread.clone(), &lower);
            let Some(y) = lower.solve_lower_triangular(&innovation) else { return };
            if iteration == 0 {
                outcome.nis = y.norm_squared();
            }
            let step = &whitened * y;
            let now = &before + &step;
            let moved = &now - &self.mean;
            let far = (0..LANDMARKS).any(|i| moved[i].abs() > 0.05 * self.covariance[(i, i)].sqrt().max(1e-6));
            self.mean = now;
            if !far || iteration + 1 == MAX_ITERATIONS {
                self.covariance.gemm(-1.0, &whitened, &whitened.transpose(), 1.0);
                break;
            }
            for row in &mut rows {
                row.p = self.expect(row.slot);
            }
        }
    }

    /// Takes up a landmark in the direction in which it is seen, at the distance of the options.
    fn start(&mut self, name: u64, bearing: f64) {
        let (pose, mounting): (_, Vector3<f64>) = (self.pose(), self.mean.fixed_rows::<3>(MOUNTING).into());
        let closeness = -self.options.start_distance_m.ln();
        let sigma = self.options.start_distance_log_sigma;
        let direction = bearing + pose.z + mounting.z;
        let landmark = Landmark { anchor: camera(&pose, &mounting), direction, closeness };
        // direction = bearing - (what the bearing depends on but for the direction).
        let p = predict(&pose, &mounting, &landmark);
        let n = self.covariance.nrows();
        let mut cross = DVector::zeros(n);
        for i in 0..3 {
            cross.axpy(-p.by_pose[i], &self.covariance.column(i), 1.0);
            cross.axpy(-p.by_mounting[i], &self.covariance.column(MOUNTING + i), 1.0);
        }
        let own: f64 = (0..3).map(|i| -p.by_pose[i] * cross[i] - p.by_mounting[i] * cross[MOUNTING + i]).sum();
        let covariance = std::mem::replace(&mut self.covariance, DMatrix::zeros(0, 0));
        let mut grown = covariance.resize(n + 2, n + 2, 0.0);
        grown.view_mut((0, n), (n, 1)).copy_from(&cross);
        grown.view_mut((n, 0), (1, n)).copy_from(&cross.transpose());
        grown[(n, n)] = own + self.options.bearing_sigma_rad.powi(2);
        grown[(n + 1, n + 1)] = sigma * sigma;
        self.covariance = grown;
        let grown = std::mem::replace(&mut self.mean, DVector::zeros(0)).resize_vertically(n + 2, closeness);
        self.mean = grown;
        self.mean[n] = direction;
        let heading = self.graph.nodes.last().map_or(0.0, |node| node.pose.z);
        let direction = bearing + heading + self.graph.mounting.z;
        let slot = self.graph.add_landmark(Landmark { direction, ..landmark }, closeness, sigma);
        self.names.push(Some(name));
        self.misses.push(0);
        if let Some(node) = self.graph.nodes.last_mut() {
            node.sights.push(Sight { landmark: slot, bearing });
        }
    }

    /// Linearises the memory about its own solution, and takes that for mean and covariance.
    fn linearise(&mut self, iterations: u32) {
        let mut next = self.graph.clone();
        next.loss = FIRST;
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
        if next.farthest() > LIMIT {
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
    fn fold(&mut self, at: usize) {
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

/// `T L^-T`, column by column.
fn whiten(mut t: DMatrix<f64>, lower: &DMatrix<f64>) -> DMatrix<f64> {
    let rows = t.nrows();
    for j in 0..t.ncols() {
        let (done, rest) = t.as_mut_slice().split_at_mut(j * rows);
        let column = &mut rest[..rows];
        for (k, before) in done.chunks_exact(rows).enumerate() {
            let factor = lower[(j, k)];
            for (value, before) in column.iter_mut().zip(before) {
                *value -= factor * before;
            }
        }
        let scale = 1.0 / lower[(j, j)];
        for value in column.iter_mut() {
            *value *= scale;
        }
    }
    t
}

fn inverse3(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    matrix.try_inverse().unwrap_or_else(Matrix3::zeros)
}
