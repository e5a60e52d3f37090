//! `CornerDetector`, `CornerPoseEstimator` and their values: the core's corners over arrays.

mod detector;
mod estimate;
mod estimator;
mod feature;
mod options;

pub(crate) use self::detector::CornerDetector;
pub(crate) use self::estimate::{CornerEstimate, CornerHypothesis};
pub(crate) use self::estimator::CornerPoseEstimator;
pub(crate) use self::feature::CornerFeature;
