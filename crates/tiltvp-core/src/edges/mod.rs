//! From pixels to edge elements to great circles.

mod detect;
mod lift;
mod options;
mod region;

pub use detect::{Detector, EdgePixels};
pub use lift::{LiftTable, NormalKind};
pub use options::{EdgeOptions, Mask};
pub use region::{Region, Span};
