//! What an estimator looks up: made once, and shared by the estimators for which it is the same.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use nalgebra::Vector3;

use super::confidence::SECTORS;
use super::correction::{Correction, Gains, VanishingPoint, closed_form_gains};
use super::image_edges::EdgeOrigin;
use super::options::{Method, TiltOptions, offset_max_px_of};
use super::trained::TrainedCorrection;
use crate::edges::{LiftTable, NormalKind, Region, Screen};
use crate::error::{Error, Result};

/// Least cosine of the angle between the optical axis and the vertical for the image-space methods.
const AXIS_COSINE_MIN: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The pixels that are looked at, and what is known of each whatever the method.
#[derive(Debug)]
pub(super) struct Sight {
    pub region: Region,
    /// Sector of azimuth of each pixel.
    pub sectors: Vec<u8>,
    /// Where the vertical of the upright robot is seen.
    pub centre: Option<VanishingPoint>,
}

impl Sight {
    pub(super) fn new(origin: &EdgeOrigin) -> Result<Self> {
        let EdgeOrigin { camera, robot_from_camera, options, mask, row_stride } = origin;
        let region = Region::new(camera, robot_from_camera, options, mask.as_ref())?.every_row(*row_stride)?;
        let sector = |bearing: Vector3<f64>| -> u8 {
            let turn = bearing.y.atan2(bearing.x) / std::f64::consts::TAU + 0.5;
            ((turn * SECTORS as f64) as usize).min(SECTORS - 1) as u8
        };
        let sectors = region.pixels().map(|(_, _, bearing)| sector(bearing)).collect();
        Ok(Self { region, sectors, centre: VanishingPoint::new(camera, robot_from_camera) })
    }
}

/// What the methods look up for each pixel of the region.
#[derive(Debug, Clone)]
pub(super) enum Tables {
    /// Relative closed-form gains (none for a trained correction), and the way from shift to angle.
    Offsets { gains: Arc<Gains>, correction: TrainedCorrection, offset_max_px: f64 },
    /// Maps from gradients to normals.
    Normals(Arc<LiftTable>),
}

impl Tables {
    /// The tables of a method and their screen; `like` are those of an estimator with the same sight.
    pub(super) fn new(
        origin: &EdgeOrigin,
        options: &TiltOptions,
        sight: &Sight,
        like: Option<(&Method, &Self, &Screen)>,
    ) -> Result<(Self, Screen)> {
        let kind = |method: &Method| match method {
            Method::VectorConsensus { normal, .. } => Some(*normal),
            Method::Refined(_) => Some(NormalKind::Tangent),
            Method::ImageSpaceRansac { .. } | Method::ImageSpaceRejectRefit { .. } => None,
        };
        if let Some(normal) = kind(&options.method) {
            let sin_max = options.normal_tilt_max_rad().sin();
            return Ok(match like {
                Some((method, Self::Normals(table), screen)) if kind(method) == Some(normal) => {
                    (Self::Normals(Arc::clone(table)), screen.with_limit(sin_max))
                }
                _ => {
                    let table = LiftTable::new(&origin.camera, &origin.robot_from_camera, &sight.region, normal);
                    let screen = table.screen(sin_max);
                    (Self::Normals(Arc::new(table)), screen)
                }
            });
        }
        let (Some(centre), Some((correction, offset_max_px))) = (&sight.centre, options.method.offsets()) else {
            return Err(Error::option(
                "method",
                options.method.name(),
                "a camera that can see the zenith or the nadir; use \"refined\" for others",
            ));
        };
        let axis_cosine = origin.robot_from_camera[(2, 2)].abs();
        if axis_cosine < AXIS_COSINE_MIN {
            return Err(Error::option(
                "method",
                options.method.name(),
                "a camera whose optical axis is within 45 degrees of the vertical: these methods take a lean for a shift \
                 of the image; use \"refined\" for others",
            ));
        }
        let gains = match (correction, like) {
            (Correction::ClosedForm, Some((_, Self::Offsets { gains, .. }, _))) if !gains.relative.is_empty() => {
                Arc::clone(gains)
            }
            (Correction::ClosedForm, _) => {
                Arc::new(closed_form_gains(&origin.camera, &origin.robot_from_camera, &sight.region, centre))
            }
            _ => Arc::new(Gains { relative: Vec::new(), mean: centre.scale }),
        };
        let correction = match correction {
            Correction::Trained(trained) => trained.clone(),
            Correction::None | Correction::ClosedForm => TrainedCorrection::Factor(gains.mean),
        };
        let own_max_px = offset_max_px.unwrap_or_else(|| offset_max_px_of(centre.scale));
        let offset_max_px = options.tilt_max_rad.map_or(own_max_px, |tilt| correction.shift_of(tilt));
        if correction.apply(offset_max_px) >= FRAC_PI_2 {
            return Err(if options.method.offsets().is_some_and(|(_, given)| given.is_some()) {
                Error::option(
                    "offset_max_px",
                    offset_max_px,
                    "fewer pixels: an offset that the correction makes a lean below pi/2 (the paper's 40 are for 139.7 \
                     pixels per radian; without a number it follows the lens)",
                )
            } else {
                Error::option(
                    "correction",
                    correction.factor(),
                    "a factor with which the largest offset is a lean below pi/2; the raw shift is shift_px of the \
                     estimate",
                )
            });
        }
        let screen = match like {
            Some((_, Self::Offsets { .. }, screen)) => screen.with_limit(offset_max_px),
            _ => Screen::of_offsets(&sight.region, (centre.pixel.x, centre.pixel.y), offset_max_px),
        };
        Ok((Self::Offsets { gains, correction, offset_max_px }, screen))
    }
}
