//! The attitude that most edges of a pair of images have in common, by which corners are completed and judged.

use nalgebra::Matrix3;

use super::agreement::agreement;
use super::estimator::CornerPoseEstimator;
use crate::corner::closed_form::attitude::IncludedAngle;
use crate::corner::closed_form::resolve::{Alignment, View, resolve};
use crate::corner::estimate::Hypothesis;
use crate::corner::feature::CornerFeature;
use crate::corner::general::common_attitude::{
    CommonAttitude, StraightEdge, common_attitude, headings, share_along_axes,
};
use crate::error::Result;
use crate::geometry::tangent_basis;

/// The share of all edges along the axes of one attitude that is enough to trust it: random edges pass within 2 degrees
/// of one of three axes in a tenth of all cases.
const MOST: f64 = 0.4;

/// The share of the edges' length that runs along the axes of a pose that they say nothing for: of random ones it is a tenth, and
/// should scatter by some 0.04 for a hundred of them. No pose of 36 rendered rooms has less than 0.32; a right one before a wallpaper
/// of diamonds, where nothing but the corner's own long edges runs along them, 0.18.
const AT_RANDOM: f64 = 0.15;

/// Least number of edges of both images that speak against a pose which few of them are along.
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
        let lines = self.lines();
        let of_corners = starts.first().and_then(|start| common_attitude(&lines, start));
        let most = MOST * lines.len() as f64;
        if of_corners.as_ref().is_some_and(|common| common.support >= most) {
            return of_corners;
        }
        // Corners may be false, or turned against most of the room, or none may have been found.
        let upright = starts.first().copied().or_else(|| self.about_vertical())?;
        let others = starts.iter().skip(1).copied().chain(headings(&upright));
        let found = others.filter_map(|start| common_attitude(&lines, &start));
        let best = found.max_by(|a, b| a.support.total_cmp(&b.support));
        best.filter(|common| common.support >= most).or(of_corners)
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

    /// Whether no more of the straight edges runs along the axes of a pose than of random ones: then nothing but three short edges of
    /// its own says that they are at right angles.
    pub(crate) fn stands_alone(&self, pose: &Hypothesis) -> bool {
        if self.right.is_none() || self.is_one_object() || self.options.angle != IncludedAngle::RIGHT {
            return false;
        }
        let lines = self.lines();
        lines.len() >= EDGES_MIN && share_along_axes(&lines, &pose.camera_from_object) <= AT_RANDOM
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
