//! Repeated least squares: the trimming loop of Fleer 2017 (eqs. 33 to 35), and a reweighting loop with a fading gate.

use super::loss::Gate;
use super::problem::{Problem, gated};
use super::report::{FitReport, Stop};
use crate::error::{Error, Result};

/// Options of [`reject_refit`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RejectRefitOptions {
    /// Share of normally distributed residuals that each round keeps, in (0, 1).
    pub keep_fraction: f64,
    /// Most rounds, `N_E` of Fleer 2017; 0 is plain least squares. Default 15.
    pub max_iterations: u32,
    /// Change of the model below which it has converged, in the problem's unit of distance.
    pub tolerance: f64,
    /// Root mean square residual below which nothing more is rejected. Default 0.
    pub rms_min: f64,
}

impl RejectRefitOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        if !(self.keep_fraction > 0.0 && self.keep_fraction < 1.0) {
            return Err(Error::option("keep_fraction", self.keep_fraction, "a share strictly between 0 and 1"));
        }
        if !(self.tolerance >= 0.0 && self.rms_min >= 0.0) {
            return Err(Error::option("tolerance", self.tolerance, "a number that is not negative"));
        }
        Ok(())
    }
}

/// Fits, rejects the observations with residuals above `Phi^-1((1 + keep) / 2)` standard deviations, and fits again.
///
/// Rejection is for good. The standard deviation is the root mean square of the residuals (their mean is taken as zero).
/// On return `weights` are zero for what was rejected.
pub fn reject_refit<P: Problem>(
    problem: &P,
    options: &RejectRefitOptions,
    near: &P::Model,
    weights: &mut [f32],
) -> FitReport<P::Model> {
    if problem.rows().len() < P::SAMPLE_SIZE {
        return FitReport::failed(Stop::TooFew { have: problem.rows().len(), need: P::SAMPLE_SIZE }, 0);
    }
    let quantile = normal_quantile(0.5 * (1.0 + options.keep_fraction));
    let mut moments = gated(problem, near, Gate::Open, weights);
    let Some(mut model) = problem.fit_weighted(&moments) else {
        return FitReport::failed(Stop::NoModel { trials: 1 }, 1);
    };
    let (mut iterations, mut change) = (1, f64::INFINITY);
    let stop = loop {
        let rms = moments.rms(problem.coefficients(&model));
        if rms <= options.rms_min {
            break Stop::Settled { rms, limit: options.rms_min };
        }
        if iterations > options.max_iterations {
            break Stop::IterationLimit { limit: options.max_iterations, change };
        }
        let coefficients = problem.coefficients(&model);
        let trimmed = problem.rows().trim(&moments, coefficients, quantile * rms, (&mut *weights, P::WEIGHTS));
        let Some(next) = problem.fit_weighted(&trimmed) else {
            return FitReport::failed(Stop::NoModel { trials: iterations }, iterations);
        };
        change = problem.distance(&model, &next);
        model = next;
        moments = trimmed;
        iterations += 1;
        if change < options.tolerance {
            break Stop::Converged { iterations, change, tolerance: options.tolerance };
        }
    };
    let rms = moments.rms(problem.coefficients(&model));
    FitReport { rms, model: Some(model), inliers: moments.count, iterations, stop }
}

/// Options of [`reweight`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReweightOptions {
    /// Scale of the soft gate at the start, in the problem's unit.
    pub first_scale: f64,
    /// Scale of the soft gate at the end.
    pub last_scale: f64,
    /// Rounds from the first scale to the last, evenly spaced.
    pub shrinking: u32,
    /// Most rounds at the last scale.
    pub max_iterations: u32,
    /// Change of the model below which it has converged, in the problem's unit of distance.
    pub tolerance: f64,
}

/// Iteratively reweighted least squares with a soft gate whose scale fades from the first to the last.
///
/// `inliers` of the report counts what lies within the gate's support; `rms` is weighted by it.
pub fn reweight<P: Problem>(
    problem: &P,
    options: &ReweightOptions,
    start: &P::Model,
    weights: &mut [f32],
) -> FitReport<P::Model> {
    let mut model = start.clone();
    let mut iterations = 0;
    loop {
        let progress = f64::from(iterations.min(options.shrinking)) / f64::from(options.shrinking.max(1));
        let scale = options.first_scale + (options.last_scale - options.first_scale) * progress;
        let moments = gated(problem, &model, Gate::Soft { scale }, weights);
        iterations += 1;
        if moments.count < P::SAMPLE_SIZE {
            return FitReport::failed(Stop::TooFew { have: moments.count, need: P::SAMPLE_SIZE }, iterations);
        }
        let Some(next) = problem.fit_weighted(&moments) else {
            return FitReport::failed(Stop::NoModel { trials: iterations }, iterations);
        };
        let change = problem.distance(&model, &next);
        model = next;
        let settled = iterations > options.shrinking && change < options.tolerance;
        let limit = options.shrinking + options.max_iterations;
        if settled || iterations >= limit {
            let stop = if settled {
                Stop::Converged { iterations, change, tolerance: options.tolerance }
            } else {
                Stop::IterationLimit { limit, change }
            };
            let (rms, inliers) = (moments.rms(problem.coefficients(&model)), moments.count);
            return FitReport { rms, model: Some(model), inliers, iterations, stop };
        }
    }
}

/// The quantile function of the standard normal distribution, for probabilities in (0, 1), to about 1e-12.
///
/// Newton's method on `Phi(x) = erfc(-x / sqrt 2) / 2`, with `Phi` from its continued fraction and series.
pub fn normal_quantile(probability: f64) -> f64 {
    let mut x = 0.0_f64;
    for _ in 0..60 {
        let density = (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let step = (normal_cdf(x) - probability) / density;
        // A bounded step cannot overshoot into the tails, where the density vanishes.
        x -= step.clamp(-0.5, 0.5);
        if step.abs() < 1e-14 {
            break;
        }
    }
    x
}

/// `Phi(x)` by Marsaglia's series `1/2 + phi(x) (x + x^3/3 + x^5/15 + ...)`, for the moderate `x` of quantiles.
fn normal_cdf(x: f64) -> f64 {
    let x = x.clamp(-8.0, 8.0);
    let (mut term, mut sum, mut n) = (x, x, 1.0);
    while sum + term != sum && n < 2000.0 {
        n += 2.0;
        term *= x * x / n;
        sum += term;
    }
    0.5 + sum * (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn quantiles_of_the_tables() {
        assert_abs_diff_eq!(normal_quantile(0.9), 1.281_551_565_544_6, epsilon = 1e-12);
        assert_abs_diff_eq!(normal_quantile(0.975), 1.959_963_984_540_05, epsilon = 1e-12);
        assert_abs_diff_eq!(normal_quantile(0.6), 0.253_347_103_135_8, epsilon = 1e-12);
        assert_abs_diff_eq!(normal_quantile(0.5), 0.0, epsilon = 1e-15);
        assert_abs_diff_eq!(normal_quantile(0.0001), -3.719_016_485_455_68, epsilon = 1e-9);
    }
}
