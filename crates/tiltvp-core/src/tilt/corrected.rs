//! What a correction makes of a shift: an angle, its slope and how far it scatters.

use nalgebra::{Matrix2, Vector2};

/// A corrected angle, and how it depends on what was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Corrected {
    pub shift: f64,
    pub alpha_rad: f64,
    /// `d alpha / d l`, that of the unclamped line where it is clamped.
    pub slope: f64,
    /// Standard deviation of the angle that the training set tells, 0 where it tells none.
    pub std_rad: f64,
}

impl Corrected {
    /// The derivative of `alpha u` by the shift vector `l u`, for a unit vector `u` that errs sideways with a variance in
    /// squared units of the shift: the farther the shift is from zero, the better its direction is known.
    pub(super) fn jacobian(&self, toward: &Vector2<f64>, sideways_variance: f64) -> Matrix2<f64> {
        let across = Vector2::new(-toward.y, toward.x);
        let spread = (self.shift * self.shift + sideways_variance.max(0.0)).sqrt();
        let sideways = if spread > 0.0 { (self.alpha_rad / spread).max(self.slope) } else { self.slope };
        toward * toward.transpose() * self.slope + across * across.transpose() * sideways
    }
}
