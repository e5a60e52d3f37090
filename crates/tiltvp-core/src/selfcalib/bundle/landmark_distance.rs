//! Landmarks at wrong distances: a new anchor, a line search over the distance, and a prior that knows nothing of it.

use nalgebra::{Vector2, Vector3};

use super::problem::BundleProblem;
use crate::geometry::wrap_angle;
use crate::selfcalib::model::{InverseDistanceLandmark, camera_position, landmark_from_bearing, predict};

/// Step of the line search over the logarithm of the inverse distance, and steps to either side of the prior: distances from
/// 1/25 to 25 times the prior's, and the best of them within 22 % of the minimum, from where the descent finds it.
pub(crate) const DISTANCE_STEP: f64 = 0.4;
pub(crate) const DISTANCE_STEPS: i32 = 8;

/// A landmark nearer to its new anchor than this, metres, keeps the old one: its direction from there would be noise.
const LEAST_DISTANCE_M: f64 = 1e-6;

/// Standard deviation of the logarithm of a distance of which nothing is known.
pub(crate) const UNKNOWN_LOG_SIGMA: f64 = 100.0;

impl BundleProblem {
    /// Makes the prior know nothing of the distance of a landmark.
    pub(crate) fn forget_distance(&mut self, landmark: usize) {
        let at = self.free.width() + 2 * landmark + 1;
        self.prior_information[(at, at)] = 1.0 / (UNKNOWN_LOG_SIGMA * UNKNOWN_LOG_SIGMA);
    }

    /// Moves the anchor of every landmark to the place of the camera at its first observation. From another anchor a landmark
    /// may have to pass through that anchor to reach its true place. Landmarks whose direction the prior knows stay.
    pub(crate) fn reanchor(&mut self) {
        let calibration_width = self.free.width();
        let known = |slot| self.prior_information[(calibration_width + 2 * slot, calibration_width + 2 * slot)] > 0.0;
        let mut done: Vec<bool> = (0..self.landmarks.len()).map(known).collect();
        for keyframe in &self.keyframes {
            for observation in keyframe
                .observations
                .iter()
                .filter(|observation| !std::mem::replace(&mut done[observation.landmark], true))
            {
                let old = self.landmarks[observation.landmark];
                let anchor = camera_position(&keyframe.pose, &self.mounting);
                let (sin, cos) = old.direction.sin_cos();
                let away = old.anchor + Vector2::new(cos, sin) * (-old.log_inverse_distance).exp() - anchor;
                if away.norm() > LEAST_DISTANCE_M {
                    let turn = wrap_angle(away.y.atan2(away.x) - old.direction);
                    let direction = old.direction + turn;
                    self.landmarks[observation.landmark] =
                        InverseDistanceLandmark { anchor, direction, log_inverse_distance: -away.norm().ln() };
                }
            }
        }
    }

    /// A line search over the distance of each landmark that has a whitened residual of `limit` or more, in the direction of
    /// its first bearing.
    pub(crate) fn search_distances(&mut self, limit: f64) {
        let mut seen: Vec<Vec<(Vector3<f64>, f64)>> = vec![Vec::new(); self.landmarks.len()];
        for keyframe in &self.keyframes {
            for observation in &keyframe.observations {
                seen[observation.landmark].push((keyframe.pose, observation.about(&self.centre).bearing));
            }
        }
        for (i, seen) in seen.iter().enumerate() {
            let off = |landmark: &InverseDistanceLandmark| {
                let one = |(pose, bearing): &(Vector3<f64>, f64)| {
                    wrap_angle(predict(pose, &self.mounting, landmark).bearing - bearing).abs() / self.bearing_sigma
                };
                seen.iter().map(one).fold((0.0, 0.0f64), |(sum, far), r| (sum + r, far.max(r)))
            };
            let now = self.landmarks[i];
            let Some((pose, bearing)) = seen.first().filter(|_| off(&now).1 >= limit) else { continue };
            let prior = self.prior_mean[self.free.width() + 2 * i + 1];
            let best = (-DISTANCE_STEPS..=DISTANCE_STEPS)
                .filter_map(|k| {
                    landmark_from_bearing(
                        now.anchor,
                        prior + DISTANCE_STEP * f64::from(k),
                        pose,
                        &self.mounting,
                        *bearing,
                    )
                })
                .min_by(|a, b| off(a).0.total_cmp(&off(b).0));
            if let Some(mut best) = best {
                // The same direction, without a jump of a whole turn.
                best.direction = now.direction + wrap_angle(best.direction - now.direction);
                self.landmarks[i] = best;
            }
        }
    }
}
