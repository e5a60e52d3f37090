//! From pixels to edge elements to great circles.

mod block;
mod detect;
mod lift;
mod options;
mod region;
mod ridge;
mod screen;
mod sieve;
#[cfg(target_arch = "x86_64")]
mod sieve_avx512;
mod sieve_portable;
#[cfg(target_arch = "x86_64")]
mod slopes_avx512;
mod thinning;

pub use detect::{Detector, EdgePixels};
pub use lift::{LiftTable, NormalKind};
pub use options::{EdgeOptions, Mask};
pub use region::{Region, Span};
pub use ridge::{RidgeDetector, RidgePixels};
pub use screen::Screen;
