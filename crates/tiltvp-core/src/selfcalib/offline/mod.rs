//! The mounting from a whole log: bundle adjustment over everything.

mod attempts;
mod descent;
mod incremental;
mod log;
mod merged_landmarks;
mod misreading;
mod noise;
mod triangulation;
mod whole_log;

pub use self::log::{LogBearing, LogOptions};
pub use self::misreading::Misreading;
pub use self::whole_log::{LogCalibration, calibrate_log};
