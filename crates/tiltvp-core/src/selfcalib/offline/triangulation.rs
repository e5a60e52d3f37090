//! A landmark from its bearings, at poses that are known roughly.

use nalgebra::{Vector2, Vector3};

use crate::geometry::wrap_angle;
use crate::selfcalib::bundle::{BundleProblem, DISTANCE_STEP, DISTANCE_STEPS};
use crate::selfcalib::model::{InverseDistanceLandmark, camera_position, landmark_from_bearing, predict};
use crate::selfcalib::options::SelfCalibratorOptions;

/// Step of the second line search over the distance, which covers one step of the first to either side.
const FINE_DISTANCE_STEP: f64 = 0.05;

/// The landmark in the direction of its first bearing, at the distance of the least mean disagreement of all bearings, and that
/// disagreement in radians.
pub(super) fn triangulated(
    problem: &BundleProblem,
    filter: &SelfCalibratorOptions,
    seen: &[(usize, f64)],
) -> (InverseDistanceLandmark, f64) {
    let pose = |(keyframe, bearing): &(usize, f64)| {
        problem.observation_pose(*keyframe, &Vector2::new(bearing.cos(), bearing.sin())).0
    };
    let poses: Vec<Vector3<f64>> = seen.iter().map(pose).collect();
    let (first, bearing) = (poses[0], seen[0].1);
    let anchor = camera_position(&first, &problem.mounting);
    let off = |landmark: &InverseDistanceLandmark| {
        let one = |(pose, (_, bearing)): (&Vector3<f64>, &(usize, f64))| {
            wrap_angle(predict(pose, &problem.mounting, landmark).bearing - bearing).abs()
        };
        poses.iter().zip(seen).map(one).sum::<f64>() / seen.len() as f64
    };
    let at = |inverse: f64| landmark_from_bearing(anchor, inverse, &first, &problem.mounting, bearing);
    let direction = bearing + first.z + problem.mounting.z;
    let prior = -filter.start_distance_m.ln();
    let unlikely = |inverse: f64| {
        let sigmas = (inverse - prior) / filter.start_distance_log_sigma;
        0.5 * sigmas * sigmas * problem.bearing_sigma / seen.len() as f64
    };
    let mut best = prior;
    for step in [DISTANCE_STEP, FINE_DISTANCE_STEP] {
        let near = best;
        best = (-DISTANCE_STEPS..=DISTANCE_STEPS)
            .map(|k| near + step * f64::from(k))
            .filter_map(|inverse| Some((inverse, off(&at(inverse)?) + unlikely(inverse))))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(near, |(inverse, _)| inverse);
    }
    let landmark = InverseDistanceLandmark { anchor, direction, log_inverse_distance: best };
    (landmark, off(&landmark))
}
