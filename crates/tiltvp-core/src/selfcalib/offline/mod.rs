//! The mounting from a whole log: bundle adjustment over everything.

mod incremental;
mod log;
mod whole_log;

pub use self::log::{LogBearing, LogOptions};
pub use self::whole_log::{LogCalibration, calibrate_log};
