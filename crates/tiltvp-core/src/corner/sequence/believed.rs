//! Which corners of a frame are believed: those seen in both images, in one way, with one interpretation that stands out.

use nalgebra::{Matrix3, Vector3};

use super::agreement::SAME_VERTEX_RAD;
use super::estimator::CornerPoseEstimator;
use super::seen_pair::SeenPair;
use super::track::SAME_PLACE;
use crate::corner::closed_form::attitude::IncludedAngle;
use crate::corner::estimate::{BelievedCorner, CornerEstimate, EdgeAngle, EdgeEnd, Hypothesis};
use crate::corner::feature::CornerFeature;
use crate::corner::frame::Frame;
use crate::corner::general::edge_ends::edge_ends;
use crate::geometry::RigidMotion;

/// How much worse another match of a corner may fit and still leave it open which one is right: twice the misfit, of noise that has
/// the same in both. What two matches share in misfit does not tell them apart.
pub(super) const OPEN: f64 = 2.0;

/// The least misfit that is told from none, in standard deviations: that of rays as good as their covariances.
const MISFIT_MIN: f64 = 1.0;

/// How far an angle between edges may be from that of the pose, radians: 20 degrees, beyond which a pose is another interpretation
/// or the images do not show the same corner; and beyond as many standard deviations.
const ANGLE_OFF_MAX: f64 = 0.35;
const ANGLE_OFF_SIGMAS: f64 = 4.0;

/// The least sine of the angle between the planes of an edge in both images with which they tell its direction: 6 degrees. A real pair
/// whose calibration is a quarter of a degree off has angles of 145 degrees at right-angled corners from planes nearer to each other.
const PLANES_APART: f64 = 0.1;

/// Standard deviation of the turn between two cameras, radians: 0.1 degrees. Calibrations do not say how well it is known, and
/// planes that nearly coincide enlarge it.
const TURN_SIGMA: f64 = 0.002;

/// The largest standard deviation with which an angle between edges is told, radians: 10 degrees. Beyond it the planes of an edge
/// in both images nearly coincide, and first order does no more.
const ANGLE_SIGMA_MAX: f64 = 0.17;

impl CornerPoseEstimator {
    /// The corners of a frame that are believed, that of the pose first, each without a name yet.
    pub(super) fn believed(
        &mut self,
        frames: [&Frame<'_>; 2],
        estimate: &CornerEstimate,
        seen: Vec<SeenPair>,
    ) -> Vec<BelievedCorner> {
        let mut out = Vec::new();
        if estimate.pose().is_some()
            && let Some(left) = estimate.chosen_left.first()
        {
            let angles = self.angles_of(estimate, *left, estimate.chosen_right, &estimate.hypotheses[0]);
            let (hypotheses, right) = (estimate.hypotheses.clone(), estimate.chosen_right);
            out.push(BelievedCorner { id: None, hypotheses, left: *left, right, ends: estimate.ends, angles });
        }
        let vertex = |side: usize, which: usize| estimate.features[side][which].vertex();
        let is_of_pose = |pair: &SeenPair| {
            let same = |side: usize, own: usize, other: usize| {
                own == other || vertex(side, own).angle(&vertex(side, other)) < SAME_VERTEX_RAD
            };
            estimate.chosen_right.is_some_and(|right| same(1, right, pair.right))
                || estimate.chosen_left.first().is_some_and(|left| same(0, *left, pair.left))
        };
        let beside = seen.into_iter().filter(|pair| !is_of_pose(pair)).collect();
        for pair in self.one_to_one(&estimate.features, beside) {
            let angles = self.angles_of(estimate, pair.left, Some(pair.right), &pair.poses[0]);
            if !are_of(&angles, &pair.poses[0].edges) {
                continue;
            }
            let ends = self.ends_of(frames, estimate, &pair);
            let SeenPair { left, right, poses: hypotheses } = pair;
            out.push(BelievedCorner { id: None, hypotheses, left, right: Some(right), ends, angles });
        }
        out
    }

    /// The pairs whose features are of no other pair that fits about as well and is elsewhere, the best first.
    pub(super) fn one_to_one(&self, features: &[Vec<CornerFeature>; 2], seen: Vec<SeenPair>) -> Vec<SeenPair> {
        let same = |side: usize, a: usize, b: usize| {
            a == b || features[side][a].vertex().angle(&features[side][b].vertex()) < SAME_VERTEX_RAD
        };
        let misfit = |pair: &SeenPair| pair.poses[0].misfit.max(MISFIT_MIN);
        let support =
            |pair: &SeenPair| features[0][pair.left].support_score().min(features[1][pair.right].support_score());
        let mut order = seen;
        // The best of each corner comes before what is left of its features.
        order.sort_by(|a, b| misfit(a).total_cmp(&misfit(b)).then(support(b).total_cmp(&support(a))));
        let mut taken: Vec<(SeenPair, bool)> = Vec::new();
        for pair in order {
            let mut is_new = true;
            for (other, is_sure) in &mut taken {
                if same(0, other.left, pair.left) || same(1, other.right, pair.right) {
                    is_new = false;
                    let near = together(&other.poses[0], &pair.poses[0]);
                    *is_sure &= near || misfit(&pair) > OPEN * misfit(other);
                }
            }
            if is_new {
                taken.push((pair, true));
            }
        }
        let believed =
            |(pair, is_sure): &(SeenPair, bool)| *is_sure && pair.poses[0].probability >= self.options.probability_min;
        taken.into_iter().filter(believed).map(|(pair, _)| pair).collect()
    }

    /// Where the edges of a pair end.
    pub(super) fn ends_of(
        &mut self,
        frames: [&Frame<'_>; 2],
        estimate: &CornerEstimate,
        pair: &SeenPair,
    ) -> [Option<EdgeEnd>; 3] {
        let (Some((detector, left_from_right)), Some(pose), [Frame::Gray(left), Frame::Gray(right)]) =
            (&self.right, pair.poses.first(), frames)
        else {
            return [None; 3];
        };
        if self.options.angle != IncludedAngle::RIGHT {
            return [None; 3];
        }
        let corners = [&estimate.features[0][pair.left], &estimate.features[1][pair.right]];
        let [first, second] = &mut self.scratch;
        let [from_left, right_from_left] = [RigidMotion::identity(), left_from_right.inverse()];
        let mut ends = [
            self.left.ends(left, corners[0], pose, &from_left, first),
            detector.ends(right, corners[1], pose, &right_from_left, second),
        ];
        for axis in 0..3 {
            let is_shown = match [&ends[0][axis], &ends[1][axis]] {
                [Some(end), None] => detector.shows_end(right, corners[1], pose, &right_from_left, (axis, end), second),
                [None, Some(end)] => self.left.shows_end(left, corners[0], pose, &from_left, (axis, end), first),
                _ => true,
            };
            if !is_shown {
                for ends in &mut ends {
                    ends[axis] = None;
                }
            }
        }
        edge_ends(ends, left_from_right, pose)
    }

    /// The angles between the edges of a corner that both images show.
    fn angles_of(
        &self,
        estimate: &CornerEstimate,
        left: usize,
        right: Option<usize>,
        pose: &Hypothesis,
    ) -> [Option<EdgeAngle>; 3] {
        let (Some((_, left_from_right)), Some(right)) = (&self.right, right) else { return [None; 3] };
        let corners = [&estimate.features[0][left], &estimate.features[1][right]];
        angles(corners, &left_from_right.rotation, &pose.edges).map(|angle| {
            // Edges that miss the pose by more than they say do so here.
            let scaled = |angle: EdgeAngle| EdgeAngle { sigma_rad: angle.sigma_rad * pose.misfit.max(1.0), ..angle };
            angle.map(scaled).filter(|angle| angle.sigma_rad <= ANGLE_SIGMA_MAX)
        })
    }
}

/// Whether the angles that both images tell are about those between the edges of a pose.
fn are_of(angles: &[Option<EdgeAngle>; 3], edges: &[Vector3<f64>; 3]) -> bool {
    angles.iter().zip([(1, 2), (2, 0), (0, 1)]).all(|(angle, (i, j)): (_, (usize, usize))| {
        let off = |angle: &EdgeAngle| (angle.angle_rad - edges[i].angle(&edges[j])).abs();
        angle.is_none_or(|angle| off(&angle) <= ANGLE_OFF_MAX.max(ANGLE_OFF_SIGMAS * angle.sigma_rad))
    })
}

/// Whether two poses place a corner at the same place.
fn together(a: &Hypothesis, b: &Hypothesis) -> bool {
    match (a.vertex_m, b.vertex_m) {
        (Some(a), Some(b)) => (a - b).norm() <= SAME_PLACE * a.norm(),
        _ => false,
    }
}

/// The angles between the edges y and z, z and x, x and y: each edge is where its planes in both images meet, on the side of
/// `edges`; to first order in the errors of all planes and of the turn between the cameras.
fn angles(
    corners: [&CornerFeature; 2],
    left_from_right: &Matrix3<f64>,
    edges: &[Vector3<f64>; 3],
) -> [Option<EdgeAngle>; 3] {
    let direction = |axis: usize| -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let rays = corners.map(|corner| &corner.rays()[axis]);
        let (left, right) = (rays[0].normal, left_from_right * rays[1].normal);
        let spread = [rays[0].covariance_3d(), left_from_right * rays[1].covariance_3d() * left_from_right.transpose()];
        let meeting = left.cross(&right);
        let sine = meeting.norm();
        let edge = meeting.try_normalize(PLANES_APART)?;
        let across = (Matrix3::identity() - edge * edge.transpose()) / sine;
        let by = [-across * right.cross_matrix(), across * left.cross_matrix()];
        let turn = Matrix3::identity() * TURN_SIGMA.powi(2);
        let covariance = by[0] * spread[0] * by[0].transpose() + by[1] * (spread[1] + turn) * by[1].transpose();
        Some((if edge.dot(&edges[axis]) < 0.0 { -edge } else { edge }, covariance))
    };
    let found = [0, 1, 2].map(direction);
    [(1, 2), (2, 0), (0, 1)].map(|(i, j): (usize, usize)| {
        let ((a, of_a), (b, of_b)) = (found[i]?, found[j]?);
        let sine = a.cross(&b).norm();
        let variance = (b.dot(&(of_a * b)) + a.dot(&(of_b * a))) / (sine * sine);
        Some(EdgeAngle { angle_rad: sine.atan2(a.dot(&b)), sigma_rad: variance.sqrt() })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn angles_are_those_of_the_edges_whatever_they_are() {
        let turned = *Rotation3::from_euler_angles(0.5, 0.6, 0.1).matrix();
        let edges = [Vector3::x(), Vector3::new(0.1, 1.0, 0.0).normalize(), Vector3::new(0.3, 0.0, 1.0).normalize()]
            .map(|edge| turned * edge);
        let (vertex, baseline) = (Vector3::new(0.1, -0.2, 2.0), Vector3::new(0.9, 0.6, 0.0));
        let seen = |from: Vector3<f64>| {
            let toward = edges.map(|edge| vertex - from + 0.3 * edge);
            CornerFeature::from_bearings(&(vertex - from), &toward).unwrap()
        };
        let corners = [seen(Vector3::zeros()), seen(baseline)];
        let found = angles([&corners[0], &corners[1]], &Matrix3::identity(), &edges);
        for (angle, (i, j)) in found.iter().zip([(1, 2), (2, 0), (0, 1)]) {
            let off = angle.unwrap().angle_rad - edges[i].angle(&edges[j]);
            assert!(off.abs() < 1e-9, "{off}");
        }
    }
}
