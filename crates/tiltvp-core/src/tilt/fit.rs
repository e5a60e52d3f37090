//! What a method finds in an image, and how sure it is of it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Vector2};

use super::confidence;
use super::corrected::Corrected;
use super::doubt::Doubt;
use super::estimate::{ALTERNATIVES, Alternative, TiltEstimate};
use super::tables::PixelTables;
use super::trained::TrainedCorrection;
use super::trust::{Believed, FEATURES, Seen, features};
use super::work::Work;
use crate::geometry::{Tilt, tangent_basis};
use crate::robust::{FitReport, Stop};

/// How far in radians the edges of vertical things stray from the vertical, for the covariance of the paper's methods: the
/// default `scale_rad` of the refined method.
pub(super) const STRAY_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// How probable it is that a lean beyond the largest expected one is as large as it seems: one in two of those of 11 to 15 degrees, where 10
/// are expected, errs by more than a degree.
const AS_LARGE: f64 = 0.5;

/// What a method finds in the edge pixels of one image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    pub tilt: Option<Tilt>,
    /// In squared radians in the tangent plane of the normal; `None` if the edges do not tell.
    pub covariance: Option<Matrix2<f64>>,
    pub inliers: usize,
    pub shift_px: Option<f64>,
    pub rms: f64,
    pub iterations: u32,
    pub stop: Stop,
    pub alternatives: [Option<Alternative>; ALTERNATIVES],
}

impl Fit {
    /// No answer, and why.
    pub(super) fn failed(stop: Stop) -> Self {
        Self {
            tilt: None,
            covariance: None,
            inliers: 0,
            shift_px: None,
            rms: f64::NAN,
            iterations: 0,
            stop,
            alternatives: [None; ALTERNATIVES],
        }
    }

    /// A fit that went as the report says, without a tilt so far.
    pub(super) fn without_tilt<M>(report: &FitReport<M>) -> Self {
        Self { rms: report.rms, iterations: report.iterations, ..Self::failed(report.stop) }
    }

    /// A fit with a lean that no image of a band of elevations can show.
    pub(super) fn out_of_reach<M>(alpha_rad: f64, report: &FitReport<M>) -> Self {
        let stop = Stop::OutOfReach { angle_rad: alpha_rad, limit_rad: FRAC_PI_2 };
        Self { stop, rms: f64::NAN, ..Self::without_tilt(report) }
    }

    /// A fit in radians that reached its limit of iterations has converged if it last moved by less than any image tells.
    pub(super) fn settled(self) -> Self {
        match self.stop {
            Stop::IterationLimit { change, .. } if change < confidence::FLOOR_RAD => {
                let (iterations, tolerance) = (self.iterations, confidence::FLOOR_RAD);
                Self { stop: Stop::Converged { iterations, change, tolerance }, ..self }
            }
            _ => self,
        }
    }

    /// The fit with the error of a lean that edges which do not agree draw to the upright robot. So many passed the prefilter; for
    /// `as_near` see [`confidence::diluted_share`].
    pub(super) fn diluted(self, near: usize, as_near: f64) -> Self {
        let (Some(tilt), Some(covariance)) = (self.tilt, self.covariance) else { return self };
        let share = confidence::diluted_share(self.inliers, near, as_near);
        Self { covariance: Some(confidence::with_lean_error(covariance, &tilt, share)), ..self }
    }

    /// The estimate of an image. A tilt of which the error is not known is none: nor one whose covariance is singular to rounding,
    /// for a direction in which an image tells nothing.
    pub(super) fn into_estimate(self, seen: &Seen<'_>, trusted: &mut [f64; FEATURES]) -> TiltEstimate {
        let chosen = self.alternatives[0].map_or(1.0, |best| best.probability);
        let (covariance, off_rad) = self.with_centre_off(seen);
        let covariance = covariance.map(|covariance| confidence::with_blur(covariance, seen.blur_rad));
        let covariance = covariance.filter(|covariance| confidence::inverse_of_positive(covariance).is_some());
        let undetermined = self.tilt.is_some() && covariance.is_none();
        let undetermined = undetermined.then_some(Stop::Undetermined { agreeing: self.inliers });
        let mut estimate = TiltEstimate {
            tilt: self.tilt.filter(|_| undetermined.is_none()),
            covariance_rad2: covariance.unwrap_or(Matrix2::from_diagonal_element(f64::INFINITY)),
            confidence: covariance.map_or(0.0, |covariance| chosen * confidence::confidence(&covariance)),
            edge_pixels: seen.edge_pixels,
            prefiltered_pixels: seen.prefiltered_pixels,
            inlier_pixels: self.inliers,
            shift_px: self.shift_px,
            alternatives: self.alternatives,
            residual_rms: if undetermined.is_some() { f64::NAN } else { self.rms },
            iterations: self.iterations,
            stop: undetermined.unwrap_or(self.stop),
            doubt: None,
        };
        *trusted = features(&estimate, seen);
        let small = estimate.confidence;
        let believed = seen.trust.map_or(Believed::ALL, |trust| trust.believed(trusted));
        estimate.confidence *= believed.vertical * believed.up;
        let looks_up = believed.up >= small.min(believed.vertical);
        let is_beyond = estimate.tilt.is_some_and(|tilt| tilt.alpha_rad() > seen.expected_max_rad);
        if is_beyond {
            estimate.confidence *= AS_LARGE;
        }
        let limit_rad = is_beyond.then_some(seen.expected_max_rad);
        estimate.doubt = Doubt::of(&estimate, seen, off_rad, looks_up, limit_rad);
        estimate
    }

    /// The covariance with the error of a centre that is off, and how large that is: the image does not tell which of its circle
    /// and its edges is right.
    fn with_centre_off(&self, seen: &Seen<'_>) -> (Option<Matrix2<f64>>, f64) {
        let (Some(tilt), Some(off)) = (&self.tilt, &seen.centre_off) else { return (self.covariance, 0.0) };
        let normal = tilt.normal();
        let error = tangent_basis(&normal).transpose() * off.error_of(&normal);
        (self.covariance.map(|covariance| covariance + error * error.transpose()), error.norm())
    }
}

/// How the rows of a fit tell its error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evidence {
    /// How far residuals of vertical things stray, in the unit of the rows: the scale of the soft gate.
    pub scale: f64,
    /// Whether rows count by their weights, or alike: weights of what a fit has selected cannot tell how sure the selection was.
    pub weighted: bool,
    /// Whether the method approximates the lens, so that the angle errs by more than edges tell.
    pub approximate: bool,
}

impl Evidence {
    /// The covariance of a tilt that the row model leans to.
    pub(super) fn covariance(
        &self,
        model: [f64; 3],
        lean: &Lean,
        tilt: &Tilt,
        pixels: &PixelTables,
        work: &Work,
    ) -> Option<Matrix2<f64>> {
        let of_model = confidence::clustered_covariance(
            &work.rows,
            model,
            self.scale,
            self.weighted.then_some(&work.weights[..]),
            pixels.region.pixels_per_rad(),
            (&work.slots, &pixels.sectors),
        )?;
        // A change of the normal's horizontal part is a change in its tangent plane, seen along the vertical.
        let plane = tangent_basis(&tilt.normal()).fixed_rows::<2>(0).try_inverse()?;
        let share = if self.approximate { confidence::APPROXIMATE_SHARE } else { 0.0 };
        Some(lean.covariance(&of_model, &plane, tilt, share))
    }
}

/// How the row model's first two parameters, the shift, make the horizontal part of the normal.
pub(super) enum Lean {
    /// By a matrix.
    Proportional(Matrix2<f64>),
    /// By the unit vector of the shift times a corrected angle, and then by a matrix.
    Bent { corrected: Corrected, toward: Vector2<f64>, direction: Matrix2<f64> },
}

impl Lean {
    pub(super) fn new(
        correction: &TrainedCorrection,
        corrected: Corrected,
        shift: Vector2<f64>,
        direction: Matrix2<f64>,
    ) -> Self {
        match correction {
            TrainedCorrection::Factor(factor) => Self::Proportional(direction / *factor),
            TrainedCorrection::Affine(_) | TrainedCorrection::Posterior(_) => {
                Self::Bent { corrected, toward: shift.try_normalize(0.0).unwrap_or(Vector2::x()), direction }
            }
        }
    }

    /// The covariance of the normal from that of the shift; `plane` takes horizontal changes to the tangent plane.
    /// `share` is that of the lean by which the method may err.
    fn covariance(&self, shift: &Matrix2<f64>, plane: &Matrix2<f64>, tilt: &Tilt, share: f64) -> Matrix2<f64> {
        let complete = |covariance| confidence::with_floor(confidence::with_lean_error(covariance, tilt, share));
        match self {
            Self::Proportional(matrix) => {
                let plane = plane * matrix;
                complete(plane * shift * plane.transpose())
            }
            Self::Bent { corrected, toward, direction } => {
                let across = Vector2::new(-toward.y, toward.x);
                let plane = plane * direction;
                let matrix = plane * corrected.jacobian(toward, across.dot(&(shift * across)));
                let covariance = complete(matrix * shift * matrix.transpose());
                let radial = (plane * toward).normalize();
                let own = radial.dot(&(covariance * radial));
                // The training set has seen what this image may not know of itself.
                let raised = (corrected.std_rad * corrected.std_rad - own).max(0.0);
                covariance + radial * radial.transpose() * raised
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tilt::lightness::LIGHTS;
    use crate::tilt::trust::{ASPECT, Trust};

    fn fit(covariance: Matrix2<f64>) -> Fit {
        Fit {
            tilt: Some(Tilt::from_alpha_beta(0.1, 0.3)),
            covariance: Some(covariance),
            inliers: 7,
            ..Fit::failed(Stop::Converged { iterations: 3, change: 0.0, tolerance: 1e-6 })
        }
    }

    fn seen(trust: Option<&'static Trust>) -> Seen<'static> {
        Seen {
            edge_pixels: 9,
            pixels: 1000,
            prefiltered_pixels: 8,
            pixels_per_rad: 100.0,
            tilt_max_rad: 0.5,
            expected_max_rad: 0.5,
            lights: &[0.0; LIGHTS],
            aspect: [0.0; ASPECT],
            trust,
            centre_off: None,
            blur_rad: 0.0,
        }
    }

    /// The residuals of a model that is no answer are none of its own.
    #[test]
    fn a_lean_out_of_reach_is_no_answer() {
        let stop = Stop::Converged { iterations: 4, change: 0.0, tolerance: 1e-6 };
        let report = FitReport { model: Some(()), inliers: 30, rms: 0.4, iterations: 4, stop };
        let fit = Fit::out_of_reach(1.7, &report);
        assert!(fit.rms.is_nan() && fit.tilt.is_none() && fit.iterations == 4);
        assert_eq!(fit.stop, Stop::OutOfReach { angle_rad: 1.7, limit_rad: FRAC_PI_2 });
    }

    /// Of a lean of 0.1 rad towards 0.3 rad, of which 995 edges agree.
    #[test]
    fn a_lean_is_as_uncertain_as_edges_draw_it_that_do_not_agree() {
        let of = |near, as_near| {
            let fit = Fit { inliers: 995, ..fit(Matrix2::identity() * 1e-6) }.diluted(near, as_near);
            let (along, covariance) = (Vector2::new(0.3f64.cos(), 0.3f64.sin()), fit.covariance.unwrap());
            let across = Vector2::new(-along.y, along.x);
            [along, across].map(|direction| (direction.dot(&(covariance * direction)) - 1e-6).max(0.0).sqrt())
        };
        let [clear, _] = of(1450, 1.0);
        assert!(clear < 1e-4, "{clear}");
        for [along, across] in [of(2450, 1.0), of(3950, 0.5)] {
            assert!((along - 0.1).abs() < 1e-4 && across < 1e-6, "{along} {across}");
        }
        assert_eq!(of(1_000_000, 1.0), of(10_000_000, 1.0));
    }

    #[test]
    fn what_is_least_probable_of_fit_and_mounting_is_the_doubt() {
        static FIT: Trust = Trust::told(-1.0, 1.0);
        static MOUNTING: Trust = Trust::told(1.0, -1.0);
        let of = |trust| fit(Matrix2::identity() * 1e-5).into_estimate(&seen(Some(trust)), &mut [0.0; FEATURES]);
        let (fit, mounting) = (of(&FIT), of(&MOUNTING));
        assert!((fit.confidence - mounting.confidence).abs() < 1e-12 && (0.19..0.2).contains(&fit.confidence));
        assert!(matches!(fit.doubt, Some(Doubt::FewEdges { pixels: 9 })));
        assert_eq!(mounting.doubt, Some(Doubt::NotUp));
        assert!(mounting.doubt.is_some_and(|doubt| doubt.to_string().contains("check the mounting")));
    }

    #[test]
    fn a_lean_beyond_the_largest_expected_one_may_be_larger() {
        let of = |expected_max_rad: f64| {
            let seen = Seen { expected_max_rad, ..seen(None) };
            fit(Matrix2::identity() * 1e-5).into_estimate(&seen, &mut [0.0; FEATURES])
        };
        let (within, beyond) = (of(0.11), of(0.09));
        assert!(within.doubt.is_none() && beyond.confidence == AS_LARGE * within.confidence);
        assert_eq!(beyond.doubt, Some(Doubt::Beyond { limit_rad: 0.09 }));
        assert!(beyond.doubt.is_some_and(|doubt| doubt.to_string().contains("raise tilt_max_rad")));
    }

    #[test]
    fn a_tilt_whose_covariance_is_singular_to_rounding_is_none() {
        let estimate = |weak: f64, turn: f64| {
            let axes = *nalgebra::Rotation2::new(turn).matrix();
            let covariance = axes * Matrix2::from_diagonal(&Vector2::new(weak, 1e-5)) * axes.transpose();
            fit(covariance).into_estimate(&seen(None), &mut [0.0; FEATURES])
        };
        for turn in [0.0, 0.3, 0.8, 2.0] {
            let known = estimate(1e-4, turn);
            assert!(known.tilt.is_some() && known.confidence > 0.9 && known.covariance_rad2[(0, 0)] < 1e-3);
            for weak in [-1e-6, 0.0, 1e9, 1e20] {
                let found = estimate(weak, turn);
                assert_eq!((found.tilt, found.confidence), (None, 0.0), "{weak} {turn}");
                assert!(matches!(found.stop, Stop::Undetermined { agreeing: 7 }) && found.residual_rms.is_nan());
                assert_eq!(found.covariance_rad2, Matrix2::from_diagonal_element(f64::INFINITY));
            }
        }
    }
}
