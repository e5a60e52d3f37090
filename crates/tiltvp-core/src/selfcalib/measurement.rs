//! The bearing of a landmark that is known by its direction and distance from a fixed point, with derivatives.

use nalgebra::{Vector2, Vector3};

/// Tangent up to which the series of the arcus tangent is as good as the function, to within 1e-12.
const SMALL: f64 = 0.1;

/// A landmark: `point = anchor + exp(-closeness) (cos direction, sin direction)`.
///
/// The anchor is a number, not an unknown: the place at which the camera was thought to be when it first saw the landmark.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Landmark {
    pub(super) anchor: Vector2<f64>,
    pub(super) direction: f64,
    /// The logarithm of the inverse distance, so that no landmark is behind the camera.
    pub(super) closeness: f64,
}

/// A predicted bearing and its derivatives by everything it depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prediction {
    pub(super) bearing: f64,
    /// By the robot's (x, y, heading).
    pub(super) by_pose: Vector3<f64>,
    /// By the mounting's (x, y, yaw).
    pub(super) by_mounting: Vector3<f64>,
    /// By the landmark's direction and closeness.
    pub(super) by_landmark: Vector2<f64>,
}

/// A landmark as predictions take it, for many of the same one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    anchor: Vector2<f64>,
    /// The unit vector of its direction.
    along: Vector2<f64>,
    /// The inverse of its distance.
    inverse: f64,
}

impl Landmark {
    pub(super) fn ray(&self) -> Ray {
        let (sin, cos) = self.direction.sin_cos();
        Ray { anchor: self.anchor, along: Vector2::new(cos, sin), inverse: self.closeness.exp() }
    }
}

/// Where the camera is and looks, for predictions of many landmarks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewpoint {
    /// From the robot to the camera.
    arm: Vector2<f64>,
    place: Vector2<f64>,
    /// Cosine and sine of the robot's heading.
    heading: (f64, f64),
    /// Heading and yaw, with cosine and sine.
    turn: f64,
    turned: (f64, f64),
}

impl Viewpoint {
    /// Of a camera at `mounting` on a robot at `pose`.
    pub(super) fn new(pose: &Vector3<f64>, mounting: &Vector3<f64>) -> Self {
        let (sin, cos) = pose.z.sin_cos();
        let arm = Vector2::new(cos * mounting.x - sin * mounting.y, sin * mounting.x + cos * mounting.y);
        let turn = pose.z + mounting.z;
        let (turn_sin, turn_cos) = turn.sin_cos();
        Self { arm, place: pose.xy() + arm, heading: (cos, sin), turn, turned: (turn_cos, turn_sin) }
    }

    /// What is seen of a landmark, eq. 16 in homogeneous coordinates:
    ///
    /// ```text
    /// w = exp(closeness) (anchor - camera) + (cos direction, sin direction),   bearing = atan2(w) - heading - yaw
    /// ```
    pub(super) fn see(&self, ray: &Ray) -> Prediction {
        let w = (ray.anchor - self.place) * ray.inverse + ray.along;
        Prediction { bearing: w.y.atan2(w.x) - self.turn, ..self.slopes(ray) }
    }

    /// The derivatives of what is seen of a landmark; the bearing itself is left out.
    pub(super) fn slopes(&self, ray: &Ray) -> Prediction {
        let (from_camera, q, u, (cos, sin)) = (ray.anchor - self.place, ray.inverse, ray.along, self.heading);
        let w = from_camera * q + u;
        let scale = 1.0 / w.norm_squared();
        let n = Vector2::new(-w.y, w.x) * scale;
        let by_arm = n * -q;
        Prediction {
            bearing: f64::NAN,
            by_pose: Vector3::new(by_arm.x, by_arm.y, by_arm.y * self.arm.x - by_arm.x * self.arm.y - 1.0),
            by_mounting: Vector3::new(cos * by_arm.x + sin * by_arm.y, cos * by_arm.y - sin * by_arm.x, -1.0),
            by_landmark: Vector2::new(w.dot(&u) * scale, q * n.dot(&from_camera)),
        }
    }

    /// By how much the bearing of a landmark is past one whose cosine and sine are given, in (-pi, pi].
    pub(super) fn past(&self, ray: &Ray, along: &Vector2<f64>) -> f64 {
        let w = (ray.anchor - self.place) * ray.inverse + ray.along;
        let (cos, sin) = self.turned;
        let there = Vector2::new(cos * along.x - sin * along.y, sin * along.x + cos * along.y);
        let (across, ahead) = (there.x * w.y - there.y * w.x, there.dot(&w));
        if across.abs() > SMALL * ahead {
            return across.atan2(ahead);
        }
        // The series of the arcus tangent.
        let (t, s) = (across / ahead, (across / ahead).powi(2));
        t * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s / 9.0))))
    }
}

/// What the camera at `mounting` on a robot at `pose` sees of a landmark.
pub(super) fn predict(pose: &Vector3<f64>, mounting: &Vector3<f64>, landmark: &Landmark) -> Prediction {
    Viewpoint::new(pose, mounting).see(&landmark.ray())
}

/// The landmark of that closeness to the anchor that is seen at this bearing; `None` if there is none.
pub(super) fn seen_at(
    anchor: Vector2<f64>,
    closeness: f64,
    pose: &Vector3<f64>,
    mounting: &Vector3<f64>,
    bearing: f64,
) -> Option<Landmark> {
    let (sin, cos) = (bearing + pose.z + mounting.z).sin_cos();
    let away = (anchor - camera(pose, mounting)) * closeness.exp();
    let along = cos * away.x + sin * away.y;
    let squared = along * along - away.norm_squared() + 1.0;
    let reach = along + (squared >= 0.0).then(|| squared.sqrt())?;
    let ray = Vector2::new(cos, sin) * reach - away;
    (reach > 0.0).then_some(Landmark { anchor, direction: ray.y.atan2(ray.x), closeness })
}

/// Where the camera is.
pub(super) fn camera(pose: &Vector3<f64>, mounting: &Vector3<f64>) -> Vector2<f64> {
    let (sin, cos) = pose.z.sin_cos();
    pose.xy() + Vector2::new(cos * mounting.x - sin * mounting.y, sin * mounting.x + cos * mounting.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::wrap_angle;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_landmark_is_seen_where_it_was_put(
            pose in prop::array::uniform3(-1.0..1.0f64), mounting in prop::array::uniform3(-1.0..1.0f64),
            closeness in -2.0..0.0f64, bearing in -3.0..3.0f64,
        ) {
            let (pose, mounting) = (Vector3::from(pose), Vector3::from(mounting));
            if let Some(landmark) = seen_at(Vector2::new(0.1, 0.2), closeness, &pose, &mounting, bearing) {
                let seen = predict(&pose, &mounting, &landmark).bearing;
                prop_assert!(wrap_angle(seen - bearing).abs() < 1e-9);
                for off in [0.0, 0.05, -0.0999, 0.3, -2.0] {
                    let (sin, cos) = (bearing + off).sin_cos();
                    let past = Viewpoint::new(&pose, &mounting).past(&landmark.ray(), &Vector2::new(cos, sin));
                    prop_assert!((past - wrap_angle(seen - bearing - off)).abs() < 1e-11);
                }
            }
        }

        #[test]
        fn derivatives_are_those_of_central_differences(
            pose in prop::array::uniform3(-1.0..1.0f64), mounting in prop::array::uniform3(-1.0..1.0f64),
            anchor in prop::array::uniform2(-1.0..1.0f64), direction in -4.0..4.0f64, closeness in -4.0..-1.4f64,
        ) {
            let x: Vec<f64> = pose.into_iter().chain(mounting).chain([direction, closeness]).collect();
            let at = |x: &[f64]| predict(
                &Vector3::new(x[0], x[1], x[2]), &Vector3::new(x[3], x[4], x[5]),
                &Landmark { anchor: anchor.into(), direction: x[6], closeness: x[7] },
            );
            let p = at(&x);
            let given: Vec<f64> = p.by_pose.iter().chain(&p.by_mounting).chain(&p.by_landmark).copied().collect();
            for i in 0..8 {
                let (mut more, mut less) = (x.clone(), x.clone());
                more[i] += 1e-6;
                less[i] -= 1e-6;
                let difference = wrap_angle(at(&more).bearing - at(&less).bearing) / 2e-6;
                prop_assert!((difference - given[i]).abs() < 1e-7, "{i}: {difference} {}", given[i]);
            }
        }
    }
}
