//! The attitude that most edges of the images have in common, by which corners are completed and judged.

use nalgebra::{Matrix3, Vector3};

use super::agreement::{agreement, apart, fits, renamed};
use super::estimator::CornerPoseEstimator;
use super::turned_apart::turned_apart;
use crate::corner::closed_form::attitude::IncludedAngle;
use crate::corner::closed_form::resolve::{Alignment, View, resolve};
use crate::corner::estimate::Hypothesis;
use crate::corner::feature::CornerFeature;
use crate::corner::general::attitude_of_most::{MOST, Starts, attitude_beside, attitude_of_most};
use crate::corner::general::common_attitude::{CommonAttitude, StraightEdge, share_along_axes};
use crate::error::Result;

/// The share of the edges' length that runs along the axes of a pose that they say nothing for: of random ones it is a tenth, and
/// should scatter by some 0.04 for a hundred of them. No pose of 36 rendered rooms has less than 0.32; a right one before a wallpaper
/// of diamonds, where nothing but the corner's own long edges runs along them, 0.18.
const AT_RANDOM: f64 = 0.15;

/// The same of a corner that one image has alone: any three lines are a corner with right angles then. Of 42 such corners in rooms of
/// seeds 10400 to 10729 ten are 2.9 to 22 degrees off, with 0.09 to 0.48 along their axes, and 29 of the 32 others have more than 0.5.
const AT_RANDOM_ALONE: f64 = 0.5;

/// The same of two and three corners of one image that agree, as they may by chance. Of 214 answers of two and more in 62 rooms that were
/// looked at eight are 4 to 19 degrees off, seven of two and one of three, with 0.13 to 0.30 along their axes, and no other has less than
/// 0.43; of a cuboid in a room that stands otherwise it is 0.41 to 0.46.
const AT_RANDOM_AGREED: f64 = 0.35;

/// The largest standard deviation of an attitude by an L-junction, or by one or two corners, of one image, radians: 0.57 degrees; beyond it
/// few edges run along some axis, and perhaps by chance. In views of 54 real rooms with gravity told, 12 of the 71 beyond it of one or two
/// corners, and 5 of 19 of L-junctions, are by themselves, 2 to 45 degrees off in heading, and 2 of the 209 others.
const SIGMA_MAX_RAD: f64 = 0.01;

/// Least number of edges of all images that speak against a pose which few of them are along.
const EDGES_MIN: usize = 40;

impl CornerPoseEstimator {
    /// The attitudes by which corners may be completed: the likeliest ones that one image's corners agree on, with their edges
    /// at right angles, and that of the frame before.
    pub(crate) fn attitudes(&self, features: &[Vec<CornerFeature>; 2]) -> Result<Starts> {
        let mut out = Starts::default();
        if !self.are_rooms() {
            return Ok(out);
        }
        let priors = self.priors(false);
        let turned = self.right.as_ref().map_or(Matrix3::identity(), |(_, motion)| motion.rotation);
        for (features, rotation) in features.iter().zip([Matrix3::identity(), turned]) {
            let priors = if rotation == Matrix3::identity() { &priors[..] } else { &[] };
            let Some(agreed) = agreement(features, &self.options.angle, self.options.agree_max_rad, priors)? else {
                continue;
            };
            out.lone = self.right.is_none() && agreed.members.len() == 1;
            let view = |attitudes| View { attitudes, common_from_camera: rotation };
            let views: Vec<View<'_>> = agreed.attitudes.iter().map(view).collect();
            let resolved = resolve(&views, Alignment::Manhattan, self.right_handed(), &self.priors(false))?;
            out.attitudes.extend(resolved.first().map(|best| self.upright(best.common_from_object)));
        }
        out.attitudes.extend(self.track.as_ref().map(|track| track.pose.camera_from_object));
        Ok(out)
    }

    /// The attitude that most straight edges of the images have in common; where most have none, that near the first of `starts`.
    pub(crate) fn common(&self, starts: &Starts) -> Option<CommonAttitude> {
        let each = self.lines_of_each();
        let common = attitude_of_most(&each.concat(), starts, self.vertical_of_room())?;
        Some(CommonAttitude { turned_apart: turned_apart(&each, &common.camera_from_object), ..common })
    }

    /// The attitude of what stands upright beside most, turned about the vertical, if there is any.
    pub(super) fn beside(&self, common: &CommonAttitude) -> Option<CommonAttitude> {
        let lines = self.lines_of_each().concat();
        let found = attitude_beside(&lines, &self.upright(common.camera_from_object))?;
        let is_other = !self.are_parallel(&found.camera_from_object, &common.camera_from_object);
        is_other.then_some(CommonAttitude { turned_apart: common.turned_apart, ..found })
    }

    /// Whether two attitudes have the same axes, however these are named.
    pub(super) fn are_parallel(&self, own: &Matrix3<f64>, other: &Matrix3<f64>) -> bool {
        apart(&renamed(own, other), other) <= self.options.agree_max_rad
    }

    /// Whether most straight edges of the images contradict the gravity that is told in this frame.
    pub(super) fn is_against_gravity(&self, common: &CommonAttitude) -> bool {
        let attitude = self.upright(common.camera_from_object);
        let told = self.known.gravity.filter(|_| self.is_of_most(common));
        told.is_some_and(|gravity| !gravity.is_along(&attitude, &common.covariance))
    }

    /// Whether most straight edges of the images have an attitude.
    pub(super) fn is_of_most(&self, common: &CommonAttitude) -> bool {
        common.support >= MOST * self.lines_of_each().iter().map(Vec::len).sum::<usize>() as f64
    }

    /// Whether most straight edges of the images tell an attitude that nothing contradicts.
    pub(super) fn is_told_by_most(&self, common: &CommonAttitude) -> bool {
        let may_tell = self.are_rooms() && self.options.parallel_max_rad > 0.0;
        may_tell && self.is_of_most(common) && common.turned_apart.is_none() && !self.is_against_gravity(common)
    }

    /// Whether all angles are right and there may be several corners.
    fn are_rooms(&self) -> bool {
        !self.is_one_object() && self.options.angle == IncludedAngle::RIGHT
    }

    /// The vertical of rooms, where it is known.
    fn vertical_of_room(&self) -> Option<Vector3<f64>> {
        if self.are_rooms() { self.vertical() } else { None }
    }

    /// Which of the corners of one image run along the axes of the common attitude; all of them where none do.
    pub(crate) fn parallel_to(&self, common: Option<&CommonAttitude>, corners: &[CornerFeature]) -> Vec<usize> {
        let parallel = |k: &usize| common.is_some_and(|common| self.runs_along(common, &corners[*k]));
        let found: Vec<usize> = (0..corners.len()).filter(parallel).collect();
        if found.is_empty() { (0..corners.len()).collect() } else { found }
    }

    fn runs_along(&self, common: &CommonAttitude, corner: &CornerFeature) -> bool {
        fits(corner, &common.camera_from_object, self.options.parallel_max_rad)
    }

    /// Takes the common attitude for that of corners of one image, if the best of them runs along it. Any three lines are a corner with
    /// right angles: a lone one that does not is contradicted, and the answer is false.
    pub(crate) fn take_common(
        &self,
        pose: &mut Hypothesis,
        common: Option<&CommonAttitude>,
        corners: &[&CornerFeature],
    ) -> bool {
        let Some(common) = common else { return true };
        if !corners.first().is_some_and(|best| self.runs_along(common, best)) {
            return corners.len() > 1;
        }
        let named = renamed(&common.camera_from_object, &pose.camera_from_object);
        let turn = named * pose.camera_from_object.transpose();
        pose.edges = pose.edges.map(|edge| turn * edge);
        pose.camera_from_object = named;
        pose.covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&common.covariance);
        true
    }

    /// Whether too few of the straight edges run along the axes of a pose, on which `corners` of the left image agree: then nothing but
    /// short edges of their own says that these are at right angles. More than three hardly agree by chance.
    pub(crate) fn stands_alone(&self, pose: &Hypothesis, corners: usize) -> bool {
        if !self.are_rooms() {
            return false;
        }
        let lines = self.lines_of_each().concat();
        let at_random = match (&self.right, corners) {
            (Some(_), _) => AT_RANDOM,
            (None, ..=1) => AT_RANDOM_ALONE,
            (None, 2 | 3) => AT_RANDOM_AGREED,
            (None, _) => return false,
        };
        lines.len() >= EDGES_MIN && share_along_axes(&lines, &pose.camera_from_object) <= at_random
    }

    /// Whether one image, full of edges, leaves a turn of a pose open on which one corner or two agree. Of a thing before plain walls few
    /// edges tell the attitude, and none else are there to be taken for its.
    pub(super) fn is_left_open_amid_edges(&self, pose: &Hypothesis, corners: usize) -> bool {
        let may_be_chance = corners <= 2 && self.lines_of_each()[0].len() >= EDGES_MIN;
        may_be_chance && self.is_left_open(&pose.attitude_covariance())
    }

    /// Whether one image leaves a turn of an attitude of this covariance open.
    pub(super) fn is_left_open(&self, covariance: &Matrix3<f64>) -> bool {
        let variance = covariance.symmetric_eigenvalues().max();
        self.right.is_none() && self.are_rooms() && variance > SIGMA_MAX_RAD * SIGMA_MAX_RAD
    }

    /// The longer straight edges of the images that were looked at last, those of the right one none with one camera.
    fn lines_of_each(&self) -> [Vec<StraightEdge>; 2] {
        let of_left = StraightEdge::of(self.left.segments(&self.scratch[0]), &Matrix3::identity()).collect();
        let of_right = self.right.as_ref().map_or_else(Vec::new, |(detector, left_from_right)| {
            StraightEdge::of(detector.segments(&self.scratch[1]), &left_from_right.rotation).collect()
        });
        [of_left, of_right]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix6, Rotation3};

    use super::*;
    use crate::camera::{Camera, Model, Pinhole};
    use crate::corner::detector::CornerDetector;
    use crate::corner::estimator_options::EstimatorOptions;
    use crate::corner::options::{CornerMethod, DetectorOptions};

    /// One camera that knows down, where it is told.
    fn estimator(method: &str, angle: IncludedAngle, down: Option<Vector3<f64>>) -> CornerPoseEstimator {
        let lens = Pinhole::new([700.0; 2], [639.5, 359.5], &[]).unwrap();
        let camera = Camera::new(1280, 720, Model::Pinhole(lens)).unwrap();
        let mut own = DetectorOptions::for_method(method).unwrap();
        if let CornerMethod::General(general) = &mut own.method {
            general.gamma_rad = angle.gamma_rad;
        }
        let detector = CornerDetector::new(camera, own, None).unwrap();
        let options = EstimatorOptions { angle, down, ..EstimatorOptions::default() };
        CornerPoseEstimator::new(detector, None, options).unwrap()
    }

    #[test]
    fn rooms_have_a_vertical_where_angles_are_right_and_there_may_be_several_corners() {
        let down = Vector3::new(0.1, 0.9, 0.4).normalize();
        let of = |method: &str, angle: IncludedAngle, down| estimator(method, angle, down).vertical_of_room();
        let told = of("general", IncludedAngle::RIGHT, Some(down)).unwrap();
        assert!((told.normalize() - down).norm() < 1e-12);
        for (method, angle, down) in [
            ("general", IncludedAngle::RIGHT, None),
            ("general", IncludedAngle::exact(1.2), Some(down)),
            ("coloured", IncludedAngle::RIGHT, Some(down)),
        ] {
            assert_eq!(of(method, angle, down), None, "{method}");
        }
    }

    #[test]
    fn a_lone_corner_that_most_edges_contradict_is_none_and_one_that_they_run_along_has_their_attitude() {
        let estimator = estimator("general", IncludedAngle::RIGHT, None);
        let rotated = |turn_rad: f64| *Rotation3::from_euler_angles(0.6, 0.5 + turn_rad, 0.0).matrix();
        let corner = |attitude: &Matrix3<f64>| {
            let vertex = Vector3::new(0.1, 0.0, 2.0);
            let toward = [0, 1, 2].map(|axis| vertex + 0.3 * attitude.column(axis));
            CornerFeature::from_bearings(&vertex, &toward).unwrap()
        };
        let common = CommonAttitude {
            camera_from_object: rotated(0.0),
            covariance: Matrix3::from_diagonal_element(1e-6),
            scatter: 1.0,
            support: 50.0,
            turned_apart: None,
        };
        let pose_of = |attitude: Matrix3<f64>| Hypothesis {
            camera_from_object: attitude,
            edges: [0, 1, 2].map(|axis| attitude.column(axis).into_owned()),
            vertex_m: None,
            covariance: Matrix6::identity(),
            probability: 1.0,
            right_handed: true,
            misfit: 0.0,
        };
        let (near, far) = (corner(&rotated(0.02)), corner(&rotated(0.4)));
        let features = [far, near];
        assert_eq!(estimator.parallel_to(Some(&common), &features), [1]);
        assert_eq!(estimator.parallel_to(Some(&common), &features[..1]), [0]);
        assert_eq!(estimator.parallel_to(None, &features), [0, 1]);
        let mut pose = pose_of(rotated(0.02));
        assert!(estimator.take_common(&mut pose, Some(&common), &[&near]));
        assert!((pose.camera_from_object - rotated(0.0)).norm() < 1e-12);
        assert_eq!(pose.covariance.fixed_view::<3, 3>(0, 0), common.covariance);
        for (axis, edge) in pose.edges.iter().enumerate() {
            assert!((edge - rotated(0.0).column(axis)).norm() < 1e-12);
        }
        let alone = pose_of(rotated(0.4));
        let mut pose = alone;
        assert!(!estimator.take_common(&mut pose, Some(&common), &[&far]));
        assert!(estimator.take_common(&mut pose, Some(&common), &[&far, &far]));
        assert!(estimator.take_common(&mut pose, None, &[&far]));
        assert_eq!(pose, alone);
    }
}
