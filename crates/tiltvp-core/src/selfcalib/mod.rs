//! Where a camera sits on a robot, from odometry and bearings of landmarks, found while the robot drives.
//!
//! The problem is that of section 7 of [Scaramuzza, Siegwart and Martinelli 2009]; equation numbers are those of the paper.
//!
//! [Scaramuzza, Siegwart and Martinelli 2009]: https://doi.org/10.1177/0278364908099858

mod alarm;
mod bound;
mod calibrator;
mod clustered;
mod dense;
mod descent;
mod graph;
mod growing;
mod log;
mod loss;
mod measurement;
mod memory;
mod mounting;
mod observability;
mod odometry;
mod offline;
mod options;
mod outcome;
mod paper;
mod pose_block;
mod recursive;
mod rows;
mod schur;
mod spread;
mod step;
mod update;

pub use self::bound::cramer_rao_bound;
pub use self::calibrator::{CalibrationStep, MountingEstimate, SelfCalibrator};
pub use self::log::{LogBearing, LogOptions};
pub use self::mounting::Mounting;
pub use self::observability::{FeatureRange, Observability, PureMotion, observable_dimension};
pub use self::odometry::{Leg, MotionNoise, WheelMotion, Wheels};
pub use self::offline::{LogCalibration, calibrate_log};
pub use self::options::{CALIBRATION_METHODS, CalibrationMethod, SelfCalibratorOptions};
pub use self::paper::{Feature, dynamics, dynamics_jacobians, observation, observation_jacobians};
