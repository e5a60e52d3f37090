//! From pixels to edge elements to great circles.

mod detect;
mod lift;
mod options;
mod region;
mod screen;

pub use detect::{Detector, EdgePixels};
pub use lift::{LiftTable, NormalKind};
pub use options::{EdgeOptions, Mask};
pub use region::{Region, Span};
pub use screen::Screen;
