//! From edge pixels to an estimate: the fits of the methods, and what is concluded from them.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Vector2, Vector3};

use super::confidence;
use super::corrected::Corrected;
use super::estimate::TiltEstimate;
use super::estimator::TiltEstimator;
use super::image_space::{Offsets, offsets};
use super::options::Method;
use super::refine::refine;
use super::scratch::{Inliers, Work};
use super::tables::Tables;
use super::trained::TrainedCorrection;
use super::vector_consensus::vector_consensus;
use crate::edges::{EdgePixels, LiftTable};
use crate::geometry::{Tilt, tangent_basis};
use crate::robust::{FitReport, Gate, RansacOptions, RejectRefitOptions, Stop, ransac, reject_refit};

/// Change of the shift in pixels below which the paper's trimming has converged (section 2.1.4).
const SHIFT_TOLERANCE_PX: f64 = 0.1;

/// How far in radians the edges of vertical things stray from the vertical, for the covariance of the paper's methods.
const STRAY_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// A fit in the parameters of its rows, on the way to an estimate.
struct Fit {
    tilt: Option<Tilt>,
    /// Row model and gate for the covariance.
    model: [f64; 3],
    gate: Gate,
    lean: Lean,
    inliers: usize,
    shift_px: Option<f64>,
    rms: f64,
    iterations: u32,
    stop: Stop,
}

/// No correction at all.
const AS_IT_IS: TrainedCorrection = TrainedCorrection::Factor(1.0);

/// How the row model's first two parameters, the shift, make the horizontal part of the normal.
enum Lean {
    /// By a matrix.
    Proportional(Matrix2<f64>),
    /// By the unit vector of the shift times a corrected angle, and then by a matrix.
    Bent { corrected: Corrected, toward: Vector2<f64>, direction: Matrix2<f64> },
}

impl Lean {
    fn new(correction: &TrainedCorrection, corrected: Corrected, shift: Vector2<f64>, direction: Matrix2<f64>) -> Self {
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

impl TiltEstimator {
    /// The estimate of the edge pixels of an image. What passed a screen and what passed none give the same one: screens
    /// keep out only what the prefilters reject.
    pub(super) fn fit(&self, edges: &EdgePixels, work: &mut Work) -> TiltEstimate {
        let fit = match &self.tables {
            Tables::Offsets { gains, correction, offset_max_px } => {
                self.fit_offsets(edges, &gains.relative, correction, *offset_max_px, work)
            }
            Tables::Normals(table) => self.fit_normals(edges, table, work),
        };
        self.conclude(edges, &fit, work)
    }

    /// Paper 000 section 2.1.
    fn fit_offsets(
        &self,
        edges: &EdgePixels,
        gains: &[f32],
        correction: &TrainedCorrection,
        offset_max_px: f64,
        work: &mut Work,
    ) -> Fit {
        work.inliers = Inliers::None;
        let Some(centre) = &self.sight.centre else { return Fit::none() };
        offsets(edges, centre, gains, offset_max_px, work);
        let sampling = self.options.sampling();
        work.prepare(sampling.as_ref(), edges);
        let Work { rows, weights, quality, ransac: scratch, .. } = &mut *work;
        let problem = Offsets::new(rows, quality);
        let upright = Vector2::zeros();
        let report: FitReport<Vector2<f64>> = match &self.options.method {
            Method::ImageSpaceRejectRefit { keep_fraction, max_iterations, .. } => {
                let options = RejectRefitOptions {
                    keep_fraction: *keep_fraction,
                    max_iterations: *max_iterations,
                    tolerance: SHIFT_TOLERANCE_PX,
                    rms_min: 0.0,
                };
                reject_refit(&problem, &options, &upright, weights)
            }
            Method::ImageSpaceRansac { threshold_px, .. } => {
                let seed = self.options.seed;
                let sampling = sampling.unwrap_or_default();
                let options = RansacOptions { seed, sampling, ..RansacOptions::with_threshold(*threshold_px) };
                ransac(&problem, &options, &upright, weights, scratch)
            }
            Method::VectorConsensus { .. } | Method::Refined(_) => return Fit::none(),
        };
        let shift = report.model.unwrap_or_default();
        let (l, corrected) = (shift.norm(), correction.at(shift.norm()));
        let alpha = corrected.alpha_rad;
        if alpha >= FRAC_PI_2 {
            return Fit::out_of_reach(alpha, &report);
        }
        work.inliers = Inliers::weighted_if(report.model.is_some());
        let lean = if l > 0.0 { centre.lean(&(shift / l)) } else { upright };
        let lean = lean.try_normalize(1e-9).unwrap_or_default() * alpha.sin();
        let tilt = report.model.and_then(|_| Tilt::from_normal(&Vector3::new(lean.x, lean.y, alpha.cos())));
        Fit {
            tilt,
            model: [shift.x, shift.y, 1.0],
            gate: Gate::Soft { scale: STRAY_RAD * correction.factor() },
            lean: Lean::new(correction, corrected, shift, *centre.direction()),
            inliers: report.inliers,
            shift_px: report.model.map(|_| l),
            rms: report.rms,
            iterations: report.iterations,
            stop: report.stop,
        }
    }

    /// Paper 000 section 2.2, and the refined method.
    fn fit_normals(&self, edges: &EdgePixels, table: &LiftTable, work: &mut Work) -> Fit {
        let Work { rows, weights, slots, places, .. } = &mut *work;
        table.lift(edges, self.options.normal_tilt_max_rad().sin(), rows, weights, slots, places);
        let sampling = self.options.sampling();
        work.prepare(sampling.as_ref(), edges);
        let Work { rows, weights, sparse, quality, ransac: scratch, inliers, .. } = &mut *work;
        *inliers = Inliers::None;
        let (report, gate, correction) = match &self.options.method {
            Method::VectorConsensus { threshold_rad, correction, .. } => {
                weights.fill(1.0);
                let seed = self.options.seed;
                let sampling = sampling.unwrap_or_default();
                let options = RansacOptions { seed, sampling, ..RansacOptions::with_threshold(threshold_rad.sin()) };
                let rotation = &self.origin.robot_from_camera;
                let report = vector_consensus(rows, quality, rotation, &options, weights, scratch);
                *inliers = Inliers::weighted_if(report.model.is_some());
                (report, Gate::Soft { scale: STRAY_RAD }, correction)
            }
            Method::Refined(options) => {
                let report = refine(rows, options, weights, sparse);
                *inliers = report.model.map_or(Inliers::None, |direction| Inliers::Within {
                    model: direction.into(),
                    threshold: 2.0 * options.scale_rad,
                });
                (report, Gate::Soft { scale: options.scale_rad }, &AS_IT_IS)
            }
            Method::ImageSpaceRansac { .. } | Method::ImageSpaceRejectRefit { .. } => return Fit::none(),
        };
        let tilt = report.model.and_then(|normal| Tilt::from_normal(&normal));
        let corrected = correction.at(tilt.map_or(0.0, |tilt| tilt.alpha_rad()));
        if tilt.is_some() && corrected.alpha_rad >= FRAC_PI_2 {
            *inliers = Inliers::None;
            return Fit::out_of_reach(corrected.alpha_rad, &report);
        }
        let horizontal = tilt.map_or(Vector2::zeros(), |tilt| tilt.normal().xy());
        let tilt = tilt.map(|tilt| {
            if *correction == AS_IT_IS { tilt } else { Tilt::from_alpha_beta(corrected.alpha_rad, tilt.beta_rad()) }
        });
        Fit {
            tilt,
            model: report.model.unwrap_or_default().into(),
            gate,
            lean: Lean::new(correction, corrected, horizontal, Matrix2::identity()),
            inliers: match *inliers {
                Inliers::Within { model, threshold } => rows.count_within(model, threshold),
                Inliers::None | Inliers::Weighted => report.inliers,
            },
            shift_px: None,
            rms: report.rms,
            iterations: report.iterations,
            stop: report.stop,
        }
    }

    /// Adds covariance and confidence.
    fn conclude(&self, edges: &EdgePixels, fit: &Fit, work: &Work) -> TiltEstimate {
        // The paper's methods end with weights of what they have selected, which cannot tell how sure the selection was.
        let weights = matches!(self.options.method, Method::Refined(_)).then_some(&work.weights[..]);
        let covariance = fit.tilt.and_then(|tilt| {
            let covariance = confidence::clustered_covariance(
                &work.rows,
                fit.model,
                fit.gate,
                weights,
                self.sight.region.pixels_per_rad(),
                (&work.slots, &self.sight.sectors),
            )?;
            // A change of the normal's horizontal part is a change in its tangent plane, seen along the vertical.
            let plane = tangent_basis(&tilt.normal()).fixed_rows::<2>(0).try_inverse()?;
            let share = if self.options.method.tells_its_error() { 0.0 } else { confidence::APPROXIMATE_SHARE };
            Some(fit.lean.covariance(&covariance, &plane, &tilt, share))
        });
        TiltEstimate {
            tilt: fit.tilt,
            covariance_rad2: covariance.unwrap_or(Matrix2::from_diagonal_element(f64::INFINITY)),
            confidence: covariance.map_or(0.0, |covariance| confidence::confidence(&covariance)),
            edge_pixels: edges.strong(),
            prefiltered_pixels: work.rows.len(),
            inlier_pixels: fit.inliers,
            shift_px: fit.shift_px,
            residual_rms: fit.rms,
            iterations: fit.iterations,
            stop: fit.stop,
        }
    }
}

impl Fit {
    /// A fit with a lean that no image of a band of elevations can show.
    fn out_of_reach<M>(alpha: f64, report: &FitReport<M>) -> Self {
        let stop = Stop::OutOfReach { angle_rad: alpha, limit_rad: FRAC_PI_2 };
        Self { iterations: report.iterations, stop, ..Self::none() }
    }

    /// No fit at all: the method has no tables of this kind.
    fn none() -> Self {
        Self {
            tilt: None,
            model: [0.0; 3],
            gate: Gate::Open,
            lean: Lean::Proportional(Matrix2::identity()),
            inliers: 0,
            shift_px: None,
            rms: f64::NAN,
            iterations: 0,
            stop: Stop::NoModel { trials: 0 },
        }
    }
}
