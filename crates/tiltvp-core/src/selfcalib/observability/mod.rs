//! What can be known of the mounting: from a motion, from a drive so far, and at best from a simulated drive.

mod bound;
mod determined;
mod rank;

pub use self::bound::cramer_rao_bound;
pub use self::determined::Observability;
pub use self::rank::{FeatureRange, PureMotion, observable_dimension};
