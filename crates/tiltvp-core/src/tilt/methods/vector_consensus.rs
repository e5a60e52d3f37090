//! Vector consensus: the common direction of great circles by random sampling (Fleer 2017, section 2.2).

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use nalgebra::Vector3;

use super::method::{Fitter, Prepared, Setting, TiltMethod};
use super::normals::{self, Normals};
use crate::edges::{EdgeOptions, EdgePixels, NormalKind, Prefilter};
use crate::error::Result;
use crate::options;
use crate::options::{Between, Kind, OptionValue, POSITIVE, Value};
use crate::robust::{Direction, RansacOptions, Sampling, ransac};
use crate::tilt::fit::{Evidence, Fit, STRAY_RAD};
use crate::tilt::tables::PixelTables;
use crate::tilt::trained::TrainedCorrection;
use crate::tilt::trust::{Logit, Trust};
use crate::tilt::work::{Inliers, Work};

options! {
    /// Options of the vector-consensus method; defaults are those of Fleer 2017, table 3.
    pub struct VectorConsensusOptions {
        /// Largest angle in radians between an inlier's great circle and the vertical, `delta_o,max` of eq. 40.
        threshold_rad: f64 = 5f64.to_radians() => Between(0.0, FRAC_PI_2), "an angle strictly between 0 and pi/2";
        /// How normals are made: `"gradient"` as Fleer 2017 does, `"tangent"` exactly.
        normal: NormalKind = NormalKind::Gradient;
        /// From the raw angle to the angle: the factor `a'` of eq. 45, a line, a posterior, or none.
        correction: TrainedCorrection = TrainedCorrection::IDENTITY
            => POSITIVE, "None, a positive factor, an AffineCorrection or a PosteriorCorrection";
        /// How samples are drawn, improved and scored.
        [flat] sampling: Sampling = Sampling::default();
    }
    check correction_is_valid
}

fn correction_is_valid(options: &VectorConsensusOptions) -> Result<()> {
    options.correction.validate()
}

impl OptionValue for NormalKind {
    const KIND: Kind = Kind::Word(&["gradient", "tangent"]);

    fn to_value(&self) -> Value {
        Value::Text(if *self == Self::Gradient { "gradient" } else { "tangent" }.to_owned())
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(word) if word == "gradient" => Some(Self::Gradient),
            Value::Text(word) if word == "tangent" => Some(Self::Tangent),
            _ => None,
        }
    }
}

/// Largest lean without `tilt_max_rad`: `alpha_max` of Fleer 2017, section 2.2.2.
const TILT_MAX_RAD: f64 = 7f64.to_radians();

/// How a fit tells whether it is of the vertical: `tiltvp measure trust --weights` prints it.
static TRUST: Trust = Trust {
    vertical: Logit { constant: 1.049, weights: [-1.455, -0.4428, 4.54, -3.762, -1.19, 0.6169, -0.7533, 0.0] },
    up: None,
};

impl TiltMethod for VectorConsensusOptions {
    fn edges(&self) -> EdgeOptions {
        EdgeOptions { gradient_min: 600.0, ..EdgeOptions::default() }
    }

    fn prepare(&self, setting: &Setting<'_>) -> Result<Prepared> {
        Ok(Prepared::Pixels(Arc::new(VectorConsensus {
            normals: Normals::new(setting, self.normal, setting.searched_rad(TILT_MAX_RAD)),
            plane: setting.origin.robot_from_camera * Vector3::new(1.0, 1.0, 1.0),
            ransac: RansacOptions {
                seed: setting.seed,
                sampling: self.sampling,
                ..RansacOptions::with_threshold(self.threshold_rad.sin())
            },
            correction: self.correction.clone(),
            evidence: Evidence {
                scale: STRAY_RAD,
                weighted: false,
                approximate: self.normal == NormalKind::Gradient && !self.correction.tells_its_error(),
            },
        })))
    }
}

/// The method ready for images.
#[derive(Debug)]
struct VectorConsensus {
    normals: Normals,
    /// `(1, 1, 1)` of the camera frame in the robot frame.
    plane: Vector3<f64>,
    ransac: RansacOptions,
    correction: TrainedCorrection,
    evidence: Evidence,
}

impl Fitter for VectorConsensus {
    fn prefilter(&self) -> Option<&Prefilter> {
        self.normals.prefilter()
    }

    fn trust(&self) -> Option<&'static Trust> {
        Some(&TRUST)
    }

    fn normal(&self, slot: usize, gx: f32, gy: f32) -> Option<[f32; 3]> {
        self.normals.normal(slot, gx, gy)
    }

    /// Eqs. 36 to 41: samples pairs of normals, then solves `m . o = 0` over the consensus set with `(1, 1, 1) . o_camera = 1`
    /// added.
    fn fit(&self, edges: &EdgePixels, pixels: &PixelTables, work: &mut Work) -> Fit {
        self.normals.lift(edges, work);
        let Work { rows, weights, places, sampling, inliers, .. } = &mut *work;
        sampling.prepare(&self.ransac.sampling, edges, places, weights.capacity());
        weights.fill(1.0);
        let problem = Direction::with_plane(rows, self.plane).with_quality(&sampling.quality);
        let report = ransac(&problem, &self.ransac, weights, &mut sampling.ransac);
        *inliers = Inliers::weighted_if(report.model.is_some());
        normals::conclude(&report, &self.correction, &self.evidence, pixels, work)
    }
}
