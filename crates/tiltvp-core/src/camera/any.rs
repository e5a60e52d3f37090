//! The closed list of camera models.

use super::double_sphere::DoubleSphere;
use super::equidistant::Equidistant;
use super::equirectangular::Equirectangular;
use super::extended_unified::ExtendedUnified;
use super::kannala_brandt::KannalaBrandt;
use super::model::CameraModel;
use super::ocam::Ocam;
use super::pinhole::Pinhole;
use super::radial_polynomial::RadialPolynomial;
use super::unified::Unified;

/// Any of the central models, dispatched once per batch.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Model {
    /// `r = tan theta`, with radial and tangential distortion.
    Pinhole(Pinhole),
    /// `r = theta (1 + k1 theta^2 + ..)`.
    KannalaBrandt(KannalaBrandt),
    /// Scaramuzza's polynomial `f(rho)`.
    Ocam(Ocam),
    /// Mei's unit sphere with distortion.
    Unified(Unified),
    /// The ellipsoid of two parameters.
    ExtendedUnified(ExtendedUnified),
    /// Two spheres.
    DoubleSphere(DoubleSphere),
    /// `r = f theta`.
    Equidistant(Equidistant),
    /// Longitude and latitude.
    Equirectangular(Equirectangular),
    /// `rho = k1 theta + k2 theta^2 + ..` in pixels.
    RadialPolynomial(RadialPolynomial),
}

/// Runs an expression with the concrete model behind a [`Model`], compiled once for each.
macro_rules! with_model {
    ($any:expr, $model:ident => $body:expr) => {
        match $any {
            $crate::camera::Model::Pinhole($model) => $body,
            $crate::camera::Model::KannalaBrandt($model) => $body,
            $crate::camera::Model::Ocam($model) => $body,
            $crate::camera::Model::Unified($model) => $body,
            $crate::camera::Model::ExtendedUnified($model) => $body,
            $crate::camera::Model::DoubleSphere($model) => $body,
            $crate::camera::Model::Equidistant($model) => $body,
            $crate::camera::Model::Equirectangular($model) => $body,
            $crate::camera::Model::RadialPolynomial($model) => $body,
        }
    };
}
pub(super) use with_model;

impl Model {
    /// The model as the one trait.
    pub fn as_dyn(&self) -> &dyn CameraModel {
        with_model!(self, model => model)
    }
}

macro_rules! from_model {
    ($($name:ident),*) => {
        $(impl From<$name> for Model {
            fn from(model: $name) -> Self {
                Self::$name(model)
            }
        })*
    };
}
from_model!(
    Pinhole,
    KannalaBrandt,
    Ocam,
    Unified,
    ExtendedUnified,
    DoubleSphere,
    Equidistant,
    Equirectangular,
    RadialPolynomial
);
