//! The measurement models: where the camera is mounted, how the robot moves, which bearings a landmark has, how errors count.

mod bearing;
mod landmark;
mod loss;
pub(super) mod mounting;
pub(super) mod odometry;
mod planar_pose;

pub(super) use self::bearing::{Prediction, Viewpoint, predict};
pub use self::landmark::MOST_LANDMARKS;
pub(super) use self::landmark::{HomogeneousLandmark, InverseDistanceLandmark, camera_position, landmark_from_bearing};
pub(super) use self::loss::{BearingLoss, FitSummary, MotionLoss, OUTLIER_SIGMAS};
pub use self::mounting::Mounting;
pub use self::odometry::{MotionNoise, RelativeMotion, WHEEL_BASE_MAX_M, WheelMotion, Wheels};
pub(super) use self::odometry::{information, preintegrate};
pub(super) use self::planar_pose::{along_arc, arc, between, between_jacobians, compose, compose_jacobians};
