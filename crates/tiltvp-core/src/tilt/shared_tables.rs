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

/// By the kind of normal.
#[derive(Debug, Default)]
pub(super) struct NormalTables {
    pub tangent: NormalTable,
    pub gradient: NormalTable,
}

/// The maps from gradients to normals, and their prefilter.
#[derive(Debug, Default)]
pub(super) struct NormalTable {
    pub maps: OnceLock<Arc<LiftTable>>,
    pub prefilter: OnceLock<Prefilter>,
}

/// The closed-form gains, and the prefilter of edge offsets.
#[derive(Debug, Default)]
pub(super) struct ImageSpaceTables {
    pub gains: OnceLock<Arc<Gains>>,
    pub prefilter: OnceLock<Prefilter>,
}
