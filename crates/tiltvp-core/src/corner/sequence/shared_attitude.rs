//! The attitude that most edges of a pair of images have in common, by which corners are completed and judged.

use nalgebra::{Matrix3, Vector3};

use super::agreement::{SAME_VERTEX_RAD, agreement};
use super::estimator::CornerPoseEstimator;
use crate::corner::closed_form::attitude::IncludedAngle;
use crate::corner::closed_form::resolve::{Alignment, View, resolve};
use crate::corner::estimate::Hypothesis;
use crate::corner::feature::CornerFeature;
use crate::corner::general::common_attitude::{CommonAttitude, StraightEdge, along_axes, common_attitude, headings};
use crate::error::Result;

/// The share of all edges along the axes of one attitude that is enough to trust it: random edges pass within 2 degrees
/// of one of three axes in a tenth of all cases.
const MOST: f64 = 0.4;

/// The share of random edges that pass within 2 degrees of one of three axes.
const AT_RANDOM: f64 = 0.1;

/// Least number of other edges of both images that speak against a pose which few of them are along.
const OTHERS_MIN: usize = 40;

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
        let lines: Vec<StraightEdge> = self.lines().into_iter().flatten().collect();
        let of_corners = common_attitude(&lines, starts.first()?);
        let most = MOST * lines.len() as f64;
        if of_corners.as_ref().is_some_and(|common| common.support >= most) {
            return of_corners;
        }
        // Corners may be false, or turned against most of the room.
        let others = starts.iter().skip(1).copied().chain(headings(&starts[0]));
        let found = others.filter_map(|start| common_attitude(&lines, &start));
        let best = found.max_by(|a, b| a.support.total_cmp(&b.support));
        best.filter(|common| common.support >= most).or(of_corners)
    }

    /// Whether of the straight edges that do not pass its vertex no larger share runs along the axes of a pose than of random ones: then
    /// nothing but its own three edges says that they are at right angles.
    pub(crate) fn stands_alone(&self, pose: &Hypothesis) -> bool {
        let (Some((_, left_from_right)), Some(vertex_m)) = (&self.right, pose.vertex_m) else { return false };
        if self.is_one_object() || self.options.angle != IncludedAngle::RIGHT {
            return false;
        }
        let (mut along, mut all) = (0, 0);
        for (lines, from_m) in self.lines().iter().zip([Vector3::zeros(), left_from_right.translation_m]) {
            let vertex = (vertex_m - from_m).normalize();
            let of_image = along_axes(lines, &pose.camera_from_object, &vertex, SAME_VERTEX_RAD);
            (along, all) = (along + of_image.0, all + of_image.1);
        }
        all >= OTHERS_MIN && along as f64 <= AT_RANDOM * all as f64
    }

    /// The longer straight edges of the images that were looked at last.
    fn lines(&self) -> [Vec<StraightEdge>; 2] {
        let (left, right) = (self.left.segments(&self.scratch[0]), self.right.as_ref());
        let of_right = right.map(|(detector, left_from_right)| {
            StraightEdge::of(detector.segments(&self.scratch[1]), &left_from_right.rotation).collect()
        });
        [StraightEdge::of(left, &Matrix3::identity()).collect(), of_right.unwrap_or_default()]
    }
}
