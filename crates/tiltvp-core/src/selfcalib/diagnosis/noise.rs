//! The noise of bearings and of motions as the residuals tell it: variance components (Foerstner 1979).

use nalgebra::{Matrix3, Vector3};

use crate::selfcalib::bundle::{BundleProblem, Observation, RandomSigns};
use crate::selfcalib::model::{OUTLIER_SIGMAS, between};

/// Random probes of the redundancies: their error is then some 10 % where fifty motions are redundant.
const PROBES: usize = 4;

/// Size of a probe in standard deviations: as in the estimate of the landmarks' scatters, the step is linear.
const PROBE: f64 = 0.1;

/// Redundancy below which a log is too short to tell a noise: the standard deviation of its logarithm is then 0.45.
const LEAST_REDUNDANCY: f64 = 10.0;

/// Standard deviations, and factor of the variance, beyond which the noise is another than told. Factors up to two leave stated
/// errors within 1.4 of the true ones.
const SIGNIFICANT_SIGMAS: f64 = 3.0;
const SIGNIFICANT_FACTOR: f64 = 2.0;

/// The share of normal numbers within one standard deviation.
const ONE_SIGMA_SHARE: f64 = 0.6827;

/// Squared Mahalanobis distance as which a motion beyond counts: that of a slip.
const MOST_SQUARED: f64 = 25.0;

/// Share of slips up to which they do not count: wheels slip now and then.
const SLIP_SHARE: f64 = 0.1;

/// Factors of the variances of bearings and of motions; 1 where the log does not say that they are others than told.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct NoiseFactors {
    pub(crate) bearings: f64,
    pub(crate) motions: f64,
}

impl NoiseFactors {
    pub(crate) const ONE: Self = Self { bearings: 1.0, motions: 1.0 };

    /// The larger of both where noise is larger than told.
    pub(crate) fn excess(self) -> f64 {
        self.motions.max(self.bearings).max(1.0)
    }

    /// These factors after others.
    pub(crate) fn times(self, other: Self) -> Self {
        Self { bearings: self.bearings * other.bearings, motions: self.motions * other.motions }
    }
}

impl BundleProblem {
    /// The factors by which the variances of bearings and motions are others than assumed, where that is significant.
    pub(crate) fn noise_factors(&self) -> NoiseFactors {
        let (mut bearings, mut motions) = (0.0, 0.0);
        let before = (self.residuals(), self.motion_residuals());
        let used: Vec<bool> = before.0.iter().map(|r| r.abs() <= OUTLIER_SIGMAS).collect();
        let counted: Vec<bool> = before.1.iter().map(|r| r.norm_squared() <= MOST_SQUARED).collect();
        let mut signs = RandomSigns::new();
        for _ in 0..PROBES {
            let Some((one, other)) = self.probe(&before, (&used, &counted), &mut signs) else {
                return NoiseFactors::ONE;
            };
            bearings += one / PROBES as f64;
            motions += other / PROBES as f64;
        }
        let among = used.iter().filter(|used| **used).count() as f64;
        let mut sizes: Vec<f64> =
            self.observations().zip(&before.0).map(|(seen, r)| r.abs() * self.scatters[seen.landmark]).collect();
        let at = ((ONE_SIGMA_SHARE * sizes.len() as f64) as usize).min(sizes.len().saturating_sub(1));
        let scatter = if sizes.is_empty() { 1.0 } else { *sizes.select_nth_unstable_by(at, f64::total_cmp).1 };
        let slips = counted.iter().filter(|counted| !**counted).count() as f64;
        let rare = slips <= SLIP_SHARE * counted.len() as f64;
        let sum: f64 = before
            .1
            .iter()
            .map(Vector3::norm_squared)
            .map(|s| {
                if s <= MOST_SQUARED {
                    s
                } else if rare {
                    0.0
                } else {
                    MOST_SQUARED
                }
            })
            .sum();
        let free = if rare { motions } else { motions + 3.0 * slips };
        NoiseFactors {
            bearings: significant(scatter * scatter * among / bearings.max(1e-3), bearings),
            motions: significant(sum / free.max(1e-3), free),
        }
    }

    /// The whitened residuals of the motions, without the robust weight.
    fn motion_residuals(&self) -> Vec<Vector3<f64>> {
        let one = |pair: &[crate::selfcalib::bundle::Keyframe]| {
            let r = between(&pair[0].pose, &pair[1].pose) - pair[1].odometry.motion;
            whitening(&pair[1].information) * r
        };
        self.keyframes.windows(2).map(one).collect()
    }

    /// The redundancies of the bearings and of the motions that count, by moving all of them by random signs (Hutchinson 1990).
    fn probe(
        &self,
        before: &(Vec<f64>, Vec<Vector3<f64>>),
        counts: (&[bool], &[bool]),
        signs: &mut RandomSigns,
    ) -> Option<(f64, f64)> {
        let mut moved = self.clone();
        let (mut of_bearings, mut of_motions) = (Vec::new(), Vec::new());
        for keyframe in &mut moved.keyframes {
            for seen in &mut keyframe.observations {
                let sign = signs.next();
                let by = sign * PROBE * self.bearing_sigma * self.scatters[seen.landmark];
                *seen = Observation::new(seen.landmark, seen.bearing + by);
                of_bearings.push(sign);
            }
        }
        for keyframe in moved.keyframes.iter_mut().skip(1) {
            let sign = Vector3::from_fn(|_, _| signs.next());
            let root = whitening(&keyframe.information).try_inverse()?;
            keyframe.odometry.motion += root * sign * PROBE;
            of_motions.push(sign);
        }
        moved.eliminate_poses(self.keyframes.len() - 1, false, 0.0).and_then(|system| moved.take_step(&system))?;
        let after = moved.residuals();
        let rows = after.iter().zip(&before.0).zip(&of_bearings).zip(counts.0).filter(|(_, used)| **used);
        // A residual is prediction minus bearing, and motion minus odometry.
        let bearings = rows.map(|(((now, was), sign), _)| -(now - was) * sign / PROBE).sum();
        // Wheels that are estimated integrate the readings anew, without the probe.
        let lost = if moved.free.wheels { 1.0 } else { 0.0 };
        let after = moved.motion_residuals();
        let rows = after.iter().zip(&before.1).zip(&of_motions).zip(counts.1).filter(|(_, counted)| **counted);
        let motions = rows.map(|(((now, was), sign), _)| lost * 3.0 - (now - was).dot(sign) / PROBE).sum();
        Some((bearings, motions))
    }

    /// This problem with variances that are so much larger.
    pub(crate) fn scale_noise(&mut self, factors: NoiseFactors) {
        self.bearing_sigma *= factors.bearings.sqrt();
        self.noise.k_m *= factors.motions;
        self.noise.step_sigma_m *= factors.motions.sqrt();
        self.noise.step_sigma_rad *= factors.motions.sqrt();
        for keyframe in self.keyframes.iter_mut().skip(1) {
            keyframe.odometry.covariance *= factors.motions;
            keyframe.information /= factors.motions;
        }
        self.scatters.fill(1.0);
    }
}

/// A factor of the variance with so much redundancy, or 1 where it is not significant.
fn significant(factor: f64, redundancy: f64) -> f64 {
    let off = factor.ln().abs();
    let beyond = off > SIGNIFICANT_FACTOR.ln() && off > SIGNIFICANT_SIGMAS * (2.0 / redundancy).sqrt();
    if redundancy >= LEAST_REDUNDANCY && beyond { factor } else { 1.0 }
}

/// `W` such that `W^T W` is the information.
fn whitening(information: &Matrix3<f64>) -> Matrix3<f64> {
    information.cholesky().map_or_else(Matrix3::zeros, |factor| factor.l().transpose())
}
