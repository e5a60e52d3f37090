//! Central camera models: pixels to unit bearings and back, past 90 degrees where the lens is.

mod any;
mod calibrated;
mod equidistant;
mod model;
mod radial;

pub use any::Model;
pub use calibrated::Camera;
pub use equidistant::Equidistant;
pub use model::CameraModel;
