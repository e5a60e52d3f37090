//! The attitude that most edges of the images have in common, by which corners are completed and judged.

use nalgebra::Matrix3;

use super::agreement::{agreement, apart, renamed};
use super::estimator::CornerPoseEstimator;
use crate::corner::closed_form::attitude::IncludedAngle;
use crate::corner::closed_form::resolve::{Alignment, View, resolve};
use crate::corner::estimate::Hypothesis;
use crate::corner::feature::CornerFeature;
use crate::corner::general::common_attitude::{CommonAttitude, StraightEdge, attitude_of_most, share_along_axes};
use crate::error::Result;
use crate::geometry::tangent_basis;

/// The share of the edges' length that runs along the axes of a pose that they say nothing for: of random ones it is a tenth, and
/// should scatter by some 0.04 for a hundred of them. No pose of 36 rendered rooms has less than 0.32; a right one before a wallpaper
/// of diamonds, where nothing but the corner's own long edges runs along them, 0.18.
const AT_RANDOM: f64 = 0.15;

/// The same of a corner that one image has alone: any three lines are a corner with right angles then. Of 42 such corners in rooms of
/// seeds 10400 to 10729 ten are 2.9 to 22 degrees off, with 0.09 to 0.48 along their axes, and 29 of the 32 others have more than 0.5.
const AT_RANDOM_ALONE: f64 = 0.5;

/// Least number of edges of all images that speak against a pose which few of them are along.
const EDGES_MIN: usize = 40;

impl CornerPoseEstimator {
    /// The attitudes by which corners may be completed: the likeliest ones that one image's corners agree on, with their edges
    /// at right angles, and that of the frame before.
    pub(crate) fn attitudes(&self, features: &[Vec<CornerFeature>; 2]) -> Result<Vec<Matrix3<f64>>> {
        let mut out = Vec::new();
        if self.is_one_object() || self.options.angle != IncludedAngle::RIGHT {
            return Ok(out);
        }
        let priors = self.priors(false);
        let turned = self.right.as_ref().map_or(Matrix3::identity(), |(_, motion)| motion.rotation);
        for (features, rotation) in features.iter().zip([Matrix3::identity(), turned]) {
            let priors = if rotation == Matrix3::identity() { &priors[..] } else { &[] };
            let Some(agreed) = agreement(features, &self.options.angle, self.options.agree_max_rad, priors)? else {
                continue;
            };
            let view = |attitudes| View { attitudes, common_from_camera: rotation };
            let views: Vec<View<'_>> = agreed.attitudes.iter().map(view).collect();
            let resolved = resolve(&views, Alignment::Manhattan, self.right_handed(), &self.priors(false))?;
            out.extend(resolved.first().map(|best| self.upright(best.common_from_object)));
        }
        out.extend(self.track.as_ref().map(|track| track.pose.camera_from_object));
        Ok(out)
    }

    /// The attitude that most straight edges of both images have in common; where most have none, that near the first of `starts`.
    pub(crate) fn common(&self, starts: &[Matrix3<f64>]) -> Option<CommonAttitude> {
        self.right.as_ref()?;
        attitude_of_most(&self.lines(), starts, self.about_vertical())
    }

    /// An attitude whose second axis is along the vertical, where that is known and all angles are right.
    fn about_vertical(&self) -> Option<Matrix3<f64>> {
        if self.is_one_object() || self.options.angle != IncludedAngle::RIGHT {
            return None;
        }
        let vertical = self.vertical()?.normalize();
        let aside = tangent_basis(&vertical).column(0).into_owned();
        Some(Matrix3::from_columns(&[aside, vertical, aside.cross(&vertical)]))
    }

    /// Takes the attitude of corners of one image from most of its straight edges, where these have one near to it.
    pub(crate) fn take_common(&self, pose: &mut Hypothesis) {
        if self.is_one_object() || self.options.angle != IncludedAngle::RIGHT {
            return;
        }
        let Some(common) = attitude_of_most(&self.lines(), &[pose.camera_from_object], None) else { return };
        let named = renamed(&common.camera_from_object, &pose.camera_from_object);
        if apart(&named, &pose.camera_from_object) <= self.options.parallel_max_rad {
            pose.camera_from_object = named;
            pose.covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&common.covariance);
        }
    }

    /// Whether too few of the straight edges run along the axes of a pose: then nothing but three short edges of its own says that they
    /// are at right angles, unless others of the `corners` of one image that agree on it do.
    pub(crate) fn stands_alone(&self, pose: &Hypothesis, corners: usize) -> bool {
        let from_one = self.right.is_none();
        if from_one && corners > 1 || self.is_one_object() || self.options.angle != IncludedAngle::RIGHT {
            return false;
        }
        let lines = self.lines();
        let at_random = if from_one { AT_RANDOM_ALONE } else { AT_RANDOM };
        lines.len() >= EDGES_MIN && share_along_axes(&lines, &pose.camera_from_object) <= at_random
    }

    /// The longer straight edges of the images that were looked at last.
    fn lines(&self) -> Vec<StraightEdge> {
        let mut lines: Vec<StraightEdge> =
            StraightEdge::of(self.left.segments(&self.scratch[0]), &Matrix3::identity()).collect();
        if let Some((detector, left_from_right)) = &self.right {
            lines.extend(StraightEdge::of(detector.segments(&self.scratch[1]), &left_from_right.rotation));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::camera::{Camera, Model, Pinhole};
    use crate::corner::closed_form::attitude::IncludedAngle;
    use crate::corner::detector::CornerDetector;
    use crate::corner::estimator_options::EstimatorOptions;
    use crate::corner::options::DetectorOptions;

    #[test]
    fn the_vertical_is_the_second_axis_where_angles_are_right_and_there_may_be_several_corners() {
        let lens = Pinhole::new([700.0; 2], [639.5, 359.5], &[]).unwrap();
        let camera = Camera::new(1280, 720, Model::Pinhole(lens)).unwrap();
        let down = Vector3::new(0.1, 0.9, 0.4).normalize();
        let about = |method: &str, angle: IncludedAngle, down: Option<Vector3<f64>>| {
            let detector =
                CornerDetector::new(camera.clone(), DetectorOptions::for_method(method).unwrap(), None).unwrap();
            let options = EstimatorOptions { angle, down, ..EstimatorOptions::default() };
            CornerPoseEstimator::new(detector, None, options).unwrap().about_vertical()
        };
        let attitude = about("general", IncludedAngle::RIGHT, Some(down)).unwrap();
        assert!((attitude.column(1) - down).norm() < 1e-12 && (attitude.determinant() - 1.0).abs() < 1e-12);
        assert!((attitude.tr_mul(&attitude) - Matrix3::identity()).norm() < 1e-12);
        for (method, angle, down) in [
            ("general", IncludedAngle::RIGHT, None),
            ("general", IncludedAngle::exact(1.2), Some(down)),
            ("coloured", IncludedAngle::RIGHT, Some(down)),
        ] {
            assert_eq!(about(method, angle, down), None, "{method}");
        }
    }
}
