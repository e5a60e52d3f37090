//! The tilt of a robot whose wheels stand at different heights (Fleer 2017, section 2.3).

use nalgebra::Vector3;

use super::tilt::Tilt;
use crate::error::{Error, Result};

/// Where the three wheels of a robot touch the ground, in its own frame (Fleer 2017, fig. 20): the left and the right wheel
/// at `(0, +-half_track_m)`, the caster at `(-caster_behind_m, 0)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelLayout {
    /// Half the distance of the main wheels from each other, the paper's `r_w`, metres.
    pub half_track_m: f64,
    /// How far the caster is behind the axle of the main wheels, the paper's `r_c`, metres.
    pub caster_behind_m: f64,
}

impl WheelLayout {
    /// The tilt of the robot when its wheels stand `left_m`, `right_m` and `caster_m` above a common level, metres.
    ///
    /// With `h_r = right - left` and `h_c = caster - left` (Fleer 2017, eqs. 42 and 43),
    ///
    /// ```text
    /// sin alpha = 1/2 sqrt(((2 h_c - h_r) / r_c)^2 + (h_r / r_w)^2)
    /// beta      = atan2(h_r / (2 r_w sin alpha), (2 h_c - h_r) / (2 r_c sin alpha))
    /// ```
    ///
    /// so that the ground normal is `(-(2 h_c - h_r) / (2 r_c), -h_r / (2 r_w), cos alpha)`. A raised caster tilts the robot
    /// forward, a raised right wheel to the left and back.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a layout that is not of positive, finite lengths, [`Error::InvalidArgument`] for heights
    /// that are not finite, or that no robot of this layout can stand at (`sin alpha > 1`).
    pub fn tilt(&self, left_m: f64, right_m: f64, caster_m: f64) -> Result<Tilt> {
        for (name, value) in
            [("wheels.half_track_m", self.half_track_m), ("wheels.caster_behind_m", self.caster_behind_m)]
        {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::option(name, value, "a positive number of metres"));
            }
        }
        let heights = || format!("{left_m}, {right_m}, {caster_m}");
        if ![left_m, right_m, caster_m].iter().all(|height| height.is_finite()) {
            return Err(Error::argument("left_m, right_m, caster_m", heights(), "finite heights in metres"));
        }
        let (h_r, h_c) = (right_m - left_m, caster_m - left_m);
        let forward = (2.0 * h_c - h_r) / (2.0 * self.caster_behind_m);
        let leftward = h_r / (2.0 * self.half_track_m);
        let cos2 = 1.0 - forward * forward - leftward * leftward;
        // Differences of finite heights may be none of a float.
        if cos2.is_nan() || cos2 < 0.0 {
            let expected = format!(
                "heights that wheels {} m apart and a caster {} m behind them can have",
                2.0 * self.half_track_m,
                self.caster_behind_m
            );
            return Err(Error::argument("left_m, right_m, caster_m", heights(), expected));
        }
        Ok(Tilt::from_normal(&Vector3::new(-forward, -leftward, cos2.sqrt())).unwrap_or(Tilt::UPRIGHT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Fleer (2017) prints no lengths. To a tenth of a millimetre these are the only ones that give every angle of table 1 as
    /// printed.
    const PAPER: WheelLayout = WheelLayout { half_track_m: 0.1545, caster_behind_m: 0.1394 };

    fn degrees(tilt: Tilt) -> (f64, f64) {
        (tilt.alpha_rad().to_degrees(), tilt.beta_rad().to_degrees())
    }

    #[test]
    fn table_1() {
        let rows = [(5.0, 1.38, 2.06), (10.1, 2.80, 4.15), (4.4, 1.22, 1.81), (7.4, 2.05, 3.04), (5.3, 1.47, 2.18)];
        let as_printed = |found: f64, printed: f64| (found - printed).abs() <= 0.005;
        for (height_mm, main_deg, caster_deg) in rows {
            let h = height_mm * 1e-3;
            let (alpha, beta) = degrees(PAPER.tilt(0.0, 0.0, h).expect("possible"));
            assert!(as_printed(alpha, caster_deg) && beta.abs() < 1e-9, "caster {height_mm}: {alpha}, {beta}");
            for (left, right, sign) in [(h, 0.0, -1.0), (0.0, h, 1.0)] {
                let (alpha, beta) = degrees(PAPER.tilt(left, right, 0.0).expect("possible"));
                assert!(as_printed(alpha, main_deg), "main {height_mm}: {alpha}");
                // 137.9 degrees, of which the paper prints the whole ones.
                assert_eq!((sign * beta).floor(), 137.0, "main {height_mm}: {beta}");
            }
        }
    }

    #[test]
    fn impossible_heights_and_layouts_are_refused() {
        assert!(PAPER.tilt(0.0, 0.0, 0.15).is_err());
        assert!(PAPER.tilt(0.0, f64::NAN, 0.0).is_err());
        assert!(PAPER.tilt(1e308, -1e308, 0.0).is_err());
        assert!(WheelLayout { half_track_m: 0.0, ..PAPER }.tilt(0.0, 0.0, 0.0).is_err());
        assert!(WheelLayout { caster_behind_m: f64::INFINITY, ..PAPER }.tilt(0.0, 0.0, 0.0).is_err());
    }

    proptest! {
        #[test]
        fn the_wheels_of_a_leaning_robot_give_its_tilt(alpha in 0.0..0.5f64, beta in -3.1..3.1f64, level in -0.1..0.1f64) {
            let tilt = Tilt::from_alpha_beta(alpha, beta);
            // Height of a contact point: its component along the vertical, as the robot sees it.
            let height = |x: f64, y: f64| level + tilt.normal().dot(&Vector3::new(x, y, 0.0));
            let (left, right) = (height(0.0, PAPER.half_track_m), height(0.0, -PAPER.half_track_m));
            let found = PAPER.tilt(left, right, height(-PAPER.caster_behind_m, 0.0)).expect("possible");
            prop_assert!(found.angle_to(&tilt) < 1e-9);
        }
    }
}
