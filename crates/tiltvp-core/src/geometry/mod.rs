//! Angles, bearings, rotations, great circles and tilts: the ground floor, which knows nothing of images.

mod bearing;
mod tilt;
mod wheels;

pub use bearing::{angle_between, tangent_basis};
pub use tilt::Tilt;
pub use wheels::WheelLayout;
