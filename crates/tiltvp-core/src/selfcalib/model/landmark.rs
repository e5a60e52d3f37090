//! A landmark by direction and inverse distance from an anchor (Civera, Davison and Montiel 2008), in the plane.

use nalgebra::{Vector2, Vector3};

/// The most landmarks of a log, and that a filter follows. The normal equations of 4,000 take 512 MB; drives of an hour indoors have
/// some hundred.
pub const MOST_LANDMARKS: usize = 4_000;

/// A landmark: `point = anchor + exp(-log_inverse_distance) (cos direction, sin direction)`.
///
/// The anchor is a fixed number, not an unknown: the estimated place of the camera at its first observation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct InverseDistanceLandmark {
    pub(crate) anchor: Vector2<f64>,
    pub(crate) direction: f64,
    /// The logarithm of the inverse distance. The inverse distance itself could turn negative: behind the camera.
    pub(crate) log_inverse_distance: f64,
}

/// The same landmark in homogeneous coordinates, as predictions use it: `point = anchor + along / inverse_distance`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HomogeneousLandmark {
    pub(crate) anchor: Vector2<f64>,
    /// The unit vector of its direction.
    pub(crate) along: Vector2<f64>,
    pub(crate) inverse_distance: f64,
}

impl InverseDistanceLandmark {
    pub(crate) fn homogeneous(&self) -> HomogeneousLandmark {
        let (sin, cos) = self.direction.sin_cos();
        HomogeneousLandmark {
            anchor: self.anchor,
            along: Vector2::new(cos, sin),
            inverse_distance: self.log_inverse_distance.exp(),
        }
    }
}

/// The landmark with this anchor and inverse distance that is seen at a bearing; `None` if there is none.
pub(crate) fn landmark_from_bearing(
    anchor: Vector2<f64>,
    log_inverse_distance: f64,
    pose: &Vector3<f64>,
    mounting: &Vector3<f64>,
    bearing: f64,
) -> Option<InverseDistanceLandmark> {
    let (sin, cos) = (bearing + pose.z + mounting.z).sin_cos();
    let away = (anchor - camera_position(pose, mounting)) * log_inverse_distance.exp();
    let along = cos * away.x + sin * away.y;
    let squared = along * along - away.norm_squared() + 1.0;
    let reach = along + (squared >= 0.0).then(|| squared.sqrt())?;
    let ray = Vector2::new(cos, sin) * reach - away;
    let direction = ray.y.atan2(ray.x);
    (reach > 0.0).then_some(InverseDistanceLandmark { anchor, direction, log_inverse_distance })
}

/// Where the camera at `mounting` is when the robot is at `pose`.
pub(crate) fn camera_position(pose: &Vector3<f64>, mounting: &Vector3<f64>) -> Vector2<f64> {
    let (sin, cos) = pose.z.sin_cos();
    pose.xy() + Vector2::new(cos * mounting.x - sin * mounting.y, sin * mounting.x + cos * mounting.y)
}
