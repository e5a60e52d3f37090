//! Angles, bearings, rotations, great circles and tilts: the ground floor, which knows nothing of images.

mod angle;
mod bearing;
mod great_circle;
mod rigid;
mod rotation;
mod tilt;
mod wheels;

pub use angle::wrap_angle;
pub(crate) use bearing::squarable;
pub use bearing::{angle_between, tangent_basis, tangent_exp, tangent_log, tangent_transport, unit};
pub(crate) use great_circle::meeting;
pub use great_circle::{GreatCircleFit, fit_great_circle};
pub use rigid::RigidMotion;
pub(crate) use rotation::check_rotation;
pub use rotation::validate_rotation;
pub use tilt::Tilt;
pub use wheels::WheelLayout;
