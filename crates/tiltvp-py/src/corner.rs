//! `CornerDetector`, `CornerFeature`: the core's corners over arrays.

mod detector;
mod feature;
mod options;

pub(crate) use self::detector::CornerDetector;
pub(crate) use self::feature::CornerFeature;
