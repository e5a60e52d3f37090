//! From pixels to edge elements to great circles.

mod detect;
mod extent;
mod grid_step;
mod lift;
mod options;
mod prefilter;
mod region;
mod ridge;
mod whole;

pub use detect::{Detector, EdgePixels};
pub(crate) use extent::Extent;
pub(crate) use grid_step::{StepMap, is_grid_step};
pub use lift::{LiftTable, NormalKind};
pub use options::{EdgeOptions, Mask};
pub use prefilter::Prefilter;
pub(crate) use region::surrounded;
pub use region::{Region, Span};
pub use ridge::{RidgeDetector, RidgePixels};
pub(crate) use whole::whole;
