//! A stretch of a drive as a sparse least-squares problem: poses in a chain, each tied to the mounting and the landmarks.

use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};

use super::loss::{Fit, Loss, Slip};
use super::measurement::{Landmark, Viewpoint, camera, predict, seen_at};
use super::odometry::{Leg, MotionNoise, WheelMotion, Wheels, between, compose, compose_jacobians};
use crate::geometry::wrap_angle;

/// A bearing of a landmark.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Sight {
    pub(super) landmark: usize,
    pub(super) bearing: f64,
    /// Cosine and sine of it.
    pub(super) along: Vector2<f64>,
}

impl Sight {
    pub(super) fn new(landmark: usize, bearing: f64) -> Self {
        let (sin, cos) = bearing.sin_cos();
        Self { landmark, bearing, along: Vector2::new(cos, sin) }
    }
}

/// A pose of the robot, the motion that led to it from the one before, and what was seen there.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Node {
    pub(super) pose: Vector3<f64>,
    pub(super) leg: Leg,
    /// The inverse of the motion's covariance.
    pub(super) information: Matrix3<f64>,
    /// The readings that the leg is made of; kept only where the wheels are estimated.
    pub(super) readings: Vec<WheelMotion>,
    /// Motion per second when the node was reached, for the time offset.
    pub(super) velocity: Vector3<f64>,
    pub(super) sights: Vec<Sight>,
}

impl Node {
    /// The node that the others are seen from; nothing leads to it.
    pub(super) fn anchor() -> Self {
        Self {
            pose: Vector3::zeros(),
            leg: Leg::none(),
            information: Matrix3::zeros(),
            readings: Vec::new(),
            velocity: Vector3::zeros(),
            sights: Vec::new(),
        }
    }
}

/// The information in a motion's covariance, which is kept from being singular by a micrometre and a microradian.
pub(super) fn information(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let floored = covariance + Matrix3::from_diagonal(&Vector3::new(1e-12, 1e-12, 1e-12));
    floored.try_inverse().unwrap_or_else(Matrix3::zeros)
}

/// What is estimated beside the mounting and the landmarks.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Free {
    pub(super) wheels: bool,
    pub(super) offset: bool,
}

impl Free {
    /// How many numbers come before those of the landmarks.
    pub(super) fn width(self) -> usize {
        3 + 2 * usize::from(self.wheels) + usize::from(self.offset)
    }

    pub(super) fn offset_at(self) -> usize {
        3 + 2 * usize::from(self.wheels)
    }
}

/// Poses in a chain from a fixed anchor, and a dense block: mounting, wheels and time offset if free, landmarks.
///
/// Minimises half the sum of the squared, whitened residuals of motions, bearings (with a robust loss) and the prior.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Graph {
    pub(super) mounting: Vector3<f64>,
    pub(super) wheels: Wheels,
    pub(super) offset_s: f64,
    pub(super) free: Free,
    pub(super) noise: MotionNoise,
    pub(super) landmarks: Vec<Landmark>,
    pub(super) nodes: Vec<Node>,
    /// Mean of the dense block before the bearings of the nodes.
    pub(super) prior_mean: DVector<f64>,
    /// Information about it.
    pub(super) prior_information: DMatrix<f64>,
    pub(super) bearing_sigma: f64,
    /// By which factor the bearings of each landmark scatter more than `bearing_sigma`.
    pub(super) spreads: Vec<f64>,
    pub(super) loss: Loss,
    pub(super) slip: Slip,
}

/// Jacobians of a pose by the node's pose and by the time offset.
type ByPoseAndOffset = (Matrix3<f64>, Vector3<f64>);

impl Graph {
    /// Numbers in the dense block.
    pub(super) fn width(&self) -> usize {
        self.free.width() + 2 * self.landmarks.len()
    }

    /// The dense block as it is now.
    pub(super) fn dense(&self) -> DVector<f64> {
        let mut g = DVector::zeros(self.width());
        g.fixed_rows_mut::<3>(0).copy_from(&self.mounting);
        if self.free.wheels {
            g[3] = self.wheels.imbalance;
            g[4] = self.wheels.base_m.ln();
        }
        if self.free.offset {
            g[self.free.offset_at()] = self.offset_s;
        }
        for (i, landmark) in self.landmarks.iter().enumerate() {
            let at = self.free.width() + 2 * i;
            g[at] = landmark.direction;
            g[at + 1] = landmark.closeness;
        }
        g
    }

    /// This problem with the wheels as given if they are free here but should not be.
    pub(super) fn with_fixed_wheels(mut self, wheels: Wheels) -> Self {
        if self.free.wheels {
            self.prior_mean = self.prior_mean.remove_rows(3, 2);
            self.prior_information = self.prior_information.remove_rows(3, 2).remove_columns(3, 2);
            self.free.wheels = false;
            self.wheels = wheels;
            for node in self.nodes.iter_mut().skip(1) {
                node.leg = legs(&node.readings, &wheels, &self.noise);
            }
        }
        self
    }

    pub(super) fn set_dense(&mut self, g: &DVector<f64>) {
        self.mounting = g.fixed_rows::<3>(0).into();
        if self.free.wheels {
            self.wheels = Wheels { imbalance: g[3], base_m: g[4].exp() };
            for node in self.nodes.iter_mut().skip(1) {
                node.leg = legs(&node.readings, &self.wheels, &self.noise);
            }
        }
        if self.free.offset {
            self.offset_s = g[self.free.offset_at()];
        }
        for (i, landmark) in self.landmarks.iter_mut().enumerate() {
            let at = self.free.width() + 2 * i;
            landmark.direction = g[at];
            landmark.closeness = g[at + 1];
        }
    }

    /// Adds a landmark whose direction is unknown and whose closeness is known to be `closeness +- sigma`.
    pub(super) fn add_landmark(&mut self, landmark: Landmark, closeness: f64, sigma: f64) -> usize {
        let n = self.prior_mean.len();
        let mean = std::mem::replace(&mut self.prior_mean, DVector::zeros(0));
        self.prior_mean = mean.insert_rows(n, 2, 0.0);
        self.prior_mean[n] = landmark.direction;
        self.prior_mean[n + 1] = closeness;
        let information = std::mem::replace(&mut self.prior_information, DMatrix::zeros(0, 0));
        self.prior_information = information.insert_rows(n, 2, 0.0).insert_columns(n, 2, 0.0);
        self.prior_information[(n + 1, n + 1)] = 1.0 / (sigma * sigma);
        self.landmarks.push(landmark);
        self.spreads.push(1.0);
        self.landmarks.len() - 1
    }

    /// The pose at which the bearings of a node were taken, with its Jacobian by the node's pose and by the time offset.
    pub(super) fn pose_of_sights(&self, node: &Node) -> (Vector3<f64>, Option<ByPoseAndOffset>) {
        if !self.free.offset && self.offset_s == 0.0 {
            return (node.pose, None);
        }
        let (tau, v) = (self.offset_s, node.velocity);
        let (sin, cos) = (0.5 * tau * v.z).sin_cos();
        let turned = Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
        let moved = turned * tau;
        let (first, second) = compose_jacobians(&node.pose, &moved);
        let slope = turned + Vector3::new(-turned.y, turned.x, 0.0) * (0.5 * tau * v.z);
        (compose(&node.pose, &moved), Some((first, second * slope)))
    }

    /// Half the sum of the squared, whitened residuals.
    pub(super) fn cost(&self) -> f64 {
        self.fit().cost
    }

    /// How well it fits.
    pub(super) fn fit(&self) -> Fit {
        let away = self.dense() - &self.prior_mean;
        let cost = 0.5 * away.dot(&(&self.prior_information * &away)) + self.cost_of_spreads();
        let mut fit = Fit { cost, ..Fit::default() };
        for pair in self.nodes.windows(2) {
            let [before, node] = pair else { continue };
            let r = between(&before.pose, &node.pose) - node.leg.motion;
            fit.cost += self.slip.cost(r.dot(&(node.information * r)));
        }
        for residual in self.residuals() {
            fit.note(residual, self.loss);
        }
        fit
    }

    /// Whether the motion to a node is farther from what the wheels tell than they explain without slipping.
    pub(super) fn slipped(&self, to: usize) -> bool {
        let (before, node) = (&self.nodes[to - 1], &self.nodes[to]);
        let r = between(&before.pose, &node.pose) - node.leg.motion;
        self.slip.weight(r.dot(&(node.information * r))) < 1.0
    }

    /// The whitened residuals of all bearings, in the order of nodes and sights.
    pub(super) fn residuals(&self) -> Vec<f64> {
        let (rays, mut all) = (self.rays(), Vec::new());
        for node in &self.nodes {
            let view = Viewpoint::new(&self.pose_of_sights(node).0, &self.mounting);
            let residual = |sight: &Sight| view.past(&rays[sight.landmark], &sight.along);
            all.extend(node.sights.iter().map(|s| residual(s) / (self.bearing_sigma * self.spreads[s.landmark])));
        }
        all
    }

    /// Describes every landmark from where the camera is now thought to have been when it first saw it: seen from elsewhere
    /// a landmark may have to pass through its anchor to get where it belongs. Landmarks of which the prior knows the
    /// direction stay as they are.
    pub(super) fn reanchor(&mut self) {
        let fixed = self.free.width();
        let known = |slot| self.prior_information[(fixed + 2 * slot, fixed + 2 * slot)] > 0.0;
        let mut done: Vec<bool> = (0..self.landmarks.len()).map(known).collect();
        for node in &self.nodes {
            for sight in node.sights.iter().filter(|sight| !std::mem::replace(&mut done[sight.landmark], true)) {
                let old = self.landmarks[sight.landmark];
                let anchor = camera(&node.pose, &self.mounting);
                let (sin, cos) = old.direction.sin_cos();
                let away = old.anchor + Vector2::new(cos, sin) * (-old.closeness).exp() - anchor;
                if away.norm() > 1e-6 {
                    let turn = wrap_angle(away.y.atan2(away.x) - old.direction);
                    let direction = old.direction + turn;
                    self.landmarks[sight.landmark] = Landmark { anchor, direction, closeness: -away.norm().ln() };
                }
            }
        }
    }

    /// Puts every landmark from `first` on that has a whitened residual of `limit` or more at the distance that its bearings
    /// agree with best, in the direction of the first of them.
    pub(super) fn place_landmarks(&mut self, first: usize, limit: f64) {
        let mut seen: Vec<Vec<(Vector3<f64>, f64)>> = vec![Vec::new(); self.landmarks.len()];
        for node in &self.nodes {
            for sight in &node.sights {
                seen[sight.landmark].push((node.pose, sight.bearing));
            }
        }
        for (i, seen) in seen.iter().enumerate().skip(first) {
            let off = |landmark: &Landmark| {
                let one = |(pose, bearing): &(Vector3<f64>, f64)| {
                    wrap_angle(predict(pose, &self.mounting, landmark).bearing - bearing).abs() / self.bearing_sigma
                };
                seen.iter().map(one).fold((0.0, 0.0f64), |(sum, far), r| (sum + r, far.max(r)))
            };
            let now = self.landmarks[i];
            let Some((pose, bearing)) = seen.first().filter(|_| off(&now).1 >= limit) else { continue };
            let prior = self.prior_mean[self.free.width() + 2 * i + 1];
            let best = (-8..=8)
                .filter_map(|k| seen_at(now.anchor, prior + 0.4 * f64::from(k), pose, &self.mounting, *bearing))
                .min_by(|a, b| off(a).0.total_cmp(&off(b).0));
            if let Some(mut best) = best {
                // The same direction, in the turn of the circle in which it was.
                best.direction = now.direction + wrap_angle(best.direction - now.direction);
                self.landmarks[i] = best;
            }
        }
    }
}

/// The leg of readings in a row.
pub(super) fn legs(readings: &[WheelMotion], wheels: &Wheels, noise: &MotionNoise) -> Leg {
    readings.iter().fold(Leg::none(), |leg, reading| leg.then(&Leg::from_wheels(reading, wheels, noise)))
}
