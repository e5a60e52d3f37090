//! How shifts answer to leans, `P(l | alpha)`: the length of a noisy vector, with strays.

use super::simplex::minimise;
use crate::error::{Error, Result};
use crate::interrupt::check;

/// The shift `l` as the length of a plane vector with mean length `factor alpha` and, in each direction, a normal error of
/// standard deviation `sqrt(spread^2 + (spread_per_rad alpha)^2)`: a Rice distribution, which is not zero on average where the
/// lean is zero. A share of the vectors strays, uniformly over a disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShiftModel {
    /// `a`: units of the shift per radian.
    pub factor: f64,
    /// Standard deviation of the error of the upright robot's shift, in units of the shift.
    pub spread: f64,
    /// How it grows with the lean, in units of the shift per radian.
    pub spread_per_rad: f64,
    /// Share of strays.
    pub stray_share: f64,
    /// Radius of the disc of strays, in units of the shift.
    pub stray_max: f64,
}

/// Radius of the disc of strays over the largest shift of the training set: the largest of a few hundred shifts is at least half
/// of any that is to come.
const STRAY_REACH: f64 = 2.0;

/// Least and largest share of strays: below one in a thousand a training set of a few hundred images cannot tell, and above a
/// half the strays would be the rule.
const STRAY_SHARES: [f64; 2] = [1e-3, 0.5];

/// Least spread over the shift of a lean of one radian: 0.006 degrees, far below the noise of any image. Without it the likelihood
/// of a training set without noise has no maximum.
const SPREAD_MIN: f64 = 1e-4;

impl ShiftModel {
    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the number.
    pub fn validate(&self) -> Result<()> {
        let [least, most] = [0.0, f64::INFINITY];
        for (name, value, least) in [
            ("factor", self.factor, f64::MIN_POSITIVE),
            ("spread", self.spread, f64::MIN_POSITIVE),
            ("spread_per_rad", self.spread_per_rad, least),
            ("stray_max", self.stray_max, f64::MIN_POSITIVE),
        ] {
            if !(value >= least && value < most) {
                return Err(Error::option(name, value, "a finite positive number (spread_per_rad: or zero)"));
            }
        }
        if (0.0..1.0).contains(&self.stray_share) {
            return Ok(());
        }
        Err(Error::option("stray_share", self.stray_share, "a share of at least 0 and below 1"))
    }

    /// Standard deviation of a shift's error in each direction at a lean.
    pub fn spread_at(&self, alpha_rad: f64) -> f64 {
        self.spread.hypot(self.spread_per_rad * alpha_rad)
    }

    /// `P(l | alpha)` in reciprocal units of the shift.
    pub fn density(&self, shift: f64, alpha_rad: f64) -> f64 {
        shift * self.plane_density(shift, alpha_rad)
    }

    /// `P(l | alpha) / l`: the density over the plane of shifts times `2 pi`, averaged over directions.
    pub(super) fn plane_density(&self, shift: f64, alpha_rad: f64) -> f64 {
        let (mean, spread) = (self.factor * alpha_rad, self.spread_at(alpha_rad));
        let (away, squared) = ((shift - mean) / spread, spread * spread);
        let rice = (-0.5 * away * away).exp() * scaled_bessel_i0(shift * mean / squared) / squared;
        let stray = 2.0 / (self.stray_max * self.stray_max);
        (1.0 - self.stray_share) * rice + self.stray_share * stray
    }

    /// The model under which a checked training set is likeliest.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for leans that are all zero or shifts that do not grow with them.
    pub(super) fn fit(shift: &[f64], alpha_rad: &[f64]) -> Result<Self> {
        let largest = shift.iter().copied().fold(0.0, f64::max);
        // Where half of the ratios are, those of larger leans counting more.
        let mut ratios: Vec<(f64, f64)> =
            shift.iter().zip(alpha_rad).filter(|(_, a)| **a > 1e-6).map(|(l, a)| (l / a, *a)).collect();
        ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = 0.5 * ratios.iter().map(|(_, weight)| weight).sum::<f64>();
        let mut sum = 0.0;
        let middle = ratios.iter().find(|(_, weight)| {
            sum += weight;
            sum >= half
        });
        let Some((factor, _)) = middle.copied().filter(|(ratio, _)| *ratio > 0.0) else {
            return Err(Error::argument("alpha_rad, shift", "no shifts of leans", "shifts that grow with the lean"));
        };
        let mut errors: Vec<f64> = shift.iter().zip(alpha_rad).map(|(l, a)| (l - factor * a).abs()).collect();
        errors.sort_by(f64::total_cmp);
        let spread = (1.5 * errors[errors.len() / 2]).max(1e-3 * factor);
        let model = |x: &[f64; 4]| {
            let [low, high] = STRAY_SHARES;
            let factor = factor * x[0].exp();
            Self {
                factor,
                spread: (spread * x[1].exp()).max(SPREAD_MIN * factor),
                spread_per_rad: factor * (x[2] - 3.0).exp(),
                stray_share: low + (high - low) / (1.0 + (3.0 - x[3]).exp()),
                stray_max: STRAY_REACH * largest,
            }
        };
        let cost = |x: &[f64; 4]| -> f64 {
            check();
            let model = model(x);
            // A weak prior bounds the parameters that the images do not determine.
            let drift = 1e-3 * x.iter().map(|x| x * x).sum::<f64>();
            drift - shift.iter().zip(alpha_rad).map(|(l, alpha)| model.plane_density(*l, *alpha).ln()).sum::<f64>()
        };
        let first = minimise([0.0; 4], 0.5, 1e-4, 250, cost);
        let found = model(&minimise(first, 0.2, 1e-4, 250, cost));
        found.validate().map_err(|error| Error::argument("shift", error, "shifts that grow with the lean"))?;
        Ok(found)
    }
}

/// `exp(-x) I0(x)` for `x >= 0` (Abramowitz and Stegun 9.8.1 and 9.8.2), to 2e-7.
fn scaled_bessel_i0(x: f64) -> f64 {
    let horner = |coefficients: &[f64], t: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if x < 3.75 {
        let t = (x / 3.75).powi(2);
        (-x).exp() * horner(&[1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3], t)
    } else {
        const FAR: [f64; 9] = [
            0.398_942_28,
            0.013_285_92,
            0.002_253_19,
            -0.001_575_65,
            0.009_162_81,
            -0.020_577_06,
            0.026_355_37,
            -0.016_476_33,
            0.003_923_77,
        ];
        horner(&FAR, 3.75 / x) / x.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bessel_function_is_that_of_its_series() {
        for x in [0.0, 0.3, 1.0, 3.0, 3.74, 3.76, 8.0, 20.0] {
            let mut term = 1.0;
            let series: f64 = 1.0
                + (1..200)
                    .map(|k| {
                        term *= (0.5 * x / f64::from(k)).powi(2);
                        term
                    })
                    .sum::<f64>();
            assert!((scaled_bessel_i0(x) / (series * (-x).exp()) - 1.0).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn densities_integrate_to_one() {
        let model = ShiftModel { factor: 200.0, spread: 3.0, spread_per_rad: 20.0, stray_share: 0.1, stray_max: 90.0 };
        for alpha in [0.0, 0.01, 0.1, 0.2] {
            let sum: f64 = (0..90_000).map(|i| model.density((f64::from(i) + 0.5) * 1e-3, alpha) * 1e-3).sum();
            assert!((sum - 1.0).abs() < 1e-4, "{alpha}: {sum}");
        }
    }
}
