//! The bearing of a landmark, eq. 16 of Scaramuzza, Siegwart and Martinelli (2009), with its Jacobians.

use nalgebra::{Vector2, Vector3};

use super::landmark::{HomogeneousLandmark, InverseDistanceLandmark};

/// Tangent up to which five terms of the series of the arc tangent are used: the first term left out is below
/// `0.1^11 / 11 < 1e-12`. `a_landmark_is_seen_where_it_was_put` compares both sides of it.
const SERIES_TANGENT: f64 = 0.1;

/// A predicted bearing and its derivatives by everything it depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prediction {
    pub(crate) bearing: f64,
    /// By the robot's (x, y, heading).
    pub(crate) by_pose: Vector3<f64>,
    /// By the mounting's (x, y, yaw).
    pub(crate) by_mounting: Vector3<f64>,
    /// By the landmark's direction and the logarithm of its inverse distance.
    pub(crate) by_landmark: Vector2<f64>,
}

/// The place and direction of the camera, computed once for the predictions of many landmarks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Viewpoint {
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
    pub(crate) fn new(pose: &Vector3<f64>, mounting: &Vector3<f64>) -> Self {
        let (sin, cos) = pose.z.sin_cos();
        let arm = Vector2::new(cos * mounting.x - sin * mounting.y, sin * mounting.x + cos * mounting.y);
        let turn = pose.z + mounting.z;
        let (turn_sin, turn_cos) = turn.sin_cos();
        Self { arm, place: pose.xy() + arm, heading: (cos, sin), turn, turned: (turn_cos, turn_sin) }
    }

    /// The bearing of a landmark with its Jacobians, eq. 16 in homogeneous coordinates:
    ///
    /// ```text
    /// w = inverse_distance (anchor - camera) + (cos direction, sin direction),   bearing = atan2(w) - heading - yaw
    /// ```
    pub(crate) fn predict(&self, point: &HomogeneousLandmark) -> Prediction {
        let w = (point.anchor - self.place) * point.inverse_distance + point.along;
        Prediction { bearing: w.y.atan2(w.x) - self.turn, ..self.jacobians(point) }
    }

    /// The Jacobians of the bearing of a landmark, without the bearing itself, which is NaN.
    pub(crate) fn jacobians(&self, point: &HomogeneousLandmark) -> Prediction {
        let (from_camera, q, u, (cos, sin)) =
            (point.anchor - self.place, point.inverse_distance, point.along, self.heading);
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

    /// The predicted bearing of a landmark minus a measured one, given as (cosine, sine), in (-pi, pi].
    pub(crate) fn residual(&self, point: &HomogeneousLandmark, along: &Vector2<f64>) -> f64 {
        let w = (point.anchor - self.place) * point.inverse_distance + point.along;
        let (cos, sin) = self.turned;
        let there = Vector2::new(cos * along.x - sin * along.y, sin * along.x + cos * along.y);
        let (across, ahead) = (there.x * w.y - there.y * w.x, there.dot(&w));
        if across.abs() > SERIES_TANGENT * ahead {
            return across.atan2(ahead);
        }
        let (t, s) = (across / ahead, (across / ahead).powi(2));
        t * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s / 9.0))))
    }
}

/// The bearing of a landmark for a camera at `mounting` on a robot at `pose`.
pub(crate) fn predict(pose: &Vector3<f64>, mounting: &Vector3<f64>, landmark: &InverseDistanceLandmark) -> Prediction {
    Viewpoint::new(pose, mounting).predict(&landmark.homogeneous())
}

#[cfg(test)]
mod tests {
    use super::super::landmark::landmark_from_bearing;
    use super::*;
    use crate::geometry::wrap_angle;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_landmark_is_seen_where_it_was_put(
            pose in prop::array::uniform3(-1.0..1.0f64), mounting in prop::array::uniform3(-1.0..1.0f64),
            log_inverse_distance in -2.0..0.0f64, bearing in -3.0..3.0f64,
        ) {
            let (pose, mounting) = (Vector3::from(pose), Vector3::from(mounting));
            if let Some(landmark) = landmark_from_bearing(Vector2::new(0.1, 0.2), log_inverse_distance, &pose, &mounting, bearing) {
                let seen = predict(&pose, &mounting, &landmark).bearing;
                prop_assert!(wrap_angle(seen - bearing).abs() < 1e-9);
                for off in [0.0, 0.05, -0.0999, 0.3, -2.0] {
                    let (sin, cos) = (bearing + off).sin_cos();
                    let residual = Viewpoint::new(&pose, &mounting).residual(&landmark.homogeneous(), &Vector2::new(cos, sin));
                    prop_assert!((residual - wrap_angle(seen - bearing - off)).abs() < 1e-11);
                }
            }
        }

        #[test]
        fn derivatives_are_those_of_central_differences(
            pose in prop::array::uniform3(-1.0..1.0f64), mounting in prop::array::uniform3(-1.0..1.0f64),
            anchor in prop::array::uniform2(-1.0..1.0f64), direction in -4.0..4.0f64, log_inverse_distance in -4.0..-1.4f64,
        ) {
            let x: Vec<f64> = pose.into_iter().chain(mounting).chain([direction, log_inverse_distance]).collect();
            let at = |x: &[f64]| predict(
                &Vector3::new(x[0], x[1], x[2]), &Vector3::new(x[3], x[4], x[5]),
                &InverseDistanceLandmark { anchor: anchor.into(), direction: x[6], log_inverse_distance: x[7] },
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
