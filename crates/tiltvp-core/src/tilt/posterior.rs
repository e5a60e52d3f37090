//! The lean as a probability given the shift, `P(alpha | l) = P(l | alpha) P(alpha) / P(l)`: learned, and kept as a table.

use std::sync::Arc;

use super::corrected::Corrected;
use super::shift_model::ShiftModel;
use super::training_set::check_training;
use crate::error::{Error, Result};
use crate::interrupt::check;

/// How leans are distributed where the robot goes, `P(alpha)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PriorOfTilt {
    /// As in the training set, smoothed.
    Empirical,
    /// Every lean up to the largest is as likely.
    Uniform {
        /// The largest lean in radians.
        max_rad: f64,
    },
    /// Leans forward and sideways are independent and normal, so that `alpha` has a Rayleigh distribution.
    Rayleigh {
        /// Their standard deviation in radians.
        sigma_rad: f64,
    },
}

impl PriorOfTilt {
    /// Checks the angle.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] unless it is positive and no lean beyond pi/2 matters.
    pub fn validate(&self) -> Result<()> {
        let right = std::f64::consts::FRAC_PI_2;
        match *self {
            Self::Uniform { max_rad } if !(max_rad > 0.0 && max_rad < right) => {
                Err(Error::option("max_rad", max_rad, "an angle strictly between 0 and pi/2"))
            }
            Self::Rayleigh { sigma_rad } if !(sigma_rad > 0.0 && sigma_rad <= right / REACH) => {
                Err(Error::option("sigma_rad", sigma_rad, "an angle above 0 and at most pi/10"))
            }
            _ => Ok(()),
        }
    }

    /// The largest lean that is tabulated, and the density up to a factor.
    fn density(self, alpha_rad: &[f64]) -> (f64, Box<dyn Fn(f64) -> f64>) {
        match self {
            Self::Uniform { max_rad } => (max_rad, Box::new(|_| 1.0)),
            Self::Rayleigh { sigma_rad } => {
                (REACH * sigma_rad, Box::new(move |alpha| alpha * (-0.5 * (alpha / sigma_rad).powi(2)).exp()))
            }
            Self::Empirical => {
                let width = bandwidth(alpha_rad);
                let largest = alpha_rad.iter().copied().fold(0.0, f64::max) + 3.0 * width;
                let mut sorted = alpha_rad.to_vec();
                sorted.sort_by(f64::total_cmp);
                let leans: Vec<(f64, f64)> = sorted.chunk_by(|a, b| a == b).map(|a| (a[0], a.len() as f64)).collect();
                // Reflected at zero: no lean is less than none.
                let kernel = move |d: f64| (-0.5 * (d / width).powi(2)).exp();
                let sum =
                    move |alpha: f64| leans.iter().map(|(a, n)| n * (kernel(alpha - a) + kernel(alpha + a))).sum();
                (largest.min(std::f64::consts::FRAC_PI_2), Box::new(sum))
            }
        }
    }
}

/// Standard deviations of a Rayleigh distribution that are taken into account: all but `exp(-12.5)`, four in a million.
const REACH: f64 = 5.0;

/// Least standard deviation in radians of the kernel that smooths a training set's leans, a tenth of a degree: leans of a
/// training set may all be alike, and are not known better.
const BANDWIDTH_MIN_RAD: f64 = 0.002;

/// Silverman's rule of thumb.
fn bandwidth(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let deviation = (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    (0.9 * deviation * n.powf(-0.2)).max(BANDWIDTH_MIN_RAD)
}

/// The mean and the standard deviation of `P(alpha | l)` over a grid of shifts from zero in equal steps; applying it is one
/// interpolation, and shifts beyond the grid have the answer of its end.
#[derive(Debug, Clone, PartialEq)]
pub struct PosteriorCorrection {
    model: ShiftModel,
    step: f64,
    mean_rad: Arc<[f64]>,
    std_rad: Arc<[f64]>,
}

impl PosteriorCorrection {
    /// A table by its numbers.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] for a model or step that is not positive, columns of different
    /// lengths or fewer than two rows, means that fall or are no angles in `[0, pi/2)`, and deviations below zero.
    pub fn new(model: ShiftModel, step: f64, mean_rad: &[f64], std_rad: &[f64]) -> Result<Self> {
        model.validate()?;
        if !(step > 0.0 && step.is_finite()) {
            return Err(Error::option("step", step, "a positive distance between shifts"));
        }
        if mean_rad.len() < 2 || mean_rad.len() != std_rad.len() {
            let got = format!("{} values for {} means", std_rad.len(), mean_rad.len());
            return Err(Error::argument("std_rad", got, "as many as mean_rad has, at least 2"));
        }
        let right = std::f64::consts::FRAC_PI_2;
        if !(mean_rad.is_sorted() && mean_rad.iter().all(|mean| (0.0..right).contains(mean))) {
            return Err(Error::argument("mean_rad", "other numbers", "angles in [0, pi/2) that never fall"));
        }
        if !std_rad.iter().all(|std| (0.0..f64::INFINITY).contains(std)) {
            return Err(Error::argument("std_rad", "other numbers", "finite angles of zero or more"));
        }
        Ok(Self { model, step, mean_rad: mean_rad.into(), std_rad: std_rad.into() })
    }

    /// What was learned of the shifts.
    pub fn model(&self) -> &ShiftModel {
        &self.model
    }

    /// Distance between the shifts of the table, in units of the shift.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Mean lean in radians at each shift of the table.
    pub fn mean_rad(&self) -> &[f64] {
        &self.mean_rad
    }

    /// Standard deviation of the lean in radians at each shift of the table.
    pub fn std_rad(&self) -> &[f64] {
        &self.std_rad
    }

    pub(super) fn at(&self, shift: f64) -> Corrected {
        if shift.is_nan() {
            return Corrected { shift, alpha_rad: shift, slope: shift, std_rad: shift };
        }
        let place = shift / self.step;
        let last = self.mean_rad.len() - 1;
        let left = (place as usize).min(last - 1);
        let part = (place - left as f64).clamp(0.0, 1.0);
        let between = |values: &[f64]| values[left] + part * (values[left + 1] - values[left]);
        let rise = if place > last as f64 { 0.0 } else { self.mean_rad[left + 1] - self.mean_rad[left] };
        Corrected {
            shift,
            alpha_rad: between(&self.mean_rad),
            slope: rise / self.step,
            std_rad: between(&self.std_rad),
        }
    }
}

/// Least number of images from which a posterior is learned: two for each of the five numbers of a [`ShiftModel`].
const IMAGES_MIN: usize = 10;

/// Learns a [`ShiftModel`] by maximum likelihood from images of known leans, and tabulates the posterior under a prior.
///
/// The mean is kept from falling where a shift is so far out that it is more likely a stray; the standard deviation is then
/// that about the mean that is given.
///
/// # Errors
/// [`Error::InvalidArgument`] for fewer than ten images, numbers that are not finite, leans that are all alike or shifts that
/// do not grow with them; [`Error::InvalidOption`] for an impossible prior.
pub fn train_posterior(shift: &[f64], alpha_rad: &[f64], prior: PriorOfTilt) -> Result<PosteriorCorrection> {
    prior.validate()?;
    check_training(shift, alpha_rad, IMAGES_MIN)?;
    let model = ShiftModel::fit(shift, alpha_rad)?;
    let (alpha_max, prior_density) = prior.density(alpha_rad);
    let width = model.spread_at(0.0);

    let count = (4.0 * alpha_max * model.factor / width).clamp(96.0, 600.0) as usize;
    let alphas: Vec<f64> = (0..count).map(|i| (i as f64 + 0.5) / count as f64 * alpha_max).collect();
    let weigh = |alpha: &f64| {
        check();
        prior_density(*alpha)
    };
    let weights: Vec<f64> = alphas.iter().map(weigh).collect();

    let largest = shift.iter().copied().fold(0.0, f64::max);
    let end = largest.max(model.factor * alpha_max + 6.0 * model.spread_at(alpha_max));
    let steps = (4.0 * end / width).clamp(64.0, 600.0).ceil();
    let step = end / steps;

    let (mut means, mut deviations) = (Vec::new(), Vec::new());
    let mut highest = 0.0f64;
    for k in 0..=steps as usize {
        let [mut total, mut first, mut second] = [0.0; 3];
        for (alpha, weight) in alphas.iter().zip(&weights) {
            let density = weight * model.plane_density(k as f64 * step, *alpha);
            (total, first, second) = (total + density, first + density * alpha, second + density * alpha * alpha);
        }
        let mean = first / total;
        highest = highest.max(mean);
        let variance = (second / total - mean * mean).max(0.0) + (highest - mean).powi(2);
        means.push(highest);
        deviations.push(variance.sqrt());
    }
    PosteriorCorrection::new(model, step, &means, &deviations)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_beyond_the_table_has_the_answer_of_its_end() {
        let model =
            ShiftModel { factor: 100.0, spread: 3.0, spread_per_rad: 25.0, stray_share: 0.04, stray_max: 100.0 };
        let table = PosteriorCorrection::new(model, 2.0, &[0.01, 0.02, 0.05], &[0.005, 0.006, 0.008]).unwrap();
        for (shift, alpha_rad, slope, std_rad) in [
            (0.0, 0.01, 0.005, 0.005),
            (1.0, 0.015, 0.005, 0.0055),
            (2.0, 0.02, 0.015, 0.006),
            (4.0, 0.05, 0.015, 0.008),
            (4.1, 0.05, 0.0, 0.008),
            (90.0, 0.05, 0.0, 0.008),
        ] {
            let found = table.at(shift);
            let off = [found.alpha_rad - alpha_rad, found.slope - slope, found.std_rad - std_rad];
            assert!(off.iter().all(|off| off.abs() < 1e-12), "{shift}: {found:?}");
        }
    }
}
