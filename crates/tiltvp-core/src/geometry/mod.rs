//! Angles, bearings, rotations, great circles and tilts: the ground floor, which knows nothing of images.

mod bearing;
mod rotation;
mod tilt;
mod wheels;

pub use bearing::{angle_between, tangent_basis, tangent_exp, tangent_log, tangent_transport};
pub use rotation::validate_rotation;
pub use tilt::Tilt;
pub use wheels::WheelLayout;
