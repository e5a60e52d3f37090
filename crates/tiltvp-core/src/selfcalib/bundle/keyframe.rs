//! Keyframes: poses of the robot with the odometry that led there and the bearings taken there.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::selfcalib::model::{RelativeMotion, WheelMotion, along_arc, information};

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

    /// This bearing as it would be about the true image centre, of which the one it was taken about is off by so many radii.
    pub(crate) fn about(&self, off: &Vector2<f64>) -> Self {
        if *off == Vector2::zeros() {
            *self
        } else {
            Self::new(self.landmark, self.bearing - off.dot(&self.by_centre()))
        }
    }

    /// The derivative of the bearing by the image centre, in radii.
    pub(crate) fn by_centre(&self) -> Vector2<f64> {
        Vector2::new(self.along.y, -self.along.x)
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
    /// The time since the keyframe before, for the time offset.
    pub(crate) seconds: f64,
    /// By how much the wheels' velocities on departure from the keyframe before and on arrival are off the mean one; zero where one reading
    /// led here.
    pub(crate) unevenness: [Vector3<f64>; 2],
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
            seconds: 0.0,
            unevenness: [Vector3::zeros(); 2],
            observations: Vec::new(),
        }
    }

    /// A keyframe at the end of a motion that took so long.
    pub(crate) fn after(odometry: RelativeMotion, pose: Vector3<f64>, seconds: f64) -> Self {
        Self { pose, odometry, information: information(&odometry.covariance), seconds, ..Self::anchor() }
    }

    /// Moves a keyframe without bearings on by another motion, to `pose`.
    pub(crate) fn extend(&mut self, odometry: &RelativeMotion, pose: Vector3<f64>, seconds: f64) {
        let departure = self.mean_velocity() + self.unevenness[0];
        let arrival = per_second(&along_arc(&odometry.motion).0, seconds);
        self.odometry = self.odometry.then(odometry);
        self.information = information(&self.odometry.covariance);
        self.seconds += seconds;
        self.pose = pose;
        self.unevenness = [departure, arrival].map(|velocity| velocity - self.mean_velocity());
    }

    /// The mean velocity since the keyframe before in the frame of the robot, as the wheels measured it.
    pub(crate) fn mean_velocity(&self) -> Vector3<f64> {
        per_second(&along_arc(&self.odometry.motion).0, self.seconds)
    }
}

/// A velocity; zero where no time passes.
pub(crate) fn per_second(along: &Vector3<f64>, seconds: f64) -> Vector3<f64> {
    if seconds > 0.0 { along / seconds } else { Vector3::zeros() }
}
