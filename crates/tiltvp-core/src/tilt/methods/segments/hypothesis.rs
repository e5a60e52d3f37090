//! What may be up in a view that may look anywhere.

use nalgebra::{Matrix3, Vector3};

use super::frame::Frame;
use crate::tilt::lightness::BANDS;

/// How many numbers of edges, and of edges and lightness, tell whether a hypothesis is the right one.
pub(super) const OF_EDGES: usize = 19;
pub(super) const FEATURES: usize = OF_EDGES + 2 * BANDS;

/// A frame of which the vertical may be up.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    /// Unit direction that would be up, towards what was expected.
    pub up: Vector3<f64>,
    pub frame: Frame,
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
