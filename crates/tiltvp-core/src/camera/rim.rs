//! Where a lens ends: the angle from its axis beyond which two rays would meet in one point, or none.

/// The least slope, as a part of the slope on the axis, at which neighbouring rays still count as apart.
///
/// Where the slope of `r(theta)` (or of `theta(r)`) falls to zero the image folds over. Just inside, a ray and its pixel
/// no longer determine each other to the accuracy of `f64`; this keeps the loss below three of its sixteen digits.
pub(super) const FOLD: f64 = 1e-3;

/// The largest distance from the axis in the image plane, in units of the focal length, where planes are unbounded: a
/// millionth of a radian short of 90 degrees.
pub(super) const FARTHEST: f64 = 1e6;

/// No lens sees less than this angle from its axis, radians: a narrower one is a slip, a millionth of a radian being a pixel of a
/// telescope.
pub(super) const NARROWEST_RAD: f64 = 1e-6;

/// The rim of a lens that is round about its axis: an angle from the axis, and the radius at which it is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rim {
    /// Angle from the axis in radians.
    pub(super) theta: f64,
    /// Distance from the centre in the image plane of the lens.
    pub(super) radius: f64,
    sin: f64,
    cos: f64,
}

impl Rim {
    pub(super) fn new(theta: f64, radius: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        Self { theta, radius, sin, cos }
    }

    /// The largest angle up to `end` at which a profile `theta -> (r, dr/dtheta)` still grows by [`FOLD`] of its growth on
    /// the axis, and the radius is at most [`FARTHEST`].
    pub(super) fn find(end: f64, profile: impl Fn(f64) -> (f64, f64)) -> Self {
        let least = FOLD * profile(0.0).1;
        let inside = |theta: f64| {
            let (r, slope) = profile(theta);
            // Where the plane is infinite rounding may leave `r` on the far side of it, below zero.
            (0.0..=FARTHEST).contains(&r) && slope >= least && slope.is_finite()
        };
        let (mut low, mut high) = (0.0, end);
        if inside(end) {
            low = end;
        }
        while low < high {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high || middle < 1e-300 {
                break;
            }
            if inside(middle) { low = middle } else { high = middle }
        }
        Self::new(low, profile(low).0)
    }

    /// Whether a direction at distance `rho` from the axis and height `z` along it is within the rim.
    ///
    /// `sin(theta - rim) <= 0` without an arc tangent, as sharp near 0 and pi as elsewhere.
    #[inline]
    pub(super) fn admits(&self, rho: f64, z: f64) -> bool {
        rho * self.cos <= z * self.sin
    }
}
