//! The refined method: exact normals weighted by their gradients, trimmed from the upright prior, then a fading soft gate.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use nalgebra::Vector3;

use super::method::{Fitter, Prepared, Refitter, Setting, TiltMethod};
use super::normals::{self, Normals};
use super::subsample::Subsample;
use crate::edges::{EdgeOptions, EdgePixels, NormalKind, Prefilter};
use crate::error::Result;
use crate::options;
use crate::options::{Between, NOT_NEGATIVE};
use crate::robust::{Direction, FitReport, Real, RejectRefitOptions, ReweightOptions, Rows, reject_refit, reweight};
use crate::tilt::fit::{Evidence, Fit};
use crate::tilt::tables::PixelTables;
use crate::tilt::trained::TrainedCorrection;
use crate::tilt::trust::{ASPECT, Logit, Trust};
use crate::tilt::work::{Inliers, Work};

options! {
    /// Options of the refined method. Angles are those between an edge's great circle and the vertical.
    #[derive(Copy)]
    pub struct RefineOptions {
        /// Share of normal residuals that each trimming round keeps.
        keep_fraction: f64 = 0.8 => Between(0.0, 1.0), "a share strictly between 0 and 1";
        /// Standard deviation in radians of the soft gate at the end: how far the edges of vertical things stray.
        scale_rad: f64 = 2f64.to_radians() => Between(0.0, 1.0), "an angle strictly between 0 and 1 radian";
        /// Change of the direction in radians below which it has converged: a fiftieth of a degree.
        tolerance_rad: f64 = 3.5e-4 => NOT_NEGATIVE, "an angle of zero or more";
        /// Most refits with the gate at its final scale.
        max_iterations: u32 = 4 => 1.0..=f64::from(u32::MAX), "a whole number, at least 1";
    }
}

/// Largest lean that is expected without `tilt_max_rad`.
const TILT_MAX_RAD: f64 = 10f64.to_radians();

/// How a fit tells whether it is of the vertical: `tiltvp measure trust --weights` prints it.
static TRUST: Trust = Trust {
    vertical: Logit { constant: 3.855, weights: [-2.494, 0.4482, 2.147, -0.8832, -0.2784, 1.235, -0.2442, -2.42] },
    up: Some(Logit {
        constant: 10.37,
        weights: [
            1.139, 0.7491, 0.1555, -2.709, 0.8037, -2.814, -1.46, -0.1345, -0.9677, -4.201, 1.153, 0.6285, -0.7748,
            2.129, 0.3655, -1.859, -1.869, -0.2662, 0.7099, -1.037, 1.193, -2.354, -6.008, 1.225, 0.0, 0.0, 0.0,
        ],
    }),
};

impl TiltMethod for RefineOptions {
    fn edges(&self) -> EdgeOptions {
        EdgeOptions { gradient_min: 150.0, smoothing_px: 0.6, ..EdgeOptions::default() }
    }

    fn prepare(&self, setting: &Setting<'_>) -> Result<Prepared> {
        Ok(Prepared::Pixels(Arc::new(Refined::new(setting, *self))))
    }
}

/// The method ready for images.
#[derive(Debug)]
pub(super) struct Refined {
    normals: Normals,
    options: RefineOptions,
    lean_limits_rad: [f64; 2],
    /// Share of the edges that pass the prefilter that would pass that of `TILT_MAX_RAD`, if they stand evenly.
    as_near: f64,
}

impl Refined {
    pub(super) fn new(setting: &Setting<'_>, options: RefineOptions) -> Self {
        Self::by(setting, options, Normals::new)
    }

    /// The method for edge pixels that others find.
    pub(super) fn of_found(setting: &Setting<'_>, options: RefineOptions) -> Self {
        Self::by(setting, options, Normals::without_prefilter)
    }

    fn by(
        setting: &Setting<'_>,
        options: RefineOptions,
        normals: fn(&Setting<'_>, NormalKind, f64) -> Normals,
    ) -> Self {
        // Edges stray: those of the largest lean do to either side of it.
        let searched_rad = setting.searched_rad(TILT_MAX_RAD);
        let edges_rad = (searched_rad + options.scale_rad).min(FRAC_PI_2);
        let normals = normals(setting, NormalKind::Tangent, edges_rad);
        let as_near = TILT_MAX_RAD / searched_rad;
        Self { normals, options, lean_limits_rad: [TILT_MAX_RAD, edges_rad], as_near }
    }

    /// The fit with the error that the edges which agree tell.
    pub(super) fn fit_alone(&self, edges: &EdgePixels, pixels: &PixelTables, work: &mut Work) -> Fit {
        self.normals.lift(edges, work);
        self.fit_rows(pixels, work)
    }

    /// The fit of the rows.
    fn fit_rows(&self, pixels: &PixelTables, work: &mut Work) -> Fit {
        let report = refine(&work.rows, &self.options, &mut work.weights, &mut work.subsample);
        let scale = self.options.scale_rad;
        let threshold = INLIER_SCALES * scale;
        let within = |direction: Vector3<f64>| Inliers::Within { model: direction.into(), threshold };
        work.inliers = report.model.map_or(Inliers::None, within);
        let evidence = Evidence { scale, weighted: true, approximate: false };
        normals::conclude(&report, &TrainedCorrection::IDENTITY, &evidence, pixels, work)
    }
}

impl Fitter for Refined {
    fn prefilter(&self) -> Option<&Prefilter> {
        self.normals.prefilter()
    }

    fn trust(&self) -> Option<&'static Trust> {
        Some(&TRUST)
    }

    fn lean_limits_rad(&self) -> [f64; 2] {
        self.lean_limits_rad
    }

    /// How high what agrees and what is near stand, in units of 45 degrees.
    fn aspect(&self, pixels: &PixelTables, work: &Work) -> [f64; ASPECT] {
        let Inliers::Within { model, threshold } = work.inliers else { return [0.0; ASPECT] };
        let (model, stride) = (Vector3::from(model), (work.rows.len() / HEIGHTS).max(1));
        let (mut of_near, mut of_inliers) = ([0.0; 2], [0.0; 2]);
        for (row, slot) in work.slots.iter().enumerate().step_by(stride) {
            let height = f64::from(pixels.heights_deg.get(*slot as usize).copied().unwrap_or(0)) / 45.0;
            of_near = [of_near[0] + height, of_near[1] + 1.0];
            if work.rows.get(row).is_some_and(|row| row.dot(&model).abs() <= threshold) {
                of_inliers = [of_inliers[0] + height, of_inliers[1] + 1.0];
            }
        }
        let [inliers, near] = [of_inliers, of_near].map(|[sum, count]| sum / f64::max(count, 1.0));
        [inliers, near, 0.0, 0.0, 0.0]
    }

    fn normal(&self, slot: usize, gx: f32, gy: f32) -> Option<[f32; 3]> {
        self.normals.normal(slot, gx, gy)
    }

    fn fit(&self, edges: &EdgePixels, pixels: &PixelTables, work: &mut Work) -> Fit {
        self.normals.lift(edges, work);
        let lines = work.overhead;
        pixels.overhead.leave_out(&lines, pixels, work);
        self.refit(pixels, work)
    }

    fn leaves_out_overhead(&self) -> bool {
        true
    }

    fn refitter(&self) -> Option<&dyn Refitter> {
        Some(self)
    }
}

impl Refitter for Refined {
    fn refit(&self, pixels: &PixelTables, work: &mut Work) -> Fit {
        self.fit_rows(pixels, work).diluted(work.rows.len(), self.as_near)
    }
}

/// Scales of the soft gate within which a pixel is reported as an inlier: 95 % of a normal distribution.
const INLIER_SCALES: f64 = 2.0;

/// Rows of which the heights are looked at, or up to twice as many: their mean then errs by a degree or less.
const HEIGHTS: usize = 500;

/// Rounds in which the soft gate fades from one and a half scales to one.
const FADING: u32 = 2;

/// Most rounds of trimming: `N_E` of Fleer 2017, table 3.
const TRIMMING_ROUNDS: u32 = 15;

/// Trims from the upright prior until the residuals are no larger than half the final scale or nothing changes, on a sample
/// of the rows where there are many, then reweights all of them with a gate that fades to the final scale.
///
/// `weights` are those of the rows and are not altered; `subsample` is scratch.
pub(in crate::tilt) fn refine<T: Real>(
    rows: &Rows<T>,
    options: &RefineOptions,
    weights: &mut [f32],
    subsample: &mut Subsample<T>,
) -> FitReport<Vector3<f64>> {
    subsample.take(rows, weights);
    let trimming = RejectRefitOptions {
        keep_fraction: options.keep_fraction,
        max_iterations: TRIMMING_ROUNDS,
        tolerance: options.tolerance_rad,
        rms_min: 0.5 * options.scale_rad,
    };
    let start = reject_refit(&Direction::new(&subsample.rows), &trimming, &Vector3::z(), &mut subsample.weights);
    let Some(direction) = start.model else { return start };
    let fading = ReweightOptions {
        first_scale: 1.5 * options.scale_rad,
        last_scale: options.scale_rad,
        shrinking: FADING,
        max_iterations: options.max_iterations,
        tolerance: options.tolerance_rad,
    };
    reweight(&Direction::new(rows), &fading, &direction, weights)
}
