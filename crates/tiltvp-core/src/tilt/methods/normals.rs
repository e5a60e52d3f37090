//! What the methods on normals share: great circles of edge pixels, their prefilter, and the tilt of a common direction.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use nalgebra::{Matrix2, Vector2, Vector3};

use super::method::Setting;
use crate::edges::{EdgePixels, LiftTable, NormalKind, Prefilter};
use crate::geometry::Tilt;
use crate::robust::FitReport;
use crate::tilt::fit::{Evidence, Fit, Lean};
use crate::tilt::shared_tables::NormalTable;
use crate::tilt::tables::PixelTables;
use crate::tilt::trained::TrainedCorrection;
use crate::tilt::work::{Inliers, Work};

/// Normals of edge pixels whose great circles pass near the robot's vertical.
#[derive(Debug)]
pub(super) struct Normals {
    table: Arc<LiftTable>,
    prefilter: Option<Prefilter>,
    sin_max: f64,
}

impl Normals {
    /// The normals of a kind for edges of leans of up to `limit_rad`.
    pub(super) fn new(setting: &Setting<'_>, kind: NormalKind, limit_rad: f64) -> Self {
        let made = Self::without_prefilter(setting, kind, limit_rad);
        let shared = &shared(setting, kind).prefilter;
        let prefilter = shared.get_or_init(|| made.table.prefilter(made.sin_max)).with_limit(made.sin_max);
        Self { prefilter: Some(prefilter), ..made }
    }

    /// The same for edge pixels that others find.
    pub(super) fn without_prefilter(setting: &Setting<'_>, kind: NormalKind, limit_rad: f64) -> Self {
        let table = shared(setting, kind).maps.get_or_init(|| {
            let (camera, rotation) = (&setting.origin.camera, &setting.origin.robot_from_camera);
            Arc::new(LiftTable::new(camera, rotation, &setting.pixels.region, kind))
        });
        Self { table: Arc::clone(table), prefilter: None, sin_max: limit_rad.sin() }
    }

    pub(super) fn prefilter(&self) -> Option<&Prefilter> {
        self.prefilter.as_ref()
    }

    /// The unit normal of one edge pixel.
    pub(super) fn normal(&self, slot: usize, gx: f32, gy: f32) -> Option<[f32; 3]> {
        self.table.normal(slot, gx, gy)
    }

    /// Writes the rows of the edge pixels that pass the prefilter, with their gradients as weights.
    pub(super) fn lift(&self, edges: &EdgePixels, work: &mut Work) {
        let Work { rows, weights, slots, places, .. } = work;
        self.table.lift(edges, self.sin_max, rows, weights, slots, places);
    }
}

fn shared<'a>(setting: &Setting<'a>, kind: NormalKind) -> &'a NormalTable {
    let normals = &setting.pixels.shared.normals;
    match kind {
        NormalKind::Tangent => &normals.tangent,
        NormalKind::Gradient => &normals.gradient,
    }
}

/// The tilt of the direction that a fit has found among the rows, with what is known of its error.
pub(super) fn conclude(
    report: &FitReport<Vector3<f64>>,
    correction: &TrainedCorrection,
    evidence: &Evidence,
    pixels: &PixelTables,
    work: &mut Work,
) -> Fit {
    let raw = report.model.and_then(|normal| Tilt::from_normal(&normal));
    let corrected = correction.at(raw.map_or(0.0, |tilt| tilt.alpha_rad()));
    if raw.is_some() && corrected.alpha_rad >= FRAC_PI_2 {
        work.inliers = Inliers::None;
        return Fit::out_of_reach(corrected.alpha_rad, report);
    }
    let horizontal = raw.map_or(Vector2::zeros(), |tilt| tilt.normal().xy());
    let tilt = raw.map(|tilt| {
        if *correction == TrainedCorrection::IDENTITY {
            tilt
        } else {
            Tilt::from_alpha_beta(corrected.alpha_rad, tilt.beta_rad())
        }
    });
    let lean = Lean::new(correction, corrected, horizontal, Matrix2::identity());
    let model = report.model.unwrap_or_default().into();
    Fit {
        tilt,
        covariance: tilt.and_then(|tilt| evidence.covariance(model, &lean, &tilt, pixels, work)),
        inliers: match work.inliers {
            Inliers::Within { model, threshold } => work.rows.count_within(model, threshold),
            Inliers::None | Inliers::Weighted => report.inliers,
        },
        ..Fit::without_tilt(report)
    }
    .settled()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Equidistant};
    use crate::tilt::{TiltEstimator, TiltOptions};

    #[test]
    fn estimators_of_the_same_pixels_share_their_maps() {
        let lens = Equidistant::new(40.0, 79.5, 79.5).unwrap();
        let camera = Camera::new(160, 160, lens.into()).unwrap();
        let refined = TiltOptions::for_method("refined").unwrap();
        let first = TiltEstimator::new(camera, nalgebra::Matrix3::identity(), refined.clone()).unwrap();
        let normals = |estimator: &TiltEstimator, kind| {
            let setting = Setting {
                origin: &estimator.origin,
                pixels: &estimator.pixels,
                method: "any",
                tilt_max_rad: None,
                seed: 0,
            };
            Normals::new(&setting, kind, 0.2)
        };
        let mut other = TiltOptions::for_method("vector-consensus").unwrap();
        other.edges.smoothing_px = refined.edges.smoothing_px;
        let other = first.with_options(other).unwrap();
        for kind in [NormalKind::Tangent, NormalKind::Gradient] {
            assert!(Arc::ptr_eq(&normals(&first, kind).table, &normals(&other, kind).table));
        }
    }
}
