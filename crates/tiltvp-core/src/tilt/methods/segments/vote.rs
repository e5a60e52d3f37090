//! What single pixels add to the vertical of straight edges.

use nalgebra::Matrix2;

use crate::edges::{EdgeOptions, EdgePixels, RidgePixels};
use crate::geometry::{Tilt, tangent_basis};
use crate::tilt::fit::Fit;
use crate::tilt::methods::method::{Setting, TiltMethod};
use crate::tilt::methods::refined::{RefineOptions, Refined};
use crate::tilt::tables::PixelTables;
use crate::tilt::work::Work;

/// Standard deviation, a side, by which the vote of the pixels errs beside what its covariance tells, by normals that are told by the
/// gradients of single pixels: at least 0.7 degrees, and so many pixels. Of upward views of 640, 320 and 224 pixels the errors of
/// `refined` are 0.37, 0.66 and 0.94 degrees in the median.
const PIXELS_RAD: f64 = 0.7f64.to_radians();
const PIXELS_PX: f64 = 1.7;

/// The method of the pixels, and which of them vote.
#[derive(Debug)]
pub(super) struct Vote {
    pixels: Refined,
    strong: EdgeOptions,
    /// Whether each pixel of the region is in the band of elevations of those that vote.
    in_band: Vec<bool>,
}

impl Vote {
    pub(super) fn new(setting: &Setting<'_>) -> Self {
        let refined = RefineOptions::default();
        let (strong, region) = (refined.edges(), &setting.pixels.region);
        let heights = strong.elevation_min_rad.sin()..=strong.elevation_max_rad.sin();
        let in_band = region.bearing_table(|bearing| heights.contains(&bearing.z));
        Self { pixels: Refined::of_found(setting, refined), strong, in_band }
    }

    /// What the strong ridge pixels near the horizon say by their gradients.
    pub(super) fn of(
        &self,
        ridge: &RidgePixels,
        tables: &PixelTables,
        strong: &mut EdgePixels,
        work: &mut Work,
    ) -> Fit {
        let least = (self.strong.gradient_min * self.strong.gradient_min) as f32;
        strong.refill_where(&ridge.edges, |slot, gx, gy| (gx * gx + gy * gy >= least) & self.in_band[slot as usize]);
        self.pixels.fit_alone(strong, tables, work)
    }
}

/// Determinant of a covariance in shares of its squared trace, about the ratio of its variances, below which rounding of a gain is seen
/// in what is left: its square times that of a float is then above 1e-4.
const NEARLY_SINGULAR: f64 = 1e-6;

/// The fit to the segments with the vote of the pixels, by information. Where they differ by more than they may, the covariance
/// grows with the square of it (Birge 1932). The vote alone where the segments tell nothing.
pub(super) fn fused(fit: &Fit, vote: &Fit, pixels_per_rad: f64) -> Fit {
    let (Some(tilt), Some(covariance)) = (fit.tilt, fit.covariance) else {
        return if vote.covariance.is_some() { Fit { inliers: fit.inliers, ..*vote } } else { *fit };
    };
    let (Some(other), Some(other_covariance)) = (vote.tilt, vote.covariance) else { return *fit };
    let basis = tangent_basis(&tilt.normal());
    let away = basis.transpose() * other.normal();
    let sigma = PIXELS_RAD.max(PIXELS_PX / pixels_per_rad);
    let theirs = other_covariance + Matrix2::identity() * (sigma * sigma);
    let Some(inverse) = (covariance + theirs).try_inverse() else { return *fit };
    let gain = covariance * inverse;
    let normal = tilt.normal() + basis * (gain * away);
    // Its expectation is one.
    let disagreement = 0.5 * away.dot(&(inverse * away));
    let keep = Matrix2::identity() - gain;
    let together = if covariance.determinant() > NEARLY_SINGULAR * covariance.trace().powi(2) {
        keep * covariance * disagreement.max(1.0)
    } else {
        // Joseph's form, which leaves a covariance whatever rounding has done to the gain.
        (keep * covariance * keep.transpose() + gain * theirs * gain.transpose()) * disagreement.max(1.0)
    };
    let symmetric = 0.5 * (together + together.transpose());
    let mut alternatives = fit.alternatives;
    if let Some(chosen) = &mut alternatives[0] {
        chosen.normal = normal.normalize();
    }
    Fit { tilt: Tilt::from_normal(&normal), covariance: Some(symmetric), alternatives, ..*fit }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::Stop;
    use crate::tilt::confidence::inverse_of_positive;

    /// A fit of one wall's edges, which says next to nothing about the lean along it, and the pixels' vote: of variances as far apart
    /// as those of a fit can be.
    #[test]
    fn a_fit_that_tells_one_direction_alone_takes_the_other_from_the_vote() {
        let fit = |covariance| Fit {
            tilt: Some(Tilt::from_alpha_beta(0.1, 0.3)),
            covariance: Some(covariance),
            ..Fit::failed(Stop::TooFew { have: 0, need: 1 })
        };
        let (strong, vote) = (1e-5, 1e-4);
        let together = |own: f64| {
            let theirs = vote + PIXELS_RAD * PIXELS_RAD;
            own * theirs / (own + theirs)
        };
        for (turn, weak) in
            [0.0, 0.3, 0.8, 2.0].into_iter().flat_map(|turn| [1e-2, 10.0, 1e4, 1e6].map(|weak| (turn, weak)))
        {
            let axes = *nalgebra::Rotation2::new(turn).matrix();
            let of = |a, b| axes * Matrix2::new(a, 0.0, 0.0, b) * axes.transpose();
            let found = fused(&fit(of(weak, strong)), &fit(Matrix2::identity() * vote), 200.0).covariance.unwrap();
            let expected = of(together(weak), together(strong));
            assert!((found - expected).amax() < 0.05 * expected.amax(), "{weak} {turn}: {found} {expected}");
            assert!(inverse_of_positive(&found).is_some(), "{weak} {turn}: {found}");
        }
    }
}
