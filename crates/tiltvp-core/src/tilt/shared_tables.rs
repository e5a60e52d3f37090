//! Tables that estimators of the same pixels share.

use std::sync::{Arc, OnceLock};

use super::correction::Gains;
use crate::edges::{LiftTable, Prefilter};

/// Tables that estimators of the same pixels share, whatever their methods; each is made when it is first asked for.
#[derive(Debug, Default)]
pub(super) struct SharedTables {
    pub normals: NormalTables,
    pub image_space: ImageSpaceTables,
}

/// The maps from gradients to normals and their prefilters, by the kind of normal.
#[derive(Debug, Default)]
pub(super) struct NormalTables {
    pub tangent: OnceLock<(Arc<LiftTable>, Prefilter)>,
    pub gradient: OnceLock<(Arc<LiftTable>, Prefilter)>,
}

/// The closed-form gains, and the prefilter of edge offsets.
#[derive(Debug, Default)]
pub(super) struct ImageSpaceTables {
    pub gains: OnceLock<Arc<Gains>>,
    pub prefilter: OnceLock<Prefilter>,
}
