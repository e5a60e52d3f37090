//! The default filter: landmarks by the logarithm of inverse distance, gated and iterated updates, and a memory that is linearised anew.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::alarm::Alarm;
use super::graph::{Free, Graph, Node, Sight, information};
use super::loss::{LIMIT, Slip};
use super::measurement::{Landmark, Prediction, Viewpoint, camera, predict};
use super::memory::FIRST;
use super::odometry::{Leg, WheelMotion, Wheels, compose, compose_jacobians};
use super::options::SelfCalibratorOptions;
use super::update::Row;
use crate::error::Result;
use crate::filter::Gate;
use crate::geometry::wrap_angle;

/// Where the mounting and the first landmark are in the state (pose, mounting, landmarks).
pub(super) const MOUNTING: usize = 3;
pub(super) const LANDMARKS: usize = 6;

/// Poses up to which the memory is solved anew at every step.
pub(super) const YOUNG: usize = 40;

/// Growth of the memory after which it is linearised anew where innovations are as they should be, and where they are not.
const GROWTH: f64 = 2.0;
const GROWTH_UNEASY: f64 = 1.15;

/// Standard deviations that the mounting may move before the memory is linearised anew, likewise.
const MOVED: f64 = 1.0;
const MOVED_UNEASY: f64 = 0.5;

/// Share of the mounting's standard deviations at the last solution from which on it is solved anew: where so much is learned
/// at once the Jacobians that it was learned with are not those of the answer.
const SHRUNK: f64 = 0.6;

/// Standard deviations beyond which the filter is not believed to have moved the mounting: the memory is solved from where it
/// was.
const WILD: f64 = 3.0;

/// Rejections in a row after which a landmark is taken to be another one.
const MAX_MISSES: u32 = 5;

/// Rejections in a row after which the memory is asked what is right.
const DISPUTED: u32 = 3;

/// Poses after which a landmark that is seen again, and not where it should be, closes a loop: the memory is solved anew.
const AWAY: usize = 10;

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
    /// Whether most landmarks were not where they should be, so that the motion was taken to be nearly unknown.
    pub(super) slipped: bool,
    /// Normalised innovation squared of bearings that contradict one another so much that none was fused before the memory was
    /// asked; 0 where they do not.
    pub(super) contradiction: f64,
}

/// The filter's state: (pose, mounting, landmarks) with its covariance, and the memory that it came from.
#[derive(Debug, Clone)]
pub(super) struct Recursive {
    pub(super) options: SelfCalibratorOptions,
    pub(super) gate: Gate,
    /// The memory, at its last solution.
    pub(super) graph: Graph,
    /// (pose, mounting, landmarks) now.
    pub(super) mean: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Names of the landmarks; `None` once a name means another one.
    pub(super) names: Vec<Option<u64>>,
    pub(super) misses: Vec<u32>,
    next_linearisation: usize,
    /// Poses that there were when the memory was last solved.
    pub(super) solved: usize,
    /// Standard deviations of the mounting then.
    pub(super) solved_sigma: Vector3<f64>,
    /// By which factor errors that the bearings of a landmark have in common widen what is said of the mounting.
    pub(super) widening: Matrix3<f64>,
    /// Covariance that the last motion added to the pose.
    pub(super) motion_noise: Matrix3<f64>,
    pub(super) alarm: Alarm,
}

impl Recursive {
    pub(super) fn new(options: &SelfCalibratorOptions) -> Result<Self> {
        let start = options.start.vector();
        let graph = Graph {
            mounting: start,
            wheels: Wheels::new(options.wheel_base_m),
            offset_s: 0.0,
            free: Free::default(),
            noise: options.motion_noise(),
            landmarks: Vec::new(),
            nodes: vec![Node::anchor()],
            prior_mean: DVector::from_column_slice(start.as_slice()),
            prior_information: DMatrix::from_column_slice(3, 3, inverse3(&options.start_covariance).as_slice()),
            bearing_sigma: options.bearing_sigma_rad,
            spreads: Vec::new(),
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
            solved: 1,
            solved_sigma: options.start_covariance.diagonal().map(f64::sqrt),
            widening: Matrix3::identity(),
            motion_noise: Matrix3::zeros(),
            alarm: Alarm::default(),
        })
    }

    pub(super) fn mounting(&self) -> (Vector3<f64>, Matrix3<f64>) {
        let own: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(MOUNTING, MOUNTING).into();
        (self.mean.fixed_rows::<3>(MOUNTING).into(), self.widening * own * self.widening.transpose())
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
        let mut outcome = Outcome::default();
        let rejected = self.update(seen, &mut outcome);
        let nodes = self.graph.nodes.len();
        let moved = self.mean.fixed_rows::<3>(MOUNTING) - self.graph.mounting;
        let limit = if self.alarm.uneasy() { MOVED_UNEASY } else { MOVED };
        let sigmas = moved.iter().zip(&self.solved_sigma).map(|(moved, sigma)| moved.abs() / sigma).fold(0.0, f64::max);
        let now = |i| self.covariance[(MOUNTING + i, MOUNTING + i)].sqrt();
        let shrunk = (0..3).any(|i| now(i) < SHRUNK * self.solved_sigma[i]);
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
        }
        for (name, misses) in self.names.iter_mut().zip(&self.misses) {
            if *misses >= MAX_MISSES {
                *name = None;
            }
        }
        self.alarm.note(&judged, self.gate.limit());
        outcome
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

    fn predict(&mut self, motion: &WheelMotion) {
        self.motion_noise = Matrix3::zeros();
        if motion.left_m == 0.0 && motion.right_m == 0.0 {
            return;
        }
        let leg = Leg::from_wheels(motion, &self.graph.wheels, &self.graph.noise);
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
        self.motion_noise = noise;
        self.covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&(0.5 * (own + own.transpose())));
        for c in 3..n {
            for r in 0..3 {
                self.covariance[(c, r)] = self.covariance[(r, c)];
            }
        }
    }

    pub(super) fn pose(&self) -> Vector3<f64> {
        self.mean.fixed_rows::<3>(0).into()
    }

    /// Where the camera is thought to be.
    pub(super) fn view(&self) -> Viewpoint {
        Viewpoint::new(&self.pose(), &self.mean.fixed_rows::<3>(MOUNTING).into())
    }

    /// What is expected of a landmark from there.
    pub(super) fn expect(&self, slot: usize, view: &Viewpoint) -> Prediction {
        let at = LANDMARKS + 2 * slot;
        let anchor = self.graph.landmarks[slot].anchor;
        let landmark = Landmark { anchor, direction: self.mean[at], closeness: self.mean[at + 1] };
        view.see(&landmark.ray())
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
            node.sights.push(Sight::new(slot, bearing));
        }
    }
}

fn inverse3(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    matrix.try_inverse().unwrap_or_else(Matrix3::zeros)
}
