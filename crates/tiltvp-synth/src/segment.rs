//! A vertical edge of the world, the truth that every picture of it carries.

use nalgebra::Vector3;

/// A vertical edge of the world, metres, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Lower end.
    pub bottom: Vector3<f64>,
    /// Upper end.
    pub top: Vector3<f64>,
}
