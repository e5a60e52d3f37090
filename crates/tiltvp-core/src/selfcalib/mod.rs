//! Where a camera sits on a robot, from odometry and bearings of landmarks, found while the robot drives.
//!
//! The problem is that of section 7 of [Scaramuzza, Siegwart and Martinelli 2009]; equation numbers are those of the paper.
//!
//! [Scaramuzza, Siegwart and Martinelli 2009]: https://doi.org/10.1177/0278364908099858

mod bundle;
mod calibrator;
mod diagnosis;
mod estimate;
#[cfg(feature = "serde")]
mod matrix_state;
mod model;
mod observability;
mod offline;
mod options;
mod paper;
mod step_outcome;
mod window;

pub use self::calibrator::{CalibrationStep, SelfCalibrator};
pub use self::diagnosis::{Cause, Contradictions, Suspect};
pub use self::estimate::MountingEstimate;
pub use self::model::{MOST_LANDMARKS, MotionNoise, Mounting, RelativeMotion, WHEEL_BASE_MAX_M, WheelMotion, Wheels};
pub use self::observability::{FeatureRange, Observability, PureMotion, cramer_rao_bound, observable_dimension};
pub use self::offline::{LogBearing, LogCalibration, LogOptions, Misreading, calibrate_log};
pub use self::options::{CalibrationMethod, SelfCalibratorOptions, StartSigma};
pub use self::paper::{Feature, dynamics, dynamics_jacobians, observation, observation_jacobians};

// Paths of `options.rs`.
use self::model::{mounting, odometry};
