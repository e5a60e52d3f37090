//! The default filter's state: landmarks by the logarithm of inverse distance, and the memory that it came from.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::alarm::Alarm;
use super::clustered::widened;
use super::graph::{Free, Graph, Node, Sight, information};
use super::loss::{Loss, Slip};
use super::measurement::{Landmark, Prediction, Viewpoint, camera, predict};
use super::odometry::{Leg, WheelMotion, Wheels, compose, compose_jacobians};
use super::options::SelfCalibratorOptions;
use crate::error::Result;
use crate::filter::Gate;

/// Where the mounting and the first landmark are in the state (pose, mounting, landmarks).
pub(super) const MOUNTING: usize = 3;
pub(super) const LANDMARKS: usize = 6;

/// Poses up to which the memory is solved anew at every step.
pub(super) const YOUNG: usize = 40;

/// How bearings count while the memory is solved: those far off linearly.
pub(super) const FIRST: Loss = Loss::Linear(3.0);

/// How far a motion may be from what the wheels tell before it counts less.
const SLIP: Slip = Slip(5.0);

/// The filter's state: (pose, mounting, landmarks) with its covariance, and the memory that it came from.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// Poses from which on it is solved anew in any case.
    pub(super) next_linearisation: usize,
    /// Poses that there were when the memory was last solved.
    pub(super) solved: usize,
    /// Covariance of the mounting then.
    pub(super) solved_covariance: Matrix3<f64>,
    /// Poses up to which a covariance below that is taken for an illusion, as it was at the last solution.
    pub(super) illusory_until: usize,
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
            solved_covariance: options.start_covariance,
            illusory_until: 0,
            widening: Matrix3::identity(),
            motion_noise: Matrix3::zeros(),
            alarm: Alarm::default(),
        })
    }

    /// Whether there are as many of everything as there are landmarks, and none else is seen.
    pub(super) fn is_consistent(&self) -> bool {
        let (graph, count) = (&self.graph, self.names.len());
        let width = graph.free.width() + 2 * count;
        let sights = || graph.nodes.iter().flat_map(|node| &node.sights);
        [self.misses.len(), graph.landmarks.len(), graph.spreads.len()].iter().all(|len| *len == count)
            && self.mean.len() == 3 + width
            && self.covariance.shape() == (3 + width, 3 + width)
            && graph.prior_mean.len() == width
            && graph.prior_information.shape() == (width, width)
            && graph.free == Free::default()
            && !graph.nodes.is_empty()
            && sights().all(|sight| sight.landmark < count)
    }

    /// The mounting with its covariance.
    pub(super) fn mounting(&self) -> (Vector3<f64>, Matrix3<f64>) {
        let mut covariance: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(MOUNTING, MOUNTING).into();
        if self.graph.nodes.len() < self.illusory_until {
            let factor = widened(&covariance, &self.solved_covariance);
            covariance = factor * covariance * factor.transpose();
        }
        (self.mean.fixed_rows::<3>(MOUNTING).into(), self.widening * covariance * self.widening.transpose())
    }

    /// The least-squares problem of what has been seen.
    pub(super) fn into_graph(self) -> Graph {
        self.graph
    }

    pub(super) fn landmarks(&self) -> usize {
        self.names.iter().flatten().count()
    }

    /// Moves by what the wheels tell.
    pub(super) fn predict(&mut self, motion: &WheelMotion) {
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

    /// Takes up a landmark in the direction in which it is seen, at the distance of the options.
    pub(super) fn start(&mut self, name: u64, bearing: f64) {
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
