//! What may be up in a view that may look anywhere: a frame of three directions, and the edges that agree with it.

use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};

use crate::geometry::tangent_basis;
use crate::tilt::lightness::BANDS;

/// Scatter of the edges of vertical and of horizontal things about their vanishing points, radians: beams sag, frames do not.
pub(super) const VERTICAL_RAD: f64 = 0.3f64.to_radians();
pub(super) const HORIZONTAL_RAD: f64 = 0.4f64.to_radians();

/// The scatter in radians at which a segment that passes through a direction is as likely to be of it as of any other.
pub(super) const EVEN_RAD: f64 = 0.03;

/// The length in radians of a segment that counts as one observation; others by the square root of their length.
const LENGTH_RAD: f64 = 0.2;

/// Standard deviation in radians by which horizontal edges of one building miss the right angle.
pub(super) const SKEW_RAD: f64 = 1f64.to_radians();

/// How many numbers of edges, and of edges and lightness, tell whether a hypothesis is the right one.
pub(super) const OF_EDGES: usize = 19;
pub(super) const FEATURES: usize = OF_EDGES + 2 * BANDS;

/// A segment in the robot frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub normal: Vector3<f64>,
    pub middle: Vector3<f64>,
    pub along: Vector3<f64>,
    pub offset: f64,
    pub slope: f64,
    pub length_rad: f64,
    weight: f64,
}

/// Odds that an edge is of a direction, and the variance of the angle by which its circle would miss it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Odds {
    pub odds: f64,
    pub variance: f64,
}

impl Edge {
    pub(super) fn new(
        robot_from_camera: &Matrix3<f64>,
        normal: &Vector3<f64>,
        middle: &Vector3<f64>,
        [offset, slope]: [f64; 2],
        length_rad: f64,
    ) -> Self {
        let (normal, middle) = (robot_from_camera * normal, robot_from_camera * middle);
        let weight = (length_rad / LENGTH_RAD).sqrt();
        Self { normal, middle, along: normal.cross(&middle), offset, slope, length_rad, weight }
    }

    pub(super) fn weight(&self) -> f64 {
        self.weight
    }

    pub(super) fn odds(&self, direction: &Vector3<f64>, scatter_rad: f64) -> Odds {
        let (distance, across) = (self.normal.dot(direction), self.middle.dot(direction));
        let turn = self.along.dot(direction);
        let variance = self.offset * across * across + self.slope * turn * turn + scatter_rad * scatter_rad;
        let chance = (1.0 - across * across).max(1e-3) / variance;
        Odds { odds: EVEN_RAD * chance.sqrt() * (-0.5 * distance * distance / variance).exp(), variance }
    }
}

/// Three orthogonal directions (the horizontals nearly so) that edges agree with.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    /// Unit direction that would be up, towards what was expected.
    pub up: Vector3<f64>,
    /// Logarithm of the likelihood, up to a constant.
    pub log_likelihood: f64,
    /// The horizontals and `up` or its opposite.
    pub axes: [Vector3<f64>; 3],
    /// Information on the turn of the axes (three numbers, robot frame) and on the angle between the horizontals.
    pub information: Matrix4<f64>,
    /// What tells whether it is the right one.
    pub features: [f64; FEATURES],
    /// Probability of being the right one among all.
    pub probability: f64,
}

/// Where the answer lies.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    /// Largest angle of the vertical from the robot's z, radians.
    pub reach_rad: f64,
    pub robot_from_camera: Matrix3<f64>,
}

impl Hypothesis {
    /// Covariance of `up` in its tangent plane, in squared radians: what the edges tell, with no regard to which axis is up.
    pub(super) fn covariance(&self) -> Option<nalgebra::Matrix2<f64>> {
        let stiffness = Matrix4::from_diagonal(&Vector4::new(0.0, 0.0, 0.0, 1.0 / (SKEW_RAD * SKEW_RAD)));
        // What no edge tells is left to a turn of one radian.
        let inverse = (self.information + stiffness + Matrix4::identity()).try_inverse()?;
        let turns: Matrix3<f64> = inverse.fixed_view::<3, 3>(0, 0).into();
        let moves: SMatrix<f64, 2, 3> = -tangent_basis(&self.up).transpose() * self.up.cross_matrix();
        let covariance = moves * turns * moves.transpose();
        Some(0.5 * (covariance + covariance.transpose()))
    }

    /// Probabilities that an edge is of the two horizontals and of the vertical.
    pub(super) fn shares(&self, edge: &Edge) -> [f64; 3] {
        let scatters = [HORIZONTAL_RAD, HORIZONTAL_RAD, VERTICAL_RAD];
        let odds = [0, 1, 2].map(|d| edge.odds(&self.axes[d], scatters[d]).odds);
        let sum = 1.0 + odds.iter().sum::<f64>();
        odds.map(|odds| odds / sum)
    }
}
