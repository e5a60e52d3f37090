//! The closed list of camera models.

use super::equidistant::Equidistant;
use super::model::CameraModel;

/// Any of the central models, dispatched once per batch.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Model {
    /// `r = f theta`.
    Equidistant(Equidistant),
}

impl Model {
    /// The model as the one trait.
    pub fn as_dyn(&self) -> &dyn CameraModel {
        match self {
            Self::Equidistant(model) => model,
        }
    }
}
