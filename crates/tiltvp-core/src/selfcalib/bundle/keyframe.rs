//! Keyframes: poses of the robot with the odometry that led there and the bearings taken there.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::selfcalib::model::{RelativeMotion, WheelMotion, information};

/// A bearing of a landmark, which is given by its place in the list of landmarks.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Observation {
    pub(crate) landmark: usize,
    pub(crate) bearing: f64,
    /// Cosine and sine of the bearing.
    pub(crate) along: Vector2<f64>,
}

impl Observation {
    pub(crate) fn new(landmark: usize, bearing: f64) -> Self {
        let (sin, cos) = bearing.sin_cos();
        Self { landmark, bearing, along: Vector2::new(cos, sin) }
    }
}

/// A pose of the robot at which bearings were taken, with the odometry since the keyframe before.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Keyframe {
    pub(crate) pose: Vector3<f64>,
    pub(crate) odometry: RelativeMotion,
    /// The inverse of the odometry's covariance.
    pub(crate) information: Matrix3<f64>,
    /// The readings that `odometry` was integrated from; kept only where the wheels are estimated.
    pub(crate) readings: Vec<WheelMotion>,
    /// Velocity on arrival in the frame of the robot there, for the time offset.
    pub(crate) velocity: Vector3<f64>,
    pub(crate) observations: Vec<Observation>,
}

impl Keyframe {
    /// The first keyframe, in whose frame the others are given.
    pub(crate) fn anchor() -> Self {
        Self {
            pose: Vector3::zeros(),
            odometry: RelativeMotion::none(),
            information: Matrix3::zeros(),
            readings: Vec::new(),
            velocity: Vector3::zeros(),
            observations: Vec::new(),
        }
    }

    /// A keyframe at the end of a motion.
    pub(crate) fn after(odometry: RelativeMotion, pose: Vector3<f64>) -> Self {
        Self { pose, odometry, information: information(&odometry.covariance), ..Self::anchor() }
    }

    /// Moves a keyframe without bearings on by another motion, to `pose`.
    pub(crate) fn extend(&mut self, odometry: &RelativeMotion, pose: Vector3<f64>) {
        self.odometry = self.odometry.then(odometry);
        self.information = information(&self.odometry.covariance);
        self.pose = pose;
    }
}
