//! Whether a fit is of the vertical at all, and what most likely keeps an estimate from being sure.

use super::doubt::Doubt;
use super::estimate::TiltEstimate;
use super::image_circle::CentreOff;
use super::lightness::LIGHTS;
use crate::robust::Stop;

/// How many numbers tell of a fit.
const FIT: usize = 8;

/// The first of them tell how fine an image is, whichever way the camera is mounted.
const FINENESS: usize = 2;

/// How many numbers tell where what a method looks at stands; a method that tells less leaves the last ones zero.
pub(super) const ASPECT: usize = 5;

/// How many numbers tell whether an estimate is right.
pub(super) const FEATURES: usize = FIT + LIGHTS + ASPECT;

/// What is known of an image beside its fit.
pub(super) struct Seen<'a> {
    pub edge_pixels: usize,
    /// Pixels that are looked at.
    pub pixels: usize,
    /// Edge pixels that passed the prefilter.
    pub prefiltered_pixels: usize,
    pub pixels_per_rad: f64,
    /// The largest lean that is looked for.
    pub tilt_max_rad: f64,
    /// The largest lean that is expected: larger ones may be larger than they seem.
    pub expected_max_rad: f64,
    /// How light the view is at each height.
    pub lights: &'a [f64; LIGHTS],
    /// Where what the method looks at stands.
    pub aspect: [f64; ASPECT],
    /// How far the method's fits can be trusted to be of the vertical at all.
    pub trust: Option<&'static Trust>,
    /// A centre that is off.
    pub centre_off: Option<CentreOff<'a>>,
    /// Standard deviation in radians, a side, for blur.
    pub blur_rad: f64,
}

/// How it is told whether a method's fits are of the vertical: logistic regressions on views whose cameras, mountings or scenes
/// mislead, `tiltvp measure trust`, which prints them.
#[derive(Debug)]
pub(super) struct Trust {
    /// Whether a fit is of the vertical and not of some other direction that edges share: told by the fit.
    pub vertical: Logit<FIT>,
    /// Whether the camera is mounted as told, if that has been learned. A factor of its own: light from above makes no poor fit
    /// believable.
    pub up: Option<Logit<{ FEATURES - FINENESS }>>,
}

/// A logistic regression.
#[derive(Debug)]
pub(super) struct Logit<const N: usize> {
    pub constant: f64,
    pub weights: [f64; N],
}

impl<const N: usize> Logit<N> {
    /// The probability by as many numbers as there are weights.
    fn probability(&self, features: &[f64]) -> f64 {
        let log_odds: f64 =
            self.constant + features.iter().zip(self.weights).map(|(x, weight)| x * weight).sum::<f64>();
        1.0 / (1.0 + (-log_odds).exp())
    }
}

/// How probable it is that a fit is of the vertical, and that up is where it is told to be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Believed {
    pub vertical: f64,
    pub up: f64,
}

impl Believed {
    /// Without doubt.
    pub(super) const ALL: Self = Self { vertical: 1.0, up: 1.0 };
}

impl Trust {
    /// One whose logarithms of the odds are these, whatever is seen.
    #[cfg(test)]
    pub(super) const fn told(vertical: f64, up: f64) -> Self {
        let vertical = Logit { constant: vertical, weights: [0.0; FIT] };
        Self { vertical, up: Some(Logit { constant: up, weights: [0.0; FEATURES - FINENESS] }) }
    }

    /// The probabilities of a fit.
    pub(super) fn believed(&self, features: &[f64; FEATURES]) -> Believed {
        let (vertical, up) = (&features[..FIT], &features[FINENESS..]);
        Believed {
            vertical: self.vertical.probability(vertical),
            up: self.up.as_ref().map_or(Believed::ALL.up, |logit| logit.probability(up)),
        }
    }
}

/// What tells it: the stated error, how fine the pixels are, how much agrees of what might and of all, how well it agrees, how much
/// that is, and how near it is to the largest lean; then how light the view is at each height, and where edges stand.
pub(super) fn features(estimate: &TiltEstimate, seen: &Seen<'_>) -> [f64; FEATURES] {
    let mut all = [0.0; FEATURES];
    let (of_fit, of_view) = all.split_at_mut(FIT);
    of_fit.copy_from_slice(&fit_features(estimate, seen.pixels_per_rad, seen.tilt_max_rad));
    let (lights, aspect) = of_view.split_at_mut(LIGHTS);
    lights.copy_from_slice(seen.lights);
    aspect.copy_from_slice(&seen.aspect);
    all
}

fn fit_features(estimate: &TiltEstimate, pixels_per_rad: f64, tilt_max_rad: f64) -> [f64; FIT] {
    let [inliers, near, all] =
        [estimate.inlier_pixels, estimate.prefiltered_pixels, estimate.edge_pixels].map(|n| n as f64);
    let sigma_deg = estimate.covariance_rad2.trace().sqrt().to_degrees().clamp(0.1, 30.0);
    let lean = estimate.tilt.map_or(0.0, |tilt| tilt.alpha_rad() / tilt_max_rad);
    let share = ((inliers + 1.0) / (all + 10.0)).ln();
    [
        sigma_deg.ln(),
        (pixels_per_rad / 150.0).ln().min(0.0),
        ((inliers + 5.0) / (near + 50.0)).ln(),
        share,
        share * share,
        if estimate.residual_rms.is_finite() { estimate.residual_rms.to_degrees() } else { 2.0 },
        (inliers / pixels_per_rad).ln_1p(),
        1.2 * lean,
    ]
}

/// Confidence from which on nothing is in doubt.
const SURE: f64 = 0.9;

/// Pixels per degree below which pixels are named as the cause: of images of known tilt through an upward camera of 160 x 120 pixels, with
/// 0.7, a third errs by more than two degrees, of 320 x 240 hardly any.
const PIXELS_PER_DEG: f64 = 1.0;

/// Share of all edge pixels below which few agree: the fifth of a hundred views that are read as they are.
const AGREEING: f64 = 0.09;

/// Share of the pixels that are edges above which they are of noise or texture: of sixty views of panoramas a twentieth has 0.39 and
/// more, with noise of 10 to 40 grey levels half have 0.6 and more.
const NOISY: f64 = 0.5;

/// Share of the variance from which blur is named as the cause, before what blur does: edges that stray, few that agree.
const BLURRED: f64 = 0.25;

/// Edge pixels for each radian's worth of pixels below which there are few: a tenth of what views of rooms have.
const EDGES: f64 = 20.0;

/// Ratio of the stated errors in two directions from which on edges stand in too few directions.
const UNLIKE: f64 = 3.0;

impl Doubt {
    /// What most likely is wrong with an image, if its estimate is not sure.
    pub(super) fn of(
        estimate: &TiltEstimate,
        seen: &Seen<'_>,
        off_rad: f64,
        looks_up: bool,
        limit_rad: Option<f64>,
    ) -> Option<Self> {
        if estimate.confidence >= SURE {
            return None;
        }
        let per_deg = seen.pixels_per_rad.to_radians();
        let crowded = estimate.edge_pixels as f64 / seen.pixels.max(1) as f64;
        let share = estimate.inlier_pixels as f64 / estimate.edge_pixels.max(1) as f64;
        let eigenvalues = estimate.covariance_rad2.symmetric_eigenvalues();
        let ratio = (eigenvalues.max() / eigenvalues.min()).sqrt();
        Some(if off_rad > 0.0 {
            Self::Decentred { off_rad }
        } else if per_deg < PIXELS_PER_DEG {
            Self::Coarse { per_deg }
        } else if !looks_up {
            Self::NotUp
        } else if let Some(limit_rad) = limit_rad {
            Self::Beyond { limit_rad }
        } else if 2.0 * seen.blur_rad.powi(2) > BLURRED * estimate.covariance_rad2.trace() {
            Self::Blurred { sigma_rad: seen.blur_rad }
        } else if (estimate.edge_pixels as f64) < EDGES * seen.pixels_per_rad {
            Self::FewEdges { pixels: estimate.edge_pixels }
        } else if crowded > NOISY {
            Self::Noisy { share: crowded }
        } else if estimate.tilt.is_some() && share < AGREEING {
            Self::FewAgree { share }
        } else if ratio > UNLIKE {
            Self::OneSided { ratio }
        } else if matches!(estimate.stop, Stop::Chosen { probability, .. } if probability < SURE) {
            // What speaks for others says so itself.
            return None;
        } else if estimate.tilt.is_some() {
            Self::Scattered { sigma_rad: estimate.covariance_rad2.trace().sqrt() }
        } else {
            return None;
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};

    use super::*;
    use crate::geometry::Tilt;
    use crate::tilt::estimate::ALTERNATIVES;

    /// 150 pixels for a radian and upwards, 0.2 degrees.
    fn unsure(sigmas_rad: [f64; 2]) -> TiltEstimate {
        TiltEstimate {
            tilt: Some(Tilt::from_alpha_beta(0.02, 0.3)),
            covariance_rad2: Matrix2::from_diagonal(&Vector2::from(sigmas_rad.map(|sigma| sigma * sigma))),
            confidence: 0.5,
            edge_pixels: 6000,
            prefiltered_pixels: 2000,
            inlier_pixels: 1000,
            shift_px: None,
            alternatives: [None; ALTERNATIVES],
            residual_rms: 0.01,
            iterations: 1,
            stop: Stop::Confident { trials: 1, needed: 1 },
            doubt: None,
        }
    }

    /// Of an image of so many pixels.
    fn seen(pixels: usize, pixels_per_rad: f64) -> Seen<'static> {
        Seen {
            edge_pixels: 6000,
            pixels,
            prefiltered_pixels: 2000,
            pixels_per_rad,
            tilt_max_rad: 0.5,
            expected_max_rad: 0.5,
            lights: &[0.0; LIGHTS],
            aspect: [0.0; ASPECT],
            trust: None,
            centre_off: None,
            blur_rad: 0.0,
        }
    }

    #[test]
    fn the_first_cause_that_holds_is_named() {
        let (fine, coarse) = (seen(100_000, 150.0), seen(100_000, 50.0));
        let of = |estimate: &TiltEstimate| Doubt::of(estimate, &fine, 0.0, true, None);
        let even = unsure([0.02, 0.01]);
        assert!(matches!(of(&even), Some(Doubt::Scattered { sigma_rad }) if (sigma_rad - 5e-4f64.sqrt()).abs() < 1e-9));
        assert!(of(&TiltEstimate { confidence: 0.9, ..even }).is_none());
        assert!(of(&TiltEstimate { tilt: None, ..even }).is_none());
        assert!(of(&TiltEstimate { stop: Stop::Chosen { probability: 0.6, of: 2 }, ..even }).is_none());
        let one_sided = unsure([0.04, 0.01]);
        assert!(matches!(of(&one_sided), Some(Doubt::OneSided { ratio }) if (ratio - 4.0).abs() < 1e-9));
        let few_agree = TiltEstimate { inlier_pixels: 300, ..one_sided };
        assert!(matches!(of(&few_agree), Some(Doubt::FewAgree { share }) if (share - 0.05).abs() < 1e-9));
        let blurred = Seen { blur_rad: 0.02, ..seen(100_000, 150.0) };
        let of_blurred = Doubt::of(&few_agree, &blurred, 0.0, true, None);
        assert!(matches!(of_blurred, Some(Doubt::Blurred { sigma_rad: 0.02 })));
        assert!(of_blurred.is_some_and(|doubt| doubt.to_string().contains("off by 1.1 degrees")));
        let noisy = Doubt::of(&few_agree, &seen(10_000, 150.0), 0.0, true, None);
        assert!(matches!(noisy, Some(Doubt::Noisy { share: 0.6 })));
        let few_edges = TiltEstimate { edge_pixels: 2900, ..few_agree };
        assert!(matches!(of(&few_edges), Some(Doubt::FewEdges { pixels: 2900 })));
        assert!(matches!(Doubt::of(&few_edges, &fine, 0.0, false, Some(0.2)), Some(Doubt::NotUp)));
        let blunt = Doubt::of(&few_edges, &coarse, 0.0, false, None);
        assert!(matches!(blunt, Some(Doubt::Coarse { per_deg }) if (per_deg - 0.8727).abs() < 1e-3));
        let limited = Doubt::of(&few_edges, &fine, 0.0, true, Some(0.2));
        assert!(matches!(limited, Some(Doubt::Beyond { limit_rad: 0.2 })));
        assert!(matches!(Doubt::of(&few_edges, &coarse, 0.01, false, None), Some(Doubt::Decentred { off_rad: 0.01 })));
    }
}
