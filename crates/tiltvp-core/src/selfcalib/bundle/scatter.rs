//! The scatter of each landmark's bearings: less than most for distant corners, more for round things, which are no points.

use super::keyframe::Observation;
use super::problem::BundleProblem;
use super::random_signs::RandomSigns;

/// Bearings from which on the scatter of a landmark is estimated. The logarithm of a scatter from twelve bearings has a standard
/// deviation of `sqrt(0.79 / 10) = 0.28`, about as much as landmarks of rendered halls differ.
const LEAST_BEARINGS: usize = 12;

/// The quantile of the residuals' sizes that the scatter is estimated from, high but free of a landmark's outliers, and the
/// value of that quantile for a standard normal distribution: `inverse Phi(0.9)`.
const QUANTILE: f64 = 0.8;
const NORMAL_QUANTILE: f64 = 1.2816;

/// The median of the sizes of standard normal numbers: `inverse Phi(0.75)`.
const NORMAL_MEDIAN: f64 = 0.6745;

/// Variance of the logarithm of that estimate times the number of bearings: `p (1 - p) / (q f(q))^2` with `p = 0.8`, the quantile
/// `q = 1.2816` and the density `f(q) = 2 phi(q) = 0.351`.
const LOG_VARIANCE: f64 = 0.79;

/// Median scatter beyond which the noise of the bearings is not the cause: a bumped mount or slipping wheels must not pass as
/// noise. The window counts as inconsistent beyond the same share of its innovations.
const MOST_MEDIAN: f64 = 1.5;

/// The smallest scatter. Errors that the bearings of a landmark share do not show in its residuals. Tuned on four rendered halls
/// (`just measure-calibration-images` runs others): phi and psi err by 0.19 and 0.22 degrees rms with scatters below one, and by
/// 0.31 and 0.32 where none counts below one.
const LEAST_SCATTER: f64 = 0.45;

/// Change of the logarithm of a scatter from which on it is worth solving again: below the standard deviation of an estimate
/// from twelve bearings, 0.28.
const LOG_CHANGE: f64 = 0.2;

/// Size of the perturbation, in standard deviations of a bearing, by which the redundancy is measured. The step is linear, so the
/// size only has to be far above rounding and below the threshold of the robust loss.
const PERTURBATION: f64 = 0.1;

/// The smallest redundancy: bounds the factor by which scatters grow at `sqrt(10)`.
const LEAST_REDUNDANCY: f64 = 0.1;

/// The smallest estimate of a scatter before shrinkage, so that its logarithm is finite for residuals of zero.
const LEAST_ESTIMATE: f64 = 1e-3;

impl BundleProblem {
    /// Estimates the scatter of each landmark's bearings from their residuals. Returns whether one changed.
    ///
    /// The logarithms of the scatters are taken to be normally distributed about their median. Their variance is what they show
    /// beyond chance. Each is shrunk towards the median, the more the fewer bearings the landmark has (empirical Bayes).
    pub(crate) fn estimate_scatters(&mut self) -> bool {
        let mut sizes = vec![Vec::new(); self.landmarks.len()];
        for (observation, residual) in self.observations().zip(self.residuals()) {
            sizes[observation.landmark].push(residual.abs() * self.scatters[observation.landmark]);
        }
        // A redundancy below one makes scatters look small. It costs a linearisation, so it is measured only where they differ.
        let scatters = match shrunk_scatters(&mut sizes, 1.0) {
            Some(scatters) if self.scatters_differ(&scatters) => shrunk_scatters(&mut sizes, self.redundancy()),
            _ => None,
        };
        let Some(scatters) = scatters.filter(|scatters| self.scatters_differ(scatters)) else { return false };
        self.scatters = scatters;
        true
    }

    /// The observations of all keyframes, in the order of [`Self::residuals`].
    pub(crate) fn observations(&self) -> impl Iterator<Item = &Observation> {
        self.keyframes.iter().flat_map(|keyframe| &keyframe.observations)
    }

    fn scatters_differ(&self, scatters: &[f64]) -> bool {
        scatters.iter().zip(&self.scatters).any(|(now, before)| (now / before).ln().abs() > LOG_CHANGE)
    }

    /// The mean redundancy number of the bearings (Baarda 1968): the share of their noise that shows in the residuals, apart from
    /// what the landmarks' own two parameters absorb. Every bearing is moved by a random sign, the unknowns are solved again,
    /// and the residuals tell how much was absorbed (Hutchinson's estimate of a trace, 1990).
    fn redundancy(&self) -> f64 {
        let mut moved = self.clone();
        let (mut random, mut signs) = (RandomSigns::new(), Vec::new());
        for observation in moved.keyframes.iter_mut().flat_map(|keyframe| &mut keyframe.observations) {
            let sign = random.next();
            let by = sign * PERTURBATION * self.bearing_sigma * self.scatters[observation.landmark];
            *observation = Observation::new(observation.landmark, observation.bearing + by);
            signs.push(sign);
        }
        let before = self.residuals();
        let last = self.keyframes.len() - 1;
        if moved.eliminate_poses(last, false, 0.0).and_then(|system| moved.take_step(&system)).is_none() {
            return 1.0;
        }
        let rows = moved.residuals().into_iter().zip(before).zip(&signs);
        let absorbed: f64 = rows.map(|((now, before), sign)| 1.0 + (now - before) * sign / PERTURBATION).sum();
        let count = signs.len() as f64;
        let own = 2.0 * self.landmarks.len() as f64;
        (1.0 - (absorbed - own).max(0.0) / count).max(LEAST_REDUNDANCY)
    }

    /// The part of the negative log-likelihood that depends on the scatters alone, so that solutions with different scatters can
    /// be compared by their cost.
    pub(crate) fn scatter_cost(&self) -> f64 {
        let logarithms: Vec<f64> = self.scatters.iter().map(|scatter| scatter.ln()).collect();
        self.observations().map(|observation| logarithms[observation.landmark]).sum()
    }
}

/// The scatter of each landmark from the sizes of its residuals at a redundancy; `None` if no landmark has enough bearings, or if
/// the median scatter is too large to be noise.
fn shrunk_scatters(sizes: &mut [Vec<f64>], redundancy: f64) -> Option<Vec<f64>> {
    let estimate = |sizes: &mut Vec<f64>| {
        let count = sizes.len() as f64;
        let at = (QUANTILE * count) as usize;
        let scatter = *sizes.select_nth_unstable_by(at, f64::total_cmp).1 / NORMAL_QUANTILE;
        let free = count * redundancy - 2.0;
        (free > 1.0).then(|| ((scatter * (count / free).sqrt()).max(LEAST_ESTIMATE).ln(), LOG_VARIANCE / free))
    };
    let estimates: Vec<Option<(f64, f64)>> =
        sizes.iter_mut().map(|sizes| if sizes.len() >= LEAST_BEARINGS { estimate(sizes) } else { None }).collect();
    let known = || estimates.iter().flatten();
    let middle = median(known().map(|(scatter, _)| *scatter)).filter(|middle| *middle <= MOST_MEDIAN.ln())?;
    let deviation = median(known().map(|(scatter, _)| (scatter - middle).abs()))? / NORMAL_MEDIAN;
    let chance = median(known().map(|(_, variance)| *variance))?;
    let between = (deviation * deviation - chance).max(0.0);
    let shrunk = |(scatter, variance): (f64, f64)| middle + (scatter - middle) * between / (between + variance);
    Some(estimates.iter().map(|estimate| estimate.map_or(1.0, |e| shrunk(e).exp().max(LEAST_SCATTER))).collect())
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let at = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(at, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::{Vector2, Vector3};

    use super::*;
    use crate::selfcalib::SelfCalibratorOptions;
    use crate::selfcalib::bundle::{FreeParameters, Keyframe};
    use crate::selfcalib::model::{
        BearingLoss, InverseDistanceLandmark, RelativeMotion, Viewpoint, WheelMotion, Wheels, compose,
    };

    /// Of bearings from poses that are known the mounting takes up three, and each landmark two, which do not count.
    #[test]
    fn the_redundancy_is_what_mounting_and_landmarks_leave() {
        let options = SelfCalibratorOptions { odometry_k_m: 1e-12, ..SelfCalibratorOptions::default() };
        let mounting = options.start.vector();
        let mut problem =
            BundleProblem::new(&options, &mounting, FreeParameters::default(), BearingLoss::Truncated(4.5));
        for k in 0..4 {
            let direction = TAU * f64::from(k) / 4.0 + 0.3;
            let far = InverseDistanceLandmark { anchor: Vector2::zeros(), direction, log_inverse_distance: -1.0 };
            problem.landmarks.push(far);
            problem.scatters.push(1.0);
        }
        let width = problem.width();
        problem.prior_mean = problem.shared();
        problem.prior_information = problem.prior_information.clone().resize(width, width, 0.0);
        let mut pose = Vector3::zeros();
        for step in 0..50 {
            let turn = if step % 20 < 10 { 0.1 } else { -0.05 };
            let motion = WheelMotion::from_motion(0.08, turn, options.wheel_base_m);
            let odometry = RelativeMotion::from_wheels(&motion, &Wheels::new(options.wheel_base_m), &problem.noise);
            pose = compose(&pose, &odometry.motion);
            let mut keyframe = Keyframe::after(odometry, pose, 1.0);
            let view = Viewpoint::new(&pose, &mounting);
            let seen = problem.landmarks.iter().map(|landmark| view.predict(&landmark.homogeneous()).bearing);
            keyframe
                .observations
                .extend(seen.enumerate().map(|(landmark, bearing)| Observation::new(landmark, bearing)));
            problem.keyframes.push(keyframe);
        }
        let redundancy = problem.redundancy();
        assert!((redundancy - (1.0 - 3.0 / 200.0)).abs() < 0.03, "{redundancy}");
    }
}
