//! From pixels to edge elements to great circles.

mod detect;
mod lift;
mod options;
mod region;
mod ridge;
mod screen;

pub use detect::{Detector, EdgePixels};
pub use lift::{LiftTable, NormalKind};
pub use options::{EdgeOptions, Mask};
pub use region::{Region, Span};
pub use ridge::{RidgeDetector, RidgePixels};
pub use screen::Screen;
