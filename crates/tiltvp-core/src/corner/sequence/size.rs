//! The place of a corner before one camera that knows the length of an edge, or the size of the box.

use nalgebra::Vector3;

use super::agreement::{SAME_VERTEX_RAD, attitude_near, renamed};
use super::estimator::CornerPoseEstimator;
use super::height::SHARE_MAX;
use crate::corner::closed_form::attitude::IncludedAngle;
use crate::corner::estimate::{CornerEstimate, EdgeEnd, Hypothesis, PlaceVerdict};
use crate::corner::feature::CornerFeature;
use crate::corner::frame::Frame;
use crate::corner::general::edge_ends::along;
use crate::corner::sized::{KnownLengths, SeenEnd, SizedPose, Unseen, fit_sized};

/// A corner of the image that may be the box' own, and what is seen of the ends of its edges.
struct Candidate {
    corner: usize,
    edges: [Vector3<f64>; 3],
    /// With the lengths in shares of the distance.
    ends: Vec<(SeenEnd, f64)>,
    outside: bool,
}

impl CornerPoseEstimator {
    /// Gives the poses from one image the place that a known height or known lengths tell, and says why the first has none.
    pub(super) fn place_by_scale(&mut self, frame: &Frame<'_>, estimate: &mut CornerEstimate) {
        if self.right.is_some() || estimate.hypotheses.is_empty() {
            return;
        }
        estimate.place = match self.options.scales().first() {
            None => PlaceVerdict::NoScale,
            Some(&"camera_height_m") => self.place_by_height(estimate),
            Some(_) => self.place_by_size(frame, estimate),
        };
    }

    /// The same by lengths.
    fn place_by_size(&mut self, frame: &Frame<'_>, estimate: &mut CornerEstimate) -> PlaceVerdict {
        let named = self.is_one_object() || self.told_down().is_some();
        if !named && self.options.edge_length_m.is_some() {
            return PlaceVerdict::NotUpright;
        }
        let mut first = None;
        for place in 0..estimate.hypotheses.len() {
            let pose = estimate.hypotheses[place];
            let found = self.sized(frame, named, &pose, estimate);
            if let Ok((corner, sized)) = &found {
                self.give_place(place, *corner, sized, estimate);
            }
            first = first.or(Some(found.err().unwrap_or(PlaceVerdict::Told)));
        }
        first.unwrap_or(PlaceVerdict::Told)
    }

    /// The pose with scale near an attitude, and the corner that it is of.
    fn sized(
        &mut self,
        frame: &Frame<'_>,
        named: bool,
        pose: &Hypothesis,
        estimate: &CornerEstimate,
    ) -> Result<(usize, SizedPose), PlaceVerdict> {
        let lengths = self.known_lengths(named);
        let mut verdict = PlaceVerdict::EndHidden;
        for corner in &estimate.chosen_left {
            let Some(candidate) = self.candidate(frame, *corner, pose, estimate) else { continue };
            let found = self.fitted(&candidate, &lengths, &estimate.features[0]);
            match found {
                Ok(sized) => return Ok((*corner, sized)),
                // What was seen of the best corner says most.
                Err(why) if verdict == PlaceVerdict::EndHidden => verdict = why,
                Err(_) => {}
            }
        }
        Err(verdict)
    }

    /// The lengths of the edges x, y, z in every way that they may be theirs.
    fn known_lengths(&self, named: bool) -> Vec<[Option<f64>; 3]> {
        let Some(size_m) = self.options.box_size_m else {
            let mut lengths = [None; 3];
            lengths[self.options.known_edge as usize] = self.options.edge_length_m;
            return vec![lengths];
        };
        let orders: &[[usize; 3]] = match (self.is_one_object(), named) {
            (true, _) => &[[0, 1, 2]],
            (false, true) => &[[0, 1, 2], [2, 1, 0]],
            (false, false) => &[[0, 1, 2], [2, 1, 0], [1, 0, 2], [2, 0, 1], [0, 2, 1], [1, 2, 0]],
        };
        let mut out: Vec<[Option<f64>; 3]> = Vec::new();
        for order in orders {
            let lengths = order.map(|axis| Some(size_m[axis]));
            if !out.contains(&lengths) {
                out.push(lengths);
            }
        }
        out
    }

    /// What is seen of a corner's edges; none where it has no attitude near the pose's.
    fn candidate(
        &mut self,
        frame: &Frame<'_>,
        corner: usize,
        pose: &Hypothesis,
        estimate: &CornerEstimate,
    ) -> Option<Candidate> {
        let feature = estimate.features[0].get(corner)?;
        let edges = if estimate.chosen_left.first() == Some(&corner) {
            pose.edges
        } else {
            let angle = &self.options.angle;
            attitude_near(feature, angle, &pose.camera_from_object, self.options.agree_max_rad)?.edges
        };
        let mut candidate = Candidate { corner, edges, ends: Vec::new(), outside: false };
        for axis in 0..3 {
            match self.left.end(frame, feature, &edges, axis, &mut self.scratch[0]) {
                Ok(end) => {
                    if let Some(share) = along(&feature.vertex(), &edges[axis], &end.bearing) {
                        candidate.ends.push((end, share));
                    }
                }
                Err(Unseen::Outside) => candidate.outside = true,
                Err(Unseen::Hidden) => {}
            }
        }
        Some(candidate)
    }

    /// The pose that the lengths give a corner, in the one way in which they fit.
    fn fitted(
        &self,
        candidate: &Candidate,
        lengths: &[[Option<f64>; 3]],
        features: &[CornerFeature],
    ) -> Result<SizedPose, PlaceVerdict> {
        let corner = &features[candidate.corner];
        let is_seen = |lengths: &[Option<f64>; 3]| candidate.ends.iter().any(|(end, _)| lengths[end.axis].is_some());
        if !lengths.iter().any(is_seen) {
            return Err(if candidate.outside { PlaceVerdict::EndOutside } else { PlaceVerdict::EndHidden });
        }
        let fit = |lengths_m: &[Option<f64>; 3]| {
            let known = KnownLengths { lengths_m: *lengths_m, sigma_m: self.options.length_sigma_m };
            fit_sized(corner, &candidate.edges, &candidate.ends, &known, &self.options.angle)
                .filter(|fit| fit.misfit() <= self.options.misfit_max)
        };
        let mut fits: Vec<SizedPose> = lengths.iter().filter_map(fit).collect();
        fits.sort_by(|a, b| a.chi_square.total_cmp(&b.chi_square));
        let Some(best) = fits.first() else { return Err(PlaceVerdict::NotTheSize) };
        // Lines that miss by more than they say do so in every way of naming.
        let inflation = best.misfit().powi(2).max(1.0);
        let weight = |fit: &SizedPose| ((best.chi_square - fit.chi_square) / (2.0 * inflation)).exp();
        let all: f64 = fits.iter().map(weight).sum();
        if 1.0 / all < self.options.probability_min {
            return Err(PlaceVerdict::WhichEdge);
        }
        let mut best = *best;
        best.covariance *= inflation;
        best.length_sigmas_m = best.length_sigmas_m.map(|sigma_m| sigma_m * inflation.sqrt());
        let distance_m = best.vertex_m.norm();
        let away = best.vertex_m / distance_m;
        let place = best.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        if !(self.options.distance_min_m..=self.options.distance_max_m).contains(&distance_m) {
            return Err(PlaceVerdict::OutOfReach);
        }
        let sigma_m = away.dot(&(place * away)).sqrt();
        if sigma_m.is_nan() || sigma_m > SHARE_MAX * distance_m {
            return Err(PlaceVerdict::Uncertain);
        }
        // One length does not tell the box from others; a corner that is not of it might have the edge.
        if self.options.box_size_m.is_none() && !features.iter().all(|other| is_of(&best, &other.vertex())) {
            return Err(PlaceVerdict::WhichCorner);
        }
        Ok(best)
    }

    /// Sets the place of a hypothesis, and for the first one the corner and the ends that it is from.
    fn give_place(&self, place: usize, corner: usize, sized: &SizedPose, estimate: &mut CornerEstimate) {
        let pose = &mut estimate.hypotheses[place];
        let keeps_names = self.is_one_object() || self.options.angle != IncludedAngle::RIGHT;
        let own = sized.camera_from_object;
        pose.camera_from_object = if keeps_names { own } else { renamed(&own, &pose.camera_from_object) };
        pose.edges = sized.edges;
        pose.vertex_m = Some(sized.vertex_m);
        pose.covariance = sized.covariance;
        pose.misfit = sized.misfit();
        if place > 0 {
            return;
        }
        if let Some(at) = estimate.chosen_left.iter().position(|chosen| *chosen == corner) {
            estimate.chosen_left[..=at].rotate_right(1);
        }
        for axis in 0..3 {
            estimate.ends[axis] = sized.lengths_m[axis].map(|length_m| EdgeEnd {
                length_m,
                sigma_m: sized.length_sigmas_m[axis],
                place_m: Some(sized.vertex_m + sized.edges[axis] * length_m),
            });
        }
    }
}

/// Whether a corner that is seen at `bearing` is one of the box: its vertex, or an end of its edges that is seen, or of the faces
/// between two of them.
fn is_of(pose: &SizedPose, bearing: &Vector3<f64>) -> bool {
    let reach = |axis: usize| pose.lengths_m[axis].map(|length_m| pose.edges[axis] * length_m);
    let mut places = vec![Vector3::zeros()];
    for axis in 0..3 {
        if let Some(reach) = reach(axis) {
            let beyond: Vec<Vector3<f64>> = places.iter().map(|place| place + reach).collect();
            places.extend(beyond);
        }
    }
    let near = |place: &Vector3<f64>| (pose.vertex_m + place).angle(bearing) <= SAME_VERTEX_RAD;
    places.iter().any(near)
}
