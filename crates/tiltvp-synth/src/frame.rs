//! Upright frames, in which walls and pieces of furniture are laid out.

use nalgebra::{Vector2, Vector3};

/// An upright frame of the world: `x` and `y` horizontal, `z` up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) origin: Vector3<f64>,
    pub(crate) x: Vector2<f64>,
}

impl Frame {
    /// At a point of the floor, with `x` turned by `yaw` radians.
    pub(crate) fn new(x: f64, y: f64, yaw: f64) -> Self {
        Self { origin: Vector3::new(x, y, 0.0), x: Vector2::new(yaw.cos(), yaw.sin()) }
    }

    /// A frame given in this one: moved by `(x, y, z)` and turned by `yaw` radians.
    pub(crate) fn then(&self, x: f64, y: f64, z: f64, yaw: f64) -> Self {
        let (s, c) = yaw.sin_cos();
        Self { origin: self.point(x, y, z), x: Vector2::new(c * self.x.x - s * self.x.y, s * self.x.x + c * self.x.y) }
    }

    /// A point of this frame in the world.
    pub(crate) fn point(&self, x: f64, y: f64, z: f64) -> Vector3<f64> {
        self.origin + self.vector(x, y, z)
    }

    /// A vector of this frame in the world.
    pub(crate) fn vector(&self, x: f64, y: f64, z: f64) -> Vector3<f64> {
        Vector3::new(self.x.x * x - self.x.y * y, self.x.y * x + self.x.x * y, z)
    }
}
