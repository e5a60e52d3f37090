//! Which pair of corners, one of each image, is believed.

use super::agreement::apart;
use super::estimator::CornerPoseEstimator;
use super::seen_pair::SeenPair;
use super::support::CornerSupport;
use crate::corner::closed_form::prior::AttitudePrior;
use crate::corner::detector::CornerDetector;
use crate::corner::estimate::{CornerEstimate, CornerVerdict};
use crate::corner::feature::CornerFeature;
use crate::corner::frame::Frame;
use crate::corner::general::beginnings::Beginnings;
use crate::corner::general::common_attitude::{CommonAttitude, SharedAxes};
use crate::error::Result;
use crate::geometry::RigidMotion;

/// The share of the largest misfit up to which a corner is believed.
const WELL: f64 = 0.4;

/// The same where no corner fits so well and the attitude of most edges is known: of a rendered corner whose rounded edges miss it by 0.45
/// to 0.52 in each of ten frames the place is right, and covariances grow with the misfit; wrong ones begin at 0.51.
const FAIRLY: f64 = 0.48;

/// The same of another corner than what is followed: nothing but its fit speaks for it. Of the best corners of 155 frames of twelve rooms
/// that were looked at, each frame for itself, 145 have 0.26 and less; grain of wood beside a box had 0.32.
const ANOTHER: f64 = 0.25;

/// How many of a corner's three rays in two images begin at its vertex at least: those of two edges. Where fewer do, edges of
/// several things meet in the images alone, or something is drawn about the vertex.
const BEGIN_MIN: usize = 4;

/// The misfit up to which a corner that was not there before is believed of which too few edges are shown to begin at its vertex: then
/// nothing but where they pass each other in space speaks for it. On rooms that were looked at, most such corners that are there have 0.55 and
/// less, those that are not have 0.93 and more.
const MEETS: f64 = 0.7;

/// What pairs of corners are judged by.
pub(super) struct PairSearch<'a> {
    estimator: &'a CornerPoseEstimator,
    /// The right camera.
    detector: &'a CornerDetector,
    left_from_right: &'a RigidMotion,
    features: &'a [Vec<CornerFeature>; 2],
    begin: [Vec<Beginnings>; 2],
    support: CornerSupport,
    priors: Vec<AttitudePrior>,
}

/// A pair that is believed.
struct JudgedPair {
    pair: SeenPair,
    /// Whether it is the same corner whatever was seen before.
    fits_well: bool,
    score: f64,
}

impl CornerPoseEstimator {
    /// The poses of the pair of features, one of each image, that fits best; of the corner that is followed or one that is known
    /// beside it, where there is one. Where an attitude is known on which several corners agree, pairs that do not are left
    /// out, but for those of the attitude `beside` it. Where the attitude is common to most edges and no pair fits well, one that fits fairly is
    /// believed, and then one whose edges are not shown to begin at its vertex. Returns all pairs that fit well, chosen or not.
    pub(crate) fn by_pair(
        &self,
        frames: [&Frame<'_>; 2],
        axes: SharedAxes<'_>,
        beside: Option<&CommonAttitude>,
        estimate: &mut CornerEstimate,
    ) -> Result<Vec<SeenPair>> {
        let Some(search) = self.pair_search(frames, &estimate.features) else { return Ok(Vec::new()) };
        let mut judged = search.judged(axes, true)?;
        if let Some(beside) = beside {
            let beside = SharedAxes { attitude: Some(&beside.camera_from_object), common: Some(beside) };
            judged.extend(search.judged(beside, true)?);
        }
        let best = match PairSearch::best(&judged) {
            None if axes.common.is_some() && !self.is_one_object() => {
                PairSearch::best(&search.judged(axes, false)?).cloned()
            }
            best => best.cloned(),
        };
        if let Some(SeenPair { left, right, poses }) = best {
            (estimate.chosen_left, estimate.chosen_right) = (vec![left], Some(right));
            estimate.hypotheses = poses;
        }
        Ok(judged.into_iter().filter(|judged| judged.fits_well).map(|judged| judged.pair).collect())
    }

    /// The pose of the L-junction of both images that fits best, of the common attitude of most edges, where no corner of three edges has
    /// one. Two edges say less than three: what could as well be another one's is left out.
    pub(super) fn by_l_junctions(
        &mut self,
        frames: [&Frame<'_>; 2],
        common: &CommonAttitude,
        estimate: &mut CornerEstimate,
    ) -> Result<()> {
        if !self.is_told_by_most(common) {
            return Ok(());
        }
        let features = self.l_junctions(frames, &common.camera_from_object);
        let Some(search) = self.pair_search(frames, &features) else { return Ok(()) };
        let axes = SharedAxes { attitude: Some(&common.camera_from_object), common: Some(common) };
        let mut judged = search.judged(axes, true)?;
        let pairs = judged.iter().filter(|judged| judged.fits_well).map(|judged| judged.pair.clone()).collect();
        let sure = self.one_to_one(&features, pairs);
        judged
            .retain(|judged| sure.iter().any(|pair| [pair.left, pair.right] == [judged.pair.left, judged.pair.right]));
        let Some(SeenPair { left, right, poses }) = PairSearch::best(&judged) else { return Ok(()) };
        for (all, chosen) in estimate.features.iter_mut().zip([features[0][*left], features[1][*right]]) {
            all.push(chosen);
        }
        estimate.chosen_left = vec![estimate.features[0].len() - 1];
        estimate.chosen_right = Some(estimate.features[1].len() - 1);
        estimate.hypotheses.clone_from(poses);
        estimate.verdict = CornerVerdict::Found;
        Ok(())
    }

    /// With a right camera.
    fn pair_search<'a>(
        &'a self,
        frames: [&Frame<'_>; 2],
        features: &'a [Vec<CornerFeature>; 2],
    ) -> Option<PairSearch<'a>> {
        let (detector, left_from_right) = self.right.as_ref()?;
        let begin = [(&self.left, 0), (detector, 1)].map(|(detector, side)| -> Vec<Beginnings> {
            features[side].iter().map(|corner| detector.beginnings(frames[side], corner)).collect()
        });
        let support = CornerSupport::new(features, left_from_right);
        let priors = self.priors(self.is_one_object());
        Some(PairSearch { estimator: self, detector, left_from_right, features, begin, support, priors })
    }
}

impl PairSearch<'_> {
    /// The pairs that are believed, or that would be if they were the corner that is followed, whose score is none.
    fn judged(&self, axes: SharedAxes<'_>, is_strict: bool) -> Result<Vec<JudgedPair>> {
        let mut out = Vec::new();
        for left in 0..self.features[0].len() {
            for right in 0..self.features[1].len() {
                out.extend(self.judge([left, right], axes, is_strict)?);
            }
        }
        Ok(out)
    }

    /// That with the highest score, the first of those.
    fn best(judged: &[JudgedPair]) -> Option<&SeenPair> {
        let with_score = judged.iter().filter(|judged| judged.score > 0.0);
        let best = with_score.reduce(|best, other| if other.score > best.score { other } else { best });
        best.map(|judged| &judged.pair)
    }

    /// A pair of features as a corner; none if it is not believed.
    fn judge(&self, [left, right]: [usize; 2], axes: SharedAxes<'_>, is_strict: bool) -> Result<Option<JudgedPair>> {
        let estimator = self.estimator;
        let one_object = estimator.is_one_object();
        let features = [&self.features[0][left], &self.features[1][right]];
        let begin = [&self.begin[0][left], &self.begin[1][right]];
        let shown = ShownEdges::of(features, begin);
        if shown.is_none() && is_strict {
            return Ok(None);
        }
        let of = |corners: &[CornerFeature; 2], most: f64| {
            let camera = (self.detector, self.left_from_right);
            estimator.pair_poses([&corners[0], &corners[1]], camera, &self.priors, axes.common, most)
        };
        let share = if is_strict { WELL } else { FAIRLY };
        let misfit_most = share * estimator.options.misfit_max;
        let corners = shown.as_ref().map_or(features.map(|corner| *corner), |shown| shown.corners);
        let poses = of(&corners, misfit_most)?;
        let Some((pose, vertex)) = poses.first().and_then(|pose| Some((pose, pose.vertex_m?))) else { return Ok(None) };
        let misfit = pose.misfit;
        if axes.attitude.is_some_and(|attitude| !estimator.are_parallel(&pose.camera_from_object, attitude)) {
            return Ok(None);
        }
        let is_known = estimator.track.as_ref().is_some_and(|track| track.likelihood(pose, false).is_some());
        let most = match &shown {
            Some(shown) if shown.is_enough || is_known => misfit_most,
            _ => misfit_most.min(MEETS),
        };
        let (nearest, farthest) = (estimator.options.distance_min_m, estimator.options.distance_max_m);
        let within = misfit <= most && (nearest..=farthest).contains(&vertex.norm());
        if !within || !estimator.is_upright(pose) {
            return Ok(None);
        }
        let poses = if shown.is_some() {
            poses
        } else {
            // What is not shown to begin at a vertex may be beside it.
            let loose = [0, 1].map(|side| begin[side].loosened(features[side], [false; 3]));
            let [Some(left), Some(right)] = loose else { return Ok(None) };
            of(&[left, right], misfit_most)?
        };
        let Some(pose) = poses.first() else { return Ok(None) };
        let fits = |share: f64| misfit <= share * estimator.options.misfit_max;
        let fits_well = fits(WELL);
        let likely = match &estimator.track {
            Some(track) if !one_object => track.likelihood(pose, fits(ANOTHER)).unwrap_or(0.0),
            _ => 1.0,
        };
        let [own, other] = features.map(CornerFeature::support_score);
        let mut score = likely * self.support.of(pose) * own.min(other) / (1.0 + misfit * misfit);
        if let Some(track) = &estimator.track {
            let turned = apart(&pose.camera_from_object, &track.pose.camera_from_object);
            score /= 1.0 + (turned / estimator.turn_sigma_rad(track)).powi(2);
        }
        Ok(Some(JudgedPair { pair: SeenPair { left, right, poses }, fits_well, score }))
    }
}

/// A corner of both images, as far as its edges are shown to begin at its vertex.
struct ShownEdges {
    /// Whether at least two do in both images.
    is_enough: bool,
    /// The corner in either image. Edges that are not shown to begin at it, as that of a drawer's front below the top of its
    /// case, tell its attitude and hardly its place, if the others are enough for that.
    corners: [CornerFeature; 2],
}

impl ShownEdges {
    /// None where edges of several things meet.
    fn of(corners: [&CornerFeature; 2], ends: [&Beginnings; 2]) -> Option<Self> {
        let shared = ends[0].shared(ends[1]);
        if shared.iter().filter(|shared| **shared).count() >= 2 {
            let [left, right] = [0, 1].map(|side| ends[side].loosened(corners[side], shared));
            return Some(Self { is_enough: true, corners: [left?, right?] });
        }
        let begin = ends[0].count() + ends[1].count();
        (begin >= BEGIN_MIN && corners.iter().all(|corner| corner.seen_edges() == 3))
            .then_some(Self { is_enough: false, corners: corners.map(|corner| *corner) })
    }
}
