//! From images to poses: corners found in one image or a pair, resolved, and followed from frame to frame.

use nalgebra::{Matrix3, Vector3};

use super::agreement::{SAME_VERTEX_RAD, fits, renamed};
use super::frame_knowledge::FrameKnowledge;
use super::names::CornerNames;
use super::seen_pair::SeenPair;
use super::track::Track;
use crate::corner::closed_form::attitude::{IncludedAngle, meant_by};
use crate::corner::detector::{CornerDetector, CornerScratch};
use crate::corner::estimate::{BelievedCorner, CornerEstimate, CornerVerdict, Hypothesis, PlaceVerdict};
use crate::corner::estimator_options::{EstimatorOptions, KnownEdge};
use crate::corner::feature::CornerFeature;
use crate::corner::frame::Frame;
use crate::corner::general::common_attitude::{CommonAttitude, SharedAxes};
use crate::corner::general::guided::ExpectedCorner;
use crate::corner::options::CornerMethod;
use crate::corner::pose::check_baseline;
use crate::error::{Error, Result};
use crate::geometry::RigidMotion;

/// Finds the pose of a corner in the frames of a sequence, by one camera (attitude alone) or by two.
#[derive(Debug, Clone)]
pub struct CornerPoseEstimator {
    pub(super) left: CornerDetector,
    pub(super) right: Option<(CornerDetector, RigidMotion)>,
    pub(super) options: EstimatorOptions,
    pub(super) track: Option<Track>,
    objects: u32,
    names: CornerNames,
    /// Of the frame that is looked at.
    pub(super) known: FrameKnowledge,
    pub(super) scratch: [CornerScratch; 2],
}

/// That a detector looks for corners of the included angle that poses are of.
fn check_angle(detector: &CornerDetector, angle: &IncludedAngle) -> Result<()> {
    match &detector.options().method {
        CornerMethod::General(own) if own.gamma_rad != angle.gamma_rad => {
            Err(Error::option("gamma_rad", angle.gamma_rad, format!("{}, as the detector has it", own.gamma_rad)))
        }
        _ => Ok(()),
    }
}

impl CornerPoseEstimator {
    /// With one camera or two; `left_from_right` is the right camera's pose in the left one's frame. An included angle within 1e-3
    /// radians of the right one is that.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] for options out of their domain and for two detectors of
    /// different front ends.
    pub fn new(
        left: CornerDetector,
        right: Option<(CornerDetector, RigidMotion)>,
        mut options: EstimatorOptions,
    ) -> Result<Self> {
        options.validate()?;
        options.angle.gamma_rad = meant_by(options.angle.gamma_rad);
        if let Some((right, left_from_right)) = &right {
            let names = [left.options().method.name(), right.options().method.name()];
            if names[0] != names[1] {
                return Err(Error::argument("right", names[1], format!("the method of left, {}", names[0])));
            }
            if let Some(scale) = options.scales().first() {
                let expected = "none for two cameras, which tell the distance themselves";
                return Err(Error::argument(scale, "given", expected));
            }
            check_baseline(left_from_right)?;
        }
        for detector in [Some(&left), right.as_ref().map(|(right, _)| right)].into_iter().flatten() {
            check_angle(detector, &options.angle)?;
        }
        let is_coloured = matches!(left.options().method, CornerMethod::Coloured(_));
        if options.edge_length_m.is_some() && options.known_edge != KnownEdge::Y && !is_coloured {
            let expected = "y for corners without colours, whose level edges have no names";
            return Err(Error::argument("known_edge", options.known_edge.name(), expected));
        }
        if let CornerMethod::Paper(_) = left.options().method
            && let Some(scale) = options.scales().iter().find(|scale| **scale != "camera_height_m")
        {
            return Err(Error::argument(scale, "a length for method \"paper\"", "none, or method \"coloured\""));
        }
        let scratch = [left.scratch(), right.as_ref().map_or(left.scratch(), |(right, _)| right.scratch())];
        Ok(Self {
            left,
            right,
            options,
            track: None,
            objects: 0,
            names: CornerNames::default(),
            known: FrameKnowledge::default(),
            scratch,
        })
    }

    /// The left or only camera's detector.
    pub fn left(&self) -> &CornerDetector {
        &self.left
    }

    /// The right camera's detector and its pose in the left one's frame.
    pub fn right(&self) -> Option<&(CornerDetector, RigidMotion)> {
        self.right.as_ref()
    }

    /// The options.
    pub fn options(&self) -> &EstimatorOptions {
        &self.options
    }

    /// The number of objects so far, the track of the last one, if there is one, and the corners that have a name.
    pub fn state(&self) -> (u32, Option<&Track>, &CornerNames) {
        (self.objects, self.track.as_ref(), &self.names)
    }

    /// Goes on from a state.
    pub fn set_state(&mut self, objects: u32, track: Option<Track>, names: CornerNames) {
        (self.objects, self.track, self.names) = (objects, track, names);
    }

    /// Forgets what was seen; what had a number or a name does not share it with anything that comes.
    pub fn reset(&mut self) {
        self.track = None;
        self.names.forget();
    }

    /// The estimate from a frame: the image of the left or only camera, that of the right one where there are two, and what is
    /// known beside them.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for images of another size or kind than the detectors', for one image too many or few, and of
    /// [`FrameKnowledge::validate`]. Nothing has happened then.
    pub fn observe(
        &mut self,
        left: &Frame<'_>,
        right: Option<&Frame<'_>>,
        known: &FrameKnowledge,
    ) -> Result<CornerEstimate> {
        known.validate()?;
        if right.is_some() != self.right.is_some() {
            let (got, expected) = if right.is_some() { ("an image", "none") } else { ("none", "an image") };
            return Err(Error::argument("right image", got, format!("{expected}, as there are cameras")));
        }
        self.left.check(left)?;
        if let (Some((detector, _)), Some(right)) = (&self.right, right) {
            detector.check(right)?;
        }
        self.known = *known;
        let right_from_left =
            self.right.as_ref().map_or(Matrix3::identity(), |(_, motion)| motion.rotation.transpose());
        if let Some(track) = &mut self.track {
            track.go_on(known.turn.as_ref(), &right_from_left);
        }
        if self.track.as_ref().is_some_and(|track| track.age > self.options.forget_after) {
            self.track = None;
        }
        let frames = [left, right.unwrap_or(left)];
        let (mut estimate, mut seen, _) = self.look(left, right, 1.0)?;
        if estimate.hypotheses.is_empty() && matches!(self.left.options().method, CornerMethod::General(_)) {
            let (mut fainter, of_fainter, common) = self.look(left, right, FAINT)?;
            if let Some(common) = common.filter(|_| fainter.hypotheses.is_empty()) {
                if right.is_some() {
                    self.by_l_junctions(frames, &common, &mut fainter)?;
                } else {
                    self.by_l_junction(left, &common, &mut fainter);
                }
            }
            if !fainter.hypotheses.is_empty() {
                (estimate, seen) = (fainter, of_fainter);
            } else if fainter.verdict == CornerVerdict::LeftOpen && estimate.verdict != CornerVerdict::AgainstGravity {
                estimate.verdict = CornerVerdict::LeftOpen;
            }
        }
        if let (Some(_), Some(left), Some(right)) =
            (estimate.pose(), estimate.chosen_left.first(), estimate.chosen_right)
        {
            let own = SeenPair { left: *left, right, poses: estimate.hypotheses.clone() };
            estimate.ends = self.ends_of(frames, &estimate, &own);
        }
        self.follow(&mut estimate, &seen);
        self.place_by_scale(left, &mut estimate);
        estimate.corners = self.believed(frames, &estimate, seen);
        self.name(&mut estimate.corners);
        self.count_by_name(&mut estimate);
        Ok(estimate)
    }

    /// What a frame shows by edges whose gradients are a `share` of what the options ask for, the pairs of features that are corners, and
    /// the attitude that most edges have in common.
    fn look(
        &mut self,
        left: &Frame<'_>,
        right: Option<&Frame<'_>>,
        share: f64,
    ) -> Result<(CornerEstimate, Vec<SeenPair>, Option<CommonAttitude>)> {
        let vertical = self.vertical();
        let mut features = [Vec::new(), Vec::new()];
        let followed = self.track.as_ref().map_or(&[][..], |track| &track.corners[..]);
        let [of_left, of_right] = [0, 1].map(|side| followed.get(side).map_or(&[][..], Vec::as_slice));
        detect((&self.left, share), left, vertical.as_ref(), of_left, &mut self.scratch[0], &mut features[0])?;
        if let (Some((detector, left_from_right)), Some(right)) = (&self.right, right) {
            let vertical = vertical.map(|vertical| left_from_right.rotation.transpose() * vertical);
            detect((detector, share), right, vertical.as_ref(), of_right, &mut self.scratch[1], &mut features[1])?;
        }
        let mut estimate = CornerEstimate {
            hypotheses: Vec::new(),
            verdict: CornerVerdict::NoneFits,
            features,
            chosen_left: Vec::new(),
            chosen_right: None,
            ends: [None; 3],
            corners: Vec::new(),
            place: PlaceVerdict::Told,
            followed: self.track.is_some(),
            object: self.objects,
        };
        let starts = self.attitudes(&estimate.features)?;
        let common = self.common(&starts);
        let attitude = common.map(|common| common.camera_from_object).or(starts.attitudes.first().copied());
        let mut beside = None;
        // Of one image no corner but those that were found without an attitude says that it is one.
        if let Some(right) = right {
            beside = common.as_ref().and_then(|common| self.beside(common));
            for attitude in attitude.into_iter().chain(beside.map(|beside| beside.camera_from_object)) {
                self.add_completed([left, right], &attitude, &mut estimate.features);
                self.add_transferred([left, right], &attitude, &mut estimate.features)?;
            }
        }
        let mut seen = Vec::new();
        if estimate.features[0].is_empty() {
            estimate.verdict = CornerVerdict::NoneLeft;
        } else if right.is_some() && estimate.features[1].is_empty() {
            estimate.verdict = CornerVerdict::NoneRight;
        } else if self.right.is_some() && self.is_as_published() {
            self.by_paper(&mut estimate)?;
        } else if self.right.is_some() {
            let axes = SharedAxes { attitude: attitude.as_ref(), common: common.as_ref() };
            seen = self.by_pair([left, right.unwrap_or(left)], axes, beside.as_ref(), &mut estimate)?;
        } else {
            self.by_one(common.as_ref(), &mut estimate)?;
        }
        let corners = estimate.chosen_left.len();
        let is_beside = |best: &Hypothesis| {
            beside.is_some_and(|beside| self.are_parallel(&best.camera_from_object, &beside.camera_from_object))
        };
        let is_left_open = estimate.hypotheses.first().is_some_and(|best| self.is_left_open_amid_edges(best, corners));
        let stands_alone = |best: &Hypothesis| !is_beside(best) && self.stands_alone(best, corners);
        if is_left_open || estimate.hypotheses.first().is_some_and(stands_alone) {
            estimate.hypotheses.clear();
            (estimate.chosen_left, estimate.chosen_right) = (Vec::new(), None);
        }
        if let Some(best) = estimate.hypotheses.first() {
            let decided = best.probability >= self.options.probability_min;
            estimate.verdict = if decided { CornerVerdict::Found } else { CornerVerdict::Ambiguous };
        } else if common.is_some_and(|common| common.turned_apart.is_some()) {
            estimate.verdict = CornerVerdict::NotOfOnePair;
        } else if common.is_some_and(|common| self.is_against_gravity(&common)) {
            estimate.verdict = CornerVerdict::AgainstGravity;
        } else if is_left_open {
            estimate.verdict = CornerVerdict::LeftOpen;
        }
        Ok((estimate, seen, common))
    }

    /// Goes on to the pose of a frame, and to the corners beside it.
    fn follow(&mut self, estimate: &mut CornerEstimate, seen: &[SeenPair]) {
        let Some(pose) = estimate.pose().copied() else { return };
        if !self.track.as_ref().is_some_and(|track| track.is_of(&pose)) {
            self.objects += 1;
            estimate.object = self.objects;
        }
        let turned = self.right.as_ref().map_or(Matrix3::identity(), |(_, motion)| motion.rotation.transpose());
        let parallel = |side: usize, attitude: Matrix3<f64>| -> Vec<CornerFeature> {
            let fits = |corner: &&CornerFeature| {
                corner.seen_edges() == 3 && fits(corner, &attitude, self.options.agree_max_rad)
            };
            let mut out: Vec<CornerFeature> = Vec::new();
            for corner in estimate.features[side].iter().filter(fits) {
                // The longest rays of each vertex.
                let apart_rad = |other: &CornerFeature| other.vertex().angle(&corner.vertex());
                match out.iter_mut().find(|other| apart_rad(other) < SAME_VERTEX_RAD) {
                    Some(other) if other.support_score() < corner.support_score() => *other = *corner,
                    Some(_) => {}
                    None => out.push(*corner),
                }
            }
            out
        };
        let corners = [parallel(0, pose.camera_from_object), parallel(1, turned * pose.camera_from_object)];
        let others: Vec<Hypothesis> = seen.iter().map(|pair| pair.poses[0]).collect();
        let (down, id) = (self.told_down(), self.track.as_ref().and_then(|track| track.id));
        let next = Track::next(self.track.take(), &pose, corners, estimate.object, &others);
        let y_is_down = down.map(|down| down.dot(&pose.camera_from_object.column(1)) > 0.0);
        self.track = Some(Track { y_is_down, id, ..next });
    }

    /// Gives the corners of a frame their names. The coloured cuboid is known by its colours.
    fn name(&mut self, corners: &mut [BelievedCorner]) {
        if !self.is_one_object() {
            return self.names.give(corners, &self.options);
        }
        for corner in corners {
            corner.id = Some(1);
        }
    }

    /// Counts the object of one camera where its name is another than before: the pose is followed before it has a place.
    fn count_by_name(&mut self, estimate: &mut CornerEstimate) {
        if let (None, Some(track), Some(id)) =
            (&self.right, &mut self.track, estimate.corners.first().and_then(|corner| corner.id))
            && track.id.replace(id).is_some_and(|before| before != id)
        {
            self.objects += 1;
            (estimate.object, track.object) = (self.objects, self.objects);
        }
    }

    /// Whether edges and object are the same from frame to frame, as those of the coloured cuboid are.
    pub(super) fn is_one_object(&self) -> bool {
        !matches!(self.left.options().method, CornerMethod::General(_))
    }

    /// Whether poses are made as the paper has it.
    fn is_as_published(&self) -> bool {
        matches!(self.left.options().method, CornerMethod::Paper(_))
    }

    /// What is known of the interpretation. The coloured cuboid's corner is an outer one; the paper does not use it.
    pub(super) fn right_handed(&self) -> Option<bool> {
        let told = matches!(self.left.options().method, CornerMethod::Coloured(_));
        self.options.right_handed.or(told.then_some(true))
    }

    /// The attitude with its edges named as they were in the frame before.
    pub(super) fn named(&self, attitude: Matrix3<f64>) -> Matrix3<f64> {
        match &self.track {
            Some(track) if !self.is_one_object() && self.options.angle == IncludedAngle::RIGHT => {
                renamed(&attitude, &track.pose.camera_from_object)
            }
            _ => attitude,
        }
    }
}

/// The share of their least gradients by which edges are looked for where others make no corner: bare walls and ceilings differ little.
const FAINT: f64 = 0.5;

/// How far from where it was a corner is looked for first, in pixels: the fewer other edges are within reach the
/// better. What is not found so is looked for at `follow_px`.
const HARDLY_MOVED_PX: f64 = 3.0;

/// The corners of an image: those that are near where they were, and those that are found anew, by edges whose gradients are a share of
/// what the options ask for.
fn detect(
    (detector, share): (&CornerDetector, f64),
    frame: &Frame<'_>,
    vertical: Option<&Vector3<f64>>,
    followed: &[CornerFeature],
    scratch: &mut CornerScratch,
    out: &mut Vec<CornerFeature>,
) -> Result<()> {
    match frame {
        Frame::Gray(image) => {
            detector.detect_fainter(image, share, vertical, scratch, out)?;
            // Most hardly move, and the less is looked at the fewer other edges there are.
            let again = followed.iter().map(ExpectedCorner::of).filter_map(|last| {
                let near = detector.find_near(image, &last, Some(HARDLY_MOVED_PX), scratch);
                near.or_else(|| detector.find_near(image, &last, None, scratch))
            });
            out.extend(again);
            Ok(())
        }
        Frame::Color(image) => {
            out.extend(detector.detect_coloured(image, None, scratch)?);
            Ok(())
        }
    }
}
