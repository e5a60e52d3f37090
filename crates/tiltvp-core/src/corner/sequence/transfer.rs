//! Corners of which one image shows two edges, and corners of one image looked for in the other one.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::agreement::{apart, fits, renamed};
use super::estimator::CornerPoseEstimator;
use crate::corner::closed_form::attitude::corner_attitudes;
use crate::corner::detector::{CornerDetector, CornerScratch};
use crate::corner::feature::CornerFeature;
use crate::corner::frame::Frame;
use crate::corner::general::guided::{EdgeSegments, ExpectedCorner};
use crate::error::Result;
use crate::geometry::RigidMotion;
use crate::image::ImageView;

/// Most corners of one image that are looked for in the other, those with the longest rays, which bounds the time.
const TRANSFERRED_MAX: usize = 8;

/// Distances that are tried before those are dropped that are less than a step apart: the disparity of a full-HD pair
/// in steps of [`EPIPOLAR_STEP_PX`], twice over.
const DISTANCES: u32 = 1000;

/// How far from the last vertex' distance other corners may be, as a share of it: a room's furniture about the tracked
/// corner.
const NEAR_LAST: f64 = 0.35;

/// How far apart the places are at which a corner is looked for along its epipolar line, in pixels. The search reaches
/// as far, so neighbours overlap by half.
const EPIPOLAR_STEP_PX: f64 = 4.0;

/// How far segments may be from where a ray is looked for to speak for it, in pixels: as far as the first and the second look for a ray
/// reach together, 4 and 2.5, and a segment's pixels lie beside it, 1.2.
const SPEAKING_PX: f64 = 2.0 * EPIPOLAR_STEP_PX;

/// Most places along an epipolar line at which a corner is looked for, those with which segments agree best, which bounds the time.
const PLACES_MAX: usize = 5;

impl CornerPoseEstimator {
    /// Adds the corners of which two edges were found and the third is known from an attitude in the left camera's frame.
    pub(crate) fn add_completed(
        &mut self,
        frames: [&Frame<'_>; 2],
        attitude: &Matrix3<f64>,
        features: &mut [Vec<CornerFeature>; 2],
    ) {
        self.in_each(frames, attitude, features, CornerDetector::complete);
    }

    /// The L-junctions of each image along the axes of an attitude in the left camera's frame.
    pub(super) fn l_junctions(&mut self, frames: [&Frame<'_>; 2], attitude: &Matrix3<f64>) -> [Vec<CornerFeature>; 2] {
        let mut features = [Vec::new(), Vec::new()];
        self.in_each(frames, attitude, &mut features, CornerDetector::l_junctions);
        features
    }

    /// Looks for corners in each grey image, with the attitude in the frame of its own camera.
    fn in_each(
        &mut self,
        frames: [&Frame<'_>; 2],
        attitude: &Matrix3<f64>,
        features: &mut [Vec<CornerFeature>; 2],
        find: impl Fn(&CornerDetector, &ImageView<'_>, &Matrix3<f64>, &mut CornerScratch, &mut Vec<CornerFeature>),
    ) {
        // The vertical is the axis nearest to what is known of it, so that edges are named as those found before.
        let attitude = self.vertical().map_or(*attitude, |vertical| upright(attitude, &vertical));
        let most_rad = self.options.agree_max_rad;
        let mut found = Vec::new();
        let mut look = |detector: &CornerDetector, side: usize, own: Matrix3<f64>, scratch: &mut CornerScratch| {
            if let Frame::Gray(image) = frames[side] {
                found.clear();
                find(detector, image, &own, scratch, &mut found);
                features[side].extend(found.iter().filter(|corner| fits(corner, &own, most_rad)));
            }
        };
        look(&self.left, 0, attitude, &mut self.scratch[0]);
        if let Some((detector, motion)) = &self.right {
            look(detector, 1, motion.rotation.transpose() * attitude, &mut self.scratch[1]);
        }
    }

    /// Adds the corners of either image to those of the other one where they are seen there: each is looked for along its
    /// epipolar line, near the distance of the last pose where there is one.
    pub(crate) fn add_transferred(
        &mut self,
        frames: [&Frame<'_>; 2],
        attitude: &Matrix3<f64>,
        features: &mut [Vec<CornerFeature>; 2],
    ) -> Result<()> {
        let Some((detector, left_from_right)) = &self.right else { return Ok(()) };
        let right_from_left = left_from_right.inverse();
        let detectors = [&self.left, detector];
        let attitudes = [*attitude, right_from_left.rotation * attitude];
        let (angle, most_rad) = (self.options.angle, self.options.agree_max_rad);
        let mut found: [Vec<CornerFeature>; 2] = [Vec::new(), Vec::new()];
        for (own, other, other_from_own) in [(0, 1, &right_from_left), (1, 0, left_from_right)] {
            let Frame::Gray(image) = frames[other] else { continue };
            let mut order: Vec<&CornerFeature> = features[own].iter().collect();
            order.sort_by(|a, b| b.support_score().total_cmp(&a.support_score()));
            for corner in order.into_iter().take(TRANSFERRED_MAX) {
                let admitted = corner_attitudes(corner, &angle)?;
                let near = admitted.iter().find(|admitted| {
                    let renamed = renamed(&admitted.camera_from_object, &attitudes[own]);
                    apart(&renamed, &attitudes[own]) <= most_rad
                });
                let Some(near) = near else { continue };
                let mut best: Option<CornerFeature> = None;
                let edges = near.edges.map(|edge| other_from_own.rotation * edge);
                let segments = EdgeSegments::new(detectors[other].segments(&self.scratch[other]), &edges, most_rad);
                let distances = self.distances(detectors[other], &corner.vertex(), other_from_own);
                let expected = distances.into_iter().enumerate().filter_map(|(step, away_m)| {
                    let expected = ExpectedCorner::transferred(corner, &near.edges, away_m, other_from_own)?;
                    Some((segments.speak_for(&expected, SPEAKING_PX)?, step, expected))
                });
                let mut expected: Vec<(f64, usize, ExpectedCorner)> = expected.collect();
                expected.sort_by(|a, b| b.0.total_cmp(&a.0));
                let mut found_at: Option<usize> = None;
                for (_, step, expected) in expected.into_iter().take(PLACES_MAX) {
                    if found_at.is_some_and(|at| at.abs_diff(step) > 1) {
                        continue;
                    }
                    let seen =
                        detectors[other].find_near(image, &expected, Some(EPIPOLAR_STEP_PX), &mut self.scratch[other]);
                    let Some(seen) = seen.filter(|seen| fits(seen, &attitudes[other], most_rad)) else { continue };
                    found_at = found_at.or(Some(step));
                    if best.as_ref().is_none_or(|best| seen.support_score() > best.support_score()) {
                        best = Some(seen);
                    }
                }
                found[other].extend(best);
            }
        }
        for (features, found) in features.iter_mut().zip(found) {
            features.extend(found);
        }
        Ok(())
    }

    /// Distances of a point along a bearing of one camera, so that the other one sees them a step apart; only those near that of
    /// the last pose, where there is one.
    fn distances(&self, other: &CornerDetector, bearing: &Vector3<f64>, other_from_own: &RigidMotion) -> Vec<f64> {
        let (nearest, farthest) = (self.options.distance_min_m, self.options.distance_max_m);
        let last = self.track.as_ref().and_then(|track| track.pose.vertex_m).map(|vertex| vertex.norm());
        let (near, far) = last.map_or((nearest, farthest), |last| (last * (1.0 - NEAR_LAST), last * (1.0 + NEAR_LAST)));
        let distance_m = |step: u32| {
            let share = f64::from(step) / f64::from(DISTANCES);
            1.0 / (1.0 / far + share * (1.0 / near - 1.0 / far))
        };
        let pixel = |step: u32| other.camera().project(&other_from_own.point(&(bearing * distance_m(step))));
        let mut out = Vec::new();
        let mut before: Option<Vector2<f64>> = None;
        // The steps from one distance to the next change slowly, so that the next one is near where the last was.
        let (mut step, mut stride) = (0, 1);
        while step <= DISTANCES {
            let moved = |step: u32| {
                let away =
                    |pixel: &Vector2<f64>| before.is_none_or(|before| (pixel - before).norm() >= EPIPOLAR_STEP_PX);
                pixel(step).filter(away)
            };
            let from = step;
            step = (step + stride - 1).min(DISTANCES);
            while step > from && moved(step - 1).is_some() {
                step -= 1;
            }
            while step < DISTANCES && moved(step).is_none() {
                step += 1;
            }
            if let Some(pixel) = moved(step).filter(|pixel| other.camera().contains(pixel)) {
                out.push(distance_m(step));
                stride = if before.is_some() { step + 1 - from } else { 1 };
                before = Some(pixel);
            } else {
                stride = 1;
            }
            step += 1;
        }
        out
    }
}

/// The same axes with the one that is nearest to a vertical as the second.
pub(crate) fn upright(attitude: &Matrix3<f64>, vertical: &Vector3<f64>) -> Matrix3<f64> {
    let nearest = attitude.tr_mul(vertical).abs().imax();
    let axis = |k: usize| attitude.column((nearest + k) % 3).into_owned();
    Matrix3::from_columns(&[axis(2), axis(0), axis(1)])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::camera::{Camera, Model, Pinhole};
    use crate::corner::{CornerMethod, DetectorOptions, EstimatorOptions, IncludedAngle};

    #[test]
    fn places_along_an_epipolar_line_are_a_step_apart_and_reach_from_near_to_far() {
        let lens = Pinhole::new([700.0, 700.0], [639.5, 359.5], &[]).unwrap();
        let camera = Camera::new(1280, 720, Model::Pinhole(lens)).unwrap();
        let detector =
            || CornerDetector::new(camera.clone(), DetectorOptions::for_method("general").unwrap(), None).unwrap();
        let left_from_right =
            RigidMotion { rotation: Matrix3::identity(), translation_m: Vector3::new(0.12, 0.0, 0.0) };
        let options = EstimatorOptions { distance_min_m: 0.5, distance_max_m: 50.0, ..EstimatorOptions::default() };
        let estimator = CornerPoseEstimator::new(detector(), Some((detector(), left_from_right)), options).unwrap();
        let (bearing, right_from_left) = (Vector3::new(0.1, -0.05, 1.0).normalize(), left_from_right.inverse());
        let distances = estimator.distances(&detector(), &bearing, &right_from_left);
        let places: Vec<Vector2<f64>> = distances
            .iter()
            .map(|distance_m| camera.project(&right_from_left.point(&(bearing * *distance_m))).unwrap())
            .collect();
        for pair in places.windows(2) {
            let apart_px = (pair[1] - pair[0]).norm();
            assert!((EPIPOLAR_STEP_PX..1.1 * EPIPOLAR_STEP_PX).contains(&apart_px), "{apart_px}");
        }
        let (far, near) = (distances.first().unwrap(), distances.last().unwrap());
        assert!((far - 50.0).abs() < 1e-9 && (0.5..0.52).contains(near), "{far} {near}");
    }

    #[test]
    fn another_axis_is_upright_only_where_all_angles_are_right_and_there_may_be_several_corners() {
        let lens = Pinhole::new([700.0; 2], [639.5, 359.5], &[]).unwrap();
        let camera = Camera::new(1280, 720, Model::Pinhole(lens)).unwrap();
        let upright = |method: &str, angle: IncludedAngle| {
            let mut own = DetectorOptions::for_method(method).unwrap();
            if let CornerMethod::General(general) = &mut own.method {
                general.gamma_rad = angle.gamma_rad;
            }
            let detector = CornerDetector::new(camera.clone(), own, None).unwrap();
            let options = EstimatorOptions { down: Some(Vector3::x()), angle, ..EstimatorOptions::default() };
            CornerPoseEstimator::new(detector, None, options).unwrap().upright(Matrix3::identity())
        };
        assert_eq!(upright("general", IncludedAngle::RIGHT).column(1), Vector3::x());
        for (method, angle) in [("coloured", IncludedAngle::RIGHT), ("general", IncludedAngle::exact(1.2))] {
            assert_eq!(upright(method, angle), Matrix3::identity(), "{method}");
        }
    }
}
