//! Angles: a fast arc tangent, differences, wrapping to one turn.

use std::f32::consts::PI as PI32;
use std::f64::consts::{PI, TAU};

/// `atan2` to 1e-5 rad, by a polynomial on the octant.
#[inline(always)]
pub(super) fn atan2(y: f32, x: f32) -> f32 {
    let (large, small) = if x.abs() >= y.abs() { (x.abs(), y.abs()) } else { (y.abs(), x.abs()) };
    let a = if large > 0.0 { small / large } else { 0.0 };
    let s = a * a;
    // Abramowitz and Stegun 4.4.49.
    let r = a * (0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1))));
    let r = if y.abs() > x.abs() { 0.5 * PI32 - r } else { r };
    let r = if x < 0.0 { PI32 - r } else { r };
    if y < 0.0 { -r } else { r }
}

/// The angle in `(-pi, pi]`.
pub(super) fn wrap(angle: f64) -> f64 {
    let turned = angle - TAU * (angle / TAU).round();
    if turned <= -PI { turned + TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomial_is_an_arc_tangent() {
        for i in 0..10_000 {
            let angle = (f64::from(i) / 5000.0 - 1.0) * std::f64::consts::PI;
            let (y, x) = ((3.0 * angle.sin()) as f32, (3.0 * angle.cos()) as f32);
            assert!((atan2(y, x) - y.atan2(x)).abs() < 2e-5);
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
    }
}
