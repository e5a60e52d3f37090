//! Corners over arrays: features, attitudes and poses, and what finds them in images.

mod attitude;
mod detector;
mod estimate;
mod estimator;
mod feature;
mod memory;
mod pose;
mod prior;
mod resolved;
mod solve;

pub(crate) use self::attitude::{CornerAttitude, CornerAttitudes};
pub(crate) use self::detector::CornerDetector;
pub(crate) use self::estimate::{BelievedCorner, CornerEstimate, CornerHypothesis};
pub(crate) use self::estimator::CornerPoseEstimator;
pub(crate) use self::feature::CornerFeature;
pub(crate) use self::pose::CornerPose;
pub(crate) use self::resolved::ResolvedAttitude;
pub(crate) use self::solve::{
    corner_attitudes, corner_poses, fit_corner, included_angle, resolve_corners, screen_corner, solve_corner,
    solve_corners, triangulate,
};
