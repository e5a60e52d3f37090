//! A log as a least-squares problem that is solved as it grows, so that loops close while the map is still nearly right.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::graph::{Free, Graph, Node, Sight, information};
use super::log::{LogBearing, LogOptions};
use super::loss::{Loss, Slip};
use super::measurement::{Landmark, camera, predict, seen_at};
use super::odometry::{Leg, WheelMotion, Wheels, compose};
use crate::geometry::wrap_angle;

/// Poses with bearings after which the log so far is solved: a share of those that there are, within bounds.
const STAGE: (usize, usize, usize) = (5, 5, 50);

/// Poses with bearings after which a landmark that is seen again counts as another one where loops are not closed.
const GAP: usize = 60;

/// Spread of the directions in which a landmark was seen from which on it joins, radians.
const PARALLAX: f64 = 0.15;

/// Poses from which a landmark was seen after which it joins in any case.
const PATIENCE: usize = 12;

/// Share of the spread, beside standard deviations, by which the bearings of a landmark may disagree when it joins.
const DISAGREEMENT: (f64, f64) = (0.1, 6.0);

/// How bearings count while the log grows.
pub(super) const FIRST: Loss = Loss::Linear(2.0);

/// How far a motion may be from what the wheels tell before it counts less.
const SLIP: Slip = Slip(5.0);

/// Priors on (imbalance, logarithm of the wheel base) and on the time offset in seconds: weak.
const WHEELS_SIGMA: [f64; 2] = [0.2, 0.2];
const OFFSET_SIGMA_S: f64 = 1.0;

/// Bearings of a landmark that has no place yet: the nodes where they were taken, and the angles.
type Waiting = BTreeMap<u64, Vec<(usize, f64)>>;

/// A problem that grows, with the landmarks that have joined and those that wait.
struct Growing<'a> {
    options: &'a LogOptions,
    graph: Graph,
    /// Slot and last node of the landmarks that have joined.
    joined: BTreeMap<u64, (usize, usize)>,
    waiting: Waiting,
    /// Poses after which a landmark counts as another one.
    gap: usize,
    /// Whether something was seen from the last node.
    looked: bool,
}

/// The problem of the whole log, solved roughly as it grows; `free` is what is estimated meanwhile.
///
/// A landmark joins once it has been seen from directions that differ. Where `loops` are closed it keeps its place when it is
/// seen again; otherwise it counts as another one after some poses.
pub(super) fn grown(
    options: &LogOptions,
    guess: &Vector3<f64>,
    free: Free,
    loops: bool,
    readings: &[WheelMotion],
    times_s: Option<&[f64]>,
    order: &[LogBearing],
) -> Graph {
    let mut growing = Growing::new(options, guess, free, if loops { usize::MAX } else { GAP });
    growing.read(readings, times_s, order, true);
    growing.join(3, PARALLAX);
    growing.graph.reanchor();
    growing.graph.descend(6, 1.0, 1e-3);
    growing.graph.reanchor();
    growing.join(1, 0.0);
    growing.graph
}

/// The problem of the whole log with the mounting and, as far as they match, the poses of another one.
pub(super) fn along(
    options: &LogOptions,
    found: &Graph,
    free: Free,
    readings: &[WheelMotion],
    times_s: Option<&[f64]>,
    order: &[LogBearing],
) -> Graph {
    let mut growing = Growing::new(options, &found.mounting, free, usize::MAX);
    growing.read(readings, times_s, order, false);
    for (node, other) in growing.graph.nodes.iter_mut().zip(&found.nodes) {
        node.pose = other.pose;
    }
    growing.join(1, 0.0);
    growing.graph
}

fn empty(options: &LogOptions, guess: &Vector3<f64>, free: Free) -> Graph {
    let o = &options.filter;
    let width = free.width();
    let mut prior_mean = DVector::zeros(width);
    let mut prior_information = DMatrix::zeros(width, width);
    prior_mean.fixed_rows_mut::<3>(0).copy_from(&o.start.vector());
    let start = o.start_covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
    prior_information.fixed_view_mut::<3, 3>(0, 0).copy_from(&start);
    if free.wheels {
        prior_mean[4] = o.wheel_base_m.ln();
        for (k, sigma) in WHEELS_SIGMA.iter().enumerate() {
            prior_information[(3 + k, 3 + k)] = 1.0 / (sigma * sigma);
        }
    }
    if free.offset {
        let at = free.offset_at();
        prior_information[(at, at)] = 1.0 / (OFFSET_SIGMA_S * OFFSET_SIGMA_S);
    }
    Graph {
        mounting: *guess,
        wheels: Wheels::new(o.wheel_base_m),
        offset_s: 0.0,
        free,
        noise: o.motion_noise(),
        landmarks: Vec::new(),
        nodes: vec![Node::anchor()],
        prior_mean,
        prior_information,
        bearing_sigma: o.bearing_sigma_rad,
        spreads: Vec::new(),
        loss: FIRST,
        slip: SLIP,
    }
}

impl<'a> Growing<'a> {
    fn new(options: &'a LogOptions, guess: &Vector3<f64>, free: Free, gap: usize) -> Self {
        let graph = empty(options, guess, free);
        Self { options, graph, joined: BTreeMap::new(), waiting: Waiting::new(), gap, looked: true }
    }

    /// Adds a log, solving it as it grows if `solve`; otherwise all landmarks wait.
    fn read(&mut self, readings: &[WheelMotion], times_s: Option<&[f64]>, order: &[LogBearing], solve: bool) {
        let (mut rest, mut solved) = (order, 1);
        for (step, reading) in readings.iter().enumerate() {
            let due = self.graph.nodes.len() >= solved + (solved / STAGE.0).clamp(STAGE.1, STAGE.2);
            if solve && due && self.looked {
                self.join(3, PARALLAX);
                self.graph.reanchor();
                self.graph.descend(6, 1.0, 1e-3);
                solved = self.graph.nodes.len();
            }
            let seconds = times_s.map_or(0.0, |t| if step == 0 { 0.0 } else { t[step] - t[step - 1] });
            self.advance(reading, seconds);
            let (now, later) = rest.split_at(rest.partition_point(|b| b.step <= step));
            rest = later;
            for seen in now {
                self.look(seen);
            }
        }
        if !self.looked && self.graph.nodes.len() > 1 {
            self.graph.nodes.pop();
        }
    }

    /// Adds a step's motion.
    fn advance(&mut self, reading: &WheelMotion, seconds: f64) {
        if reading.left_m == 0.0 && reading.right_m == 0.0 {
            return;
        }
        let graph = &mut self.graph;
        let leg = Leg::from_wheels(reading, &graph.wheels, &graph.noise);
        let velocity = if seconds > 0.0 { leg.motion / seconds } else { Vector3::zeros() };
        let Some(last) = graph.nodes.last_mut() else { return };
        let pose = compose(&last.pose, &leg.motion);
        if self.looked {
            let information = information(&leg.covariance);
            graph.nodes.push(Node { pose, leg, information, readings: vec![*reading], velocity, sights: Vec::new() });
            self.looked = false;
        } else {
            last.leg = last.leg.then(&leg);
            last.information = information(&last.leg.covariance);
            last.readings.push(*reading);
            last.velocity = velocity;
            last.pose = pose;
        }
    }

    /// Adds a bearing, but for one of a landmark that has been seen from this pose before.
    fn look(&mut self, seen: &LogBearing) {
        let here = self.graph.nodes.len() - 1;
        self.looked = true;
        let gap = self.gap;
        if let Some((slot, last)) = self.joined.get_mut(&seen.landmark).filter(|(_, last)| here - last <= gap) {
            if *last < here {
                self.graph.nodes[here].sights.push(Sight::new(*slot, seen.bearing_rad));
                *last = here;
            }
            return;
        }
        let waiting = self.waiting.entry(seen.landmark).or_default();
        if waiting.last().is_some_and(|(last, _)| here - last > gap) {
            waiting.clear();
        }
        if waiting.last().is_none_or(|(node, _)| *node != here) {
            waiting.push((here, seen.bearing_rad));
        }
    }

    /// Gives a place to the landmarks that were seen so often, from directions so different or for long.
    fn join(&mut self, sights: usize, parallax: f64) {
        let names: Vec<u64> = self.waiting.keys().copied().collect();
        for name in names {
            let Some(seen) = self.waiting.get(&name).filter(|seen| seen.len() >= sights) else { continue };
            let spread = self.spread(seen);
            let (landmark, off) = self.placed(seen);
            let (share, sigmas) = DISAGREEMENT;
            let agree = off <= share * spread + sigmas * self.graph.bearing_sigma;
            if !(sights == 1 || spread >= parallax && agree || seen.len() >= PATIENCE) {
                continue;
            }
            let o = &self.options.filter;
            let slot = self.graph.add_landmark(landmark, -o.start_distance_m.ln(), o.start_distance_log_sigma);
            let mut last = 0;
            for (node, bearing) in self.waiting.remove(&name).into_iter().flatten() {
                self.graph.nodes[node].sights.push(Sight::new(slot, bearing));
                last = node;
            }
            self.joined.insert(name, (slot, last));
        }
    }

    /// How far apart the directions are in which a landmark was seen.
    fn spread(&self, seen: &[(usize, f64)]) -> f64 {
        let direction = |(node, bearing): &(usize, f64)| bearing + self.graph.nodes[*node].pose.z;
        let first = seen.first().map_or(0.0, direction);
        let (low, high) = seen.iter().fold((0.0f64, 0.0f64), |(low, high), sight| {
            let d = wrap_angle(direction(sight) - first);
            (low.min(d), high.max(d))
        });
        high - low
    }

    /// The landmark in the direction of its first bearing at the distance that all agree with best, and their mean
    /// disagreement in radians.
    fn placed(&self, seen: &[(usize, f64)]) -> (Landmark, f64) {
        let graph = &self.graph;
        let pose = |node: usize| graph.pose_of_sights(&graph.nodes[node]).0;
        let (first, bearing) = seen[0];
        let first = pose(first);
        let anchor = camera(&first, &graph.mounting);
        let off = |landmark: &Landmark| {
            let one = |(node, bearing): &(usize, f64)| {
                wrap_angle(predict(&pose(*node), &graph.mounting, landmark).bearing - bearing).abs()
            };
            seen.iter().map(one).sum::<f64>() / seen.len() as f64
        };
        let at = |closeness: f64| seen_at(anchor, closeness, &first, &graph.mounting, bearing);
        let direction = bearing + first.z + graph.mounting.z;
        let prior = -self.options.filter.start_distance_m.ln();
        let unlikely = |closeness: f64| {
            let sigmas = (closeness - prior) / self.options.filter.start_distance_log_sigma;
            0.5 * sigmas * sigmas * graph.bearing_sigma / seen.len() as f64
        };
        let mut best = prior;
        for step in [0.4, 0.05] {
            let near = best;
            best = (-8..=8)
                .map(|k| near + step * f64::from(k))
                .filter_map(|closeness| Some((closeness, off(&at(closeness)?) + unlikely(closeness))))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .map_or(near, |(closeness, _)| closeness);
        }
        let landmark = Landmark { anchor, direction, closeness: best };
        (landmark, off(&landmark))
    }
}
