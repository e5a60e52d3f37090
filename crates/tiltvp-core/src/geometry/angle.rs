//! Angles on the circle.

use std::f64::consts::{PI, TAU};

/// The same angle in (-pi, pi].
pub fn wrap_angle(angle_rad: f64) -> f64 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    let wrapped = angle_rad - TAU * (angle_rad / TAU).round();
    if wrapped <= -PI { wrapped + TAU } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn whole_turns_are_removed(angle in -3.1..3.1f64, turns in -5..5i32) {
            prop_assert!((wrap_angle(angle + TAU * f64::from(turns)) - angle).abs() < 1e-12);
        }
    }

    #[test]
    fn pi_is_in_the_interval() {
        assert_eq!(wrap_angle(PI), PI);
        assert_eq!(wrap_angle(-PI), PI);
        assert!(wrap_angle(f64::NAN).is_nan());
    }
}
