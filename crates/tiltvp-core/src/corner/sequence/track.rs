//! The track of a corner: the last pose, its corners in the images, and other corners of the same object.

use nalgebra::{Matrix3, Vector3};

use crate::corner::estimate::Hypothesis;
use crate::corner::feature::CornerFeature;

/// The share of its distance by which a vertex moves at most in the camera's frame from one frame to the next: 1 m/s at
/// 10 frames a second and 1 m.
pub(super) const MOVED: f64 = 0.1;

/// How far apart places of one corner of the object may be, as a share of its distance from the camera: three standard
/// deviations of a triangulated vertex (1 %).
pub(super) const SAME_PLACE: f64 = 0.03;

/// In how many frames a corner has to be in one place of the object before it can replace the tracked one: chance
/// repeats once, hardly twice.
pub(super) const SEEN_MIN: u32 = 3;

/// How much less likely another corner of the object is than the tracked one. The order of tracked, known and new
/// corners is what matters, which a test holds: between 0.15 and 0.6 the poses of a real box and of rendered rooms are
/// the same.
const KNOWN_CORNER: f64 = 0.3;

/// How much less likely a corner is that has not been seen before: a tenth of [`KNOWN_CORNER`]. Between 0.015 and 0.06
/// the poses of a real box and of rendered rooms are the same.
const NEW_CORNER: f64 = 0.03;

/// How many times as far as in the frame before a vertex may move to count half: a hand speeds up by as much in a tenth of a
/// second. Doubled, the attitude of a real box turns 0.222 instead of 0.206 degrees from frame to frame.
const PACES: f64 = 2.0;

/// The share of its distance that is added to that: the noise of a vertex.
const PACE_MIN: f64 = 0.005;

/// How many times as far as in the frame before a vertex may move and be the same corner; more than [`PACES`], so that a hard
/// limit comes after the soft one.
pub(super) const JUMP: f64 = 3.0;

/// The share of its distance that is added to that: the noise of a vertex, and a camera that starts to move.
pub(super) const JUMP_MIN: f64 = 0.02;

/// Most other corners that are remembered, those seen most often, which bounds the memory; images give at most 12 each.
const OTHERS_MAX: usize = 32;

/// Another corner of the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownCorner {
    /// Where it is in the object's frame, metres.
    pub place_m: Vector3<f64>,
    /// In how many frames it was seen.
    pub seen: u32,
}

/// The state of an estimator from frame to frame: the last pose, its corners in the images, and other corners of the object.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The last pose.
    pub pose: Hypothesis,
    /// The corners along its axes in the left and in the right image.
    pub corners: [Vec<CornerFeature>; 2],
    /// How many frames ago it was.
    pub age: u32,
    /// The number of the corner that is the object.
    pub object: u32,
    /// Other corners of the object, those seen most often first.
    pub others: Vec<KnownCorner>,
    /// How far the vertex moved in the camera's frame from the pose before to the last one, as a share of its distance.
    pub pace: f64,
    /// Covariance of how the camera has turned since the last pose, its frame now, square radians: the pose is turned by it. None
    /// where that is not known of every frame since.
    pub turned: Option<Matrix3<f64>>,
    /// Whether the upright axis of the pose points down, where it was ever told which way is down.
    pub y_is_down: Option<bool>,
    /// The name of the corner that is the object, where one camera knows it.
    pub id: Option<u32>,
}

impl Track {
    /// Whether a pose is one of the same corner: from one image any corner of the same upright world is.
    pub(crate) fn is_of(&self, pose: &Hypothesis) -> bool {
        match (self.pose.vertex_m, pose.vertex_m) {
            (Some(last), Some(vertex)) => {
                let reach = (JUMP * self.pace * f64::from(self.age.max(1)) + JUMP_MIN).min(MOVED);
                (vertex - last).norm() <= reach * last.norm()
            }
            _ => true,
        }
    }

    /// How likely a pose is the next one, from 0 to 1: near where the same corner was, or, which counts less, near where another
    /// one of the object has been seen before, or, if it `fits_alone`, of any other one. None if it is none of them.
    pub(crate) fn likelihood(&self, pose: &Hypothesis, fits_alone: bool) -> Option<f64> {
        let (Some(last), Some(vertex)) = (self.pose.vertex_m, pose.vertex_m) else { return Some(1.0) };
        let known = self.others.iter().filter(|other| other.seen >= SEEN_MIN);
        let others = known.map(|other| (KNOWN_CORNER, last + self.pose.camera_from_object * other.place_m));
        // Motion is much the same from frame to frame.
        let usual = (PACES * self.pace + PACE_MIN).min(MOVED);
        let near = |(factor, place): (f64, Vector3<f64>)| {
            let moved = (vertex - place).norm() / place.norm();
            (moved <= MOVED).then(|| factor / (1.0 + (moved / usual).powi(2)))
        };
        std::iter::once((1.0, last))
            .chain(others)
            .filter_map(near)
            .chain(fits_alone.then_some(NEW_CORNER))
            .max_by(f64::total_cmp)
    }

    /// The track after a frame with a pose, from the `corners` of its images; `seen` are the poses of all corners of that
    /// frame that fit.
    pub(crate) fn next(
        before: Option<Self>,
        pose: &Hypothesis,
        corners: [Vec<CornerFeature>; 2],
        object: u32,
        seen: &[Hypothesis],
    ) -> Self {
        let moved = |track: &Self| {
            let (last, vertex) = (track.pose.vertex_m?, pose.vertex_m?);
            track.is_of(pose).then(|| (vertex - last).norm() / last.norm() / f64::from(track.age.max(1)))
        };
        // The camera moves on as before where another corner has become the object.
        let pace = before.as_ref().map_or(MOVED, |track| moved(track).unwrap_or(track.pace));
        let mut others = before.map_or_else(Vec::new, |track| track.seen_from(pose));
        if let Some(vertex) = pose.vertex_m {
            let nearness_m = SAME_PLACE * vertex.norm();
            let mut again = vec![false; others.len()];
            for place in seen.iter().filter_map(|other| other.vertex_m) {
                let place_m = pose.camera_from_object.tr_mul(&(place - vertex));
                let is_here = |other: &KnownCorner| (other.place_m - place_m).norm() <= nearness_m;
                if place_m.norm() <= nearness_m {
                    continue;
                }
                match others.iter().position(is_here) {
                    Some(known) if !again[known] => {
                        again[known] = true;
                        let other = &mut others[known];
                        other.seen += 1;
                        other.place_m += (place_m - other.place_m) / f64::from(other.seen);
                    }
                    Some(_) => {}
                    None => {
                        others.push(KnownCorner { place_m, seen: 1 });
                        again.push(true);
                    }
                }
            }
            others.sort_by_key(|other| std::cmp::Reverse(other.seen));
            others.truncate(OTHERS_MAX);
        }
        let (turned, y_is_down, id) = (Some(Matrix3::zeros()), None, None);
        Self { pose: *pose, corners, age: 0, object, others, pace, turned, y_is_down, id }
    }

    /// The other corners as seen from the one that a pose is of, which may be one of them.
    fn seen_from(mut self, pose: &Hypothesis) -> Vec<KnownCorner> {
        let (Some(last), Some(vertex)) = (self.pose.vertex_m, pose.vertex_m) else { return Vec::new() };
        if self.is_of(pose) {
            return self.others;
        }
        let off_m = |other: &KnownCorner| (last + self.pose.camera_from_object * other.place_m - vertex).norm();
        let nearest = (0..self.others.len()).min_by(|a, b| off_m(&self.others[*a]).total_cmp(&off_m(&self.others[*b])));
        let Some(origin) = nearest.filter(|place| off_m(&self.others[*place]) <= reach_m(&vertex)) else {
            return Vec::new();
        };
        let origin_m = self.others[origin].place_m;
        // The corner that was followed is one of the others from now on.
        self.others[origin] = KnownCorner { place_m: Vector3::zeros(), seen: SEEN_MIN };
        for other in &mut self.others {
            other.place_m -= origin_m;
        }
        self.others
    }
}

/// How far a vertex can have moved from a place since the last pose.
fn reach_m(place: &Vector3<f64>) -> f64 {
    MOVED * place.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6;

    fn pose(vertex_m: Vector3<f64>) -> Hypothesis {
        Hypothesis {
            camera_from_object: Matrix3::identity(),
            edges: [Vector3::x(), Vector3::y(), Vector3::z()],
            vertex_m: Some(vertex_m),
            covariance: Matrix6::identity(),
            probability: 1.0,
            right_handed: true,
            misfit: 0.5,
        }
    }

    /// A corner two metres away that moves to the right, and another one half a metre beside it.
    fn followed(frames: u32) -> Track {
        let none = || [Vec::new(), Vec::new()];
        let mut track = None;
        for frame in 0..frames {
            let own = pose(Vector3::new(0.01 * f64::from(frame), 0.0, 2.0));
            let other = pose(Vector3::new(0.5 + 0.01 * f64::from(frame), 0.0, 2.0));
            track = Some(Track::next(track, &own, none(), 1, &[own, other]));
        }
        track.unwrap()
    }

    #[test]
    fn the_followed_corner_comes_before_known_ones_and_these_before_new_ones() {
        let track = followed(SEEN_MIN);
        let at = |x: f64, fits_alone| track.likelihood(&pose(Vector3::new(x, 0.0, 2.0)), fits_alone);
        let (same, jumped, known) = (at(0.03, false).unwrap(), at(0.15, false).unwrap(), at(0.53, false).unwrap());
        assert!(same > 2.0 * jumped && same > 2.0 * known && known > at(-0.5, true).unwrap());
        assert_eq!(at(-0.5, false), None);
        assert!(track.is_of(&pose(Vector3::new(0.03, 0.0, 2.0))) && !track.is_of(&pose(Vector3::new(0.53, 0.0, 2.0))));
        // A corner that was seen too rarely counts as new.
        assert_eq!(followed(SEEN_MIN - 1).likelihood(&pose(Vector3::new(0.52, 0.0, 2.0)), false), None);
    }

    /// 0.01 of 2 metres in a frame; 0.06 in three frames, of which two had no pose.
    #[test]
    fn the_pace_is_the_share_of_the_distance_in_a_frame() {
        let track = followed(3);
        assert!((track.pace - 0.005).abs() < 1e-4);
        let after = pose(Vector3::new(0.08, 0.0, 2.0));
        let track = Track::next(Some(Track { age: 3, ..track }), &after, [Vec::new(), Vec::new()], 1, &[]);
        assert!((track.pace - 0.01).abs() < 1e-4, "{}", track.pace);
    }

    #[test]
    fn a_corner_that_stands_in_knows_the_one_before() {
        let track =
            Track::next(Some(followed(5)), &pose(Vector3::new(0.55, 0.0, 2.0)), [Vec::new(), Vec::new()], 2, &[]);
        assert!(track.likelihood(&pose(Vector3::new(0.05, 0.0, 2.0)), false).is_some());
        assert_eq!(track.likelihood(&pose(Vector3::new(1.05, 0.0, 2.0)), false), None);
        // A new corner knows no others.
        let track =
            Track::next(Some(followed(5)), &pose(Vector3::new(-0.7, 0.0, 2.0)), [Vec::new(), Vec::new()], 2, &[]);
        assert_eq!(track.likelihood(&pose(Vector3::new(0.05, 0.0, 2.0)), false), None);
    }
}
