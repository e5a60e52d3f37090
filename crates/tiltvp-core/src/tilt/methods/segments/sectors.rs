//! What edges that err together leave unknown of a frame.

use std::f64::consts::PI;

use nalgebra::{Matrix4, Vector4};

/// Sectors of azimuth whose residuals are taken as one: of 15 degrees.
const SECTORS: usize = 24;

/// Standard deviation in radians of what the edges of a sector have in common, before an image tells of it: as most views of
/// panoramas have it, which look up (0.22 degrees in the median) or ahead (0.13 to 0.19).
const COMMON_RAD: f64 = 0.2f64.to_radians();

/// How many sectors of an image count as much as that: views ahead have two to seven, which tell little of their own errors.
const BEFORE: f64 = 5.0;

/// Information and score of the edges of each sector of azimuth.
pub(super) struct Sectors([(Matrix4<f64>, Vector4<f64>); SECTORS]);

impl Sectors {
    pub(super) fn new() -> Self {
        Self([(Matrix4::zeros(), Vector4::zeros()); SECTORS])
    }

    pub(super) fn add(&mut self, azimuth_rad: f64, information: &Matrix4<f64>, score: &Vector4<f64>) {
        let sector = ((azimuth_rad / (2.0 * PI) + 0.5) * SECTORS as f64) as usize;
        let own = &mut self.0[sector.min(SECTORS - 1)];
        own.0 += information;
        own.1 += score;
    }

    /// Covariance of the sum of the scores, where the fit has the inverse `inverse` of its curvature.
    ///
    /// The errors of a sector's edges are one, `g_c = I_c b_c` with `E b_c b_c^T = s^2 1`. What is seen of them at the optimum is
    /// `(1 - I_c H^-1) g_c - I_c H^-1 sum_(d /= c) g_d`: less, the more of a fit hangs on few sectors (Bell and McCaffrey 2002).
    /// `s^2` is what makes up for that, and no less than together with what is known before.
    pub(super) fn spread(&self, inverse: &Matrix4<f64>) -> Matrix4<f64> {
        let held = || self.0.iter().filter(|(information, _)| information.trace() > 0.0);
        let squares: Matrix4<f64> = held().map(|(information, _)| information * information).sum();
        let (mut total, mut typical, mut pooled, mut expected) = (0.0, 0.0, 0.0, 0.0);
        for (information, score) in held() {
            let trace = information.trace();
            let (own, gone) = (information * information, information * inverse);
            let kept = Matrix4::identity() - gone;
            total += trace;
            typical += trace * trace;
            pooled += score.norm_squared() / trace;
            expected += (kept * own * kept.transpose() + gone * (squares - own) * gone.transpose()).trace() / trace;
        }
        if total == 0.0 {
            return squares;
        }
        // The information of one sector, in the mean over the information.
        typical /= total;
        let before = BEFORE * typical;
        let with_before = (pooled + before * COMMON_RAD * COMMON_RAD) / (expected + before);
        squares * (pooled / expected.max(typical)).max(with_before)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Scatter of the solution over simulated sectors, over what `spread` says of it: each sector knows one direction well.
    fn ratio(count: usize, sigma: f64) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(count as u64);
        // Of unit variance.
        let mut error = || 12f64.sqrt() * (rng.random::<f64>() - 0.5);
        let (mut scatter, mut told) = (0.0, 0.0);
        for _ in 0..400 {
            let information: Vec<_> = (0..count)
                .map(|k| {
                    let row = Vector4::from_fn(|i, _| if i == k % 4 { 1.0 } else { 0.3 * error() });
                    row * row.transpose() * 1e4 + Matrix4::identity() * 10.0
                })
                .collect();
            let inverse = information.iter().sum::<Matrix4<f64>>().try_inverse().unwrap();
            let pulls: Vec<_> = information.iter().map(|own| own * Vector4::from_fn(|_, _| sigma * error())).collect();
            let solution = inverse * pulls.iter().sum::<Vector4<f64>>();
            let mut sectors = Sectors::new();
            for (k, (own, pull)) in information.iter().zip(&pulls).enumerate() {
                let azimuth = (2.0 * PI).mul_add((k as f64 + 0.5) / SECTORS as f64, -PI);
                sectors.add(azimuth, own, &(pull - own * solution));
            }
            let covariance = inverse * sectors.spread(&inverse) * inverse;
            scatter += solution.norm_squared();
            told += covariance.trace();
        }
        scatter / told
    }

    #[test]
    fn few_sectors_are_no_surer_than_many() {
        // Far beyond what is known before, which then hardly counts.
        for count in [6, 8, 12, 24] {
            let ratio = ratio(count, 30.0 * COMMON_RAD);
            assert!((0.5..1.3).contains(&ratio), "{count}: {ratio}");
        }
        for count in [2, 4, 8, 24] {
            let ratio = ratio(count, COMMON_RAD);
            assert!((0.5..1.1).contains(&ratio), "{count}: {ratio}");
        }
    }

    #[test]
    fn nothing_is_held() {
        assert_eq!(Sectors::new().spread(&Matrix4::identity()), Matrix4::zeros());
    }
}
