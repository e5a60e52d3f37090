//! Where bearings were taken: at their keyframe, or somewhat earlier or later than it.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::keyframe::Observation;
use super::problem::BundleProblem;
use crate::selfcalib::model::{Viewpoint, along_arc, arc, between, between_jacobians, compose, compose_jacobians};

/// Jacobians of the pose of an observation.
pub(crate) struct ObservationPoseJacobians {
    /// By the pose of its keyframe.
    pub(crate) pose: Matrix3<f64>,
    /// By that of the keyframe's [neighbour](BundleProblem::neighbour).
    pub(crate) neighbour: Matrix3<f64>,
    /// By the time offset.
    pub(crate) offset: Vector3<f64>,
    /// By the time that the shutter takes to it from the middle of the image.
    pub(crate) shutter: Vector3<f64>,
}

/// The time in which a robot changes its velocity at a keyframe, as a share of that between keyframes: displacements of lines that are seen
/// while it does are off by half of it at most.
const CHANGE_SHARE: f64 = 0.01;

impl BundleProblem {
    /// The keyframe towards which the robot was from another one when the bearings of that were taken: the next where they are late, else
    /// the one before. None where there is none, where velocities are the wheels', and without a time offset.
    pub(crate) fn neighbour(&self, at: usize) -> Option<usize> {
        if self.as_wheels_read || !self.free.offset && self.offset_s == 0.0 {
            None
        } else if self.late {
            Some(at + 1).filter(|next| *next < self.keyframes.len())
        } else {
            at.checked_sub(1)
        }
    }

    /// Whether all bearings of a keyframe were taken at once.
    fn is_seen_at_once(&self) -> bool {
        self.shutter_s == Vector2::zeros()
    }

    /// The pose at which a bearing of a keyframe was taken, by the cosine and sine of the bearing, with its Jacobians unless all are on time
    /// for sure: the time offset later on the arc to its [neighbour](Self::neighbour), or without one on that of the wheels, and from there on
    /// as long as the shutter takes on that of the wheels, which for so little is as good.
    pub(crate) fn observation_pose(
        &self,
        at: usize,
        along: &Vector2<f64>,
    ) -> (Vector3<f64>, Option<ObservationPoseJacobians>) {
        if self.is_on_time_for_sure() {
            return (self.keyframes[at].pose, None);
        }
        let (middle, by) = self.middle_pose(at);
        let end_s = self.offset_s + self.shutter_s.dot(along);
        let ([start, end], [from_start, from_end]) = self.read_since(at, [self.offset_s, end_s]);
        let (moved, by_along) = arc(&(end - start));
        let (first, second) = compose_jacobians(&middle, &moved);
        let by_along = second * by_along;
        let jacobians = ObservationPoseJacobians {
            pose: first * by.pose,
            neighbour: first * by.neighbour,
            offset: first * by.offset + by_along * (from_end - from_start),
            shutter: by_along * from_end,
        };
        (compose(&middle, &moved), Some(jacobians))
    }

    /// The pose at which the middle of the image was taken, with its Jacobians.
    fn middle_pose(&self, at: usize) -> (Vector3<f64>, ObservationPoseJacobians) {
        let (keyframe, tau) = (&self.keyframes[at], self.offset_s);
        let (velocity, by_poses) = match self.neighbour(at) {
            Some(other) => self.velocity_between(at, other),
            None => (self.velocity_read(at, self.late), [Matrix3::zeros(); 2]),
        };
        let (moved, by_along) = arc(&(velocity * tau));
        let (first, second) = compose_jacobians(&keyframe.pose, &moved);
        let by_velocity = second * by_along * tau;
        let jacobians = ObservationPoseJacobians {
            pose: first + by_velocity * by_poses[0],
            neighbour: by_velocity * by_poses[1],
            offset: second * by_along * velocity,
            shutter: Vector3::zeros(),
        };
        (compose(&keyframe.pose, &moved), jacobians)
    }

    /// Whether all bearings were taken at their keyframes, whatever is estimated.
    fn is_on_time_for_sure(&self) -> bool {
        !self.free.offset && self.offset_s == 0.0 && !self.free.shutter && self.is_seen_at_once()
    }

    /// How far the robot goes, as the wheels read it, from a keyframe on in these times, along arcs, and its velocities then. They change
    /// smoothly, for a descent does not come to rest at a kink.
    fn read_since(&self, at: usize, times_s: [f64; 2]) -> ([Vector3<f64>; 2], [Vector3<f64>; 2]) {
        // The score of a shutter that is not estimated is of one side, as that of a time offset.
        let is_score = self.as_wheels_read && self.is_seen_at_once();
        let sides = if is_score { [self.late; 2] } else { [false, true] };
        let [arrival, departure] = sides.map(|late| self.velocity_read(at, late));
        let (mean, half) = (0.5 * (arrival + departure), 0.5 * (departure - arrival));
        let next = self.keyframes.get(at + 1).map_or(0.0, |next| next.seconds);
        let change_s = (CHANGE_SHARE * self.keyframes[at].seconds.max(next)).max(f64::MIN_POSITIVE);
        let away = times_s.map(|time: f64| time.hypot(change_s));
        ([0, 1].map(|k| mean * times_s[k] + half * away[k]), [0, 1].map(|k| mean + half * (times_s[k] / away[k])))
    }

    /// The velocity at a keyframe as the wheels read it: on departure where bearings are late, if it goes on, else on arrival.
    fn velocity_read(&self, at: usize, late: bool) -> Vector3<f64> {
        match self.keyframes.get(at + 1).filter(|_| late) {
            Some(next) => next.mean_velocity() + next.unevenness[0],
            None => self.keyframes[at].mean_velocity() + self.keyframes[at].unevenness[1],
        }
    }

    /// The velocity at a keyframe on the way to or from a neighbour, with its Jacobians by the poses of both.
    fn velocity_between(&self, at: usize, neighbour: usize) -> (Vector3<f64>, [Matrix3<f64>; 2]) {
        let (start, end) = (&self.keyframes[at.min(neighbour)], &self.keyframes[at.max(neighbour)]);
        let motion = between(&start.pose, &end.pose);
        let ((along, by_motion), (by_start, by_end)) = (along_arc(&motion), between_jacobians(&start.pose, &motion));
        if end.seconds <= 0.0 {
            return (Vector3::zeros(), [Matrix3::zeros(); 2]);
        }
        let [by_start, by_end] = [by_start, by_end].map(|by_pose| by_motion * by_pose / end.seconds);
        let mean = along / end.seconds;
        if at < neighbour {
            (mean + end.unevenness[0], [by_start, by_end])
        } else {
            (mean + end.unevenness[1], [by_end, by_start])
        }
    }

    /// Calls `each` with every observation of a keyframe, where it was seen from, and the Jacobians of the pose.
    #[inline]
    pub(crate) fn for_each_observation(
        &self,
        at: usize,
        mut each: impl FnMut(&Observation, &Viewpoint, Option<&ObservationPoseJacobians>),
    ) {
        let seen_from = |along: &Vector2<f64>| {
            let (pose, by) = self.observation_pose(at, along);
            (Viewpoint::new(&pose, &self.mounting), by)
        };
        let at_once = self.is_seen_at_once().then(|| seen_from(&Vector2::zeros()));
        for seen in &self.keyframes[at].observations {
            if let Some((view, by)) = &at_once {
                each(seen, view, by.as_ref());
            } else {
                let (view, by) = seen_from(&seen.along);
                each(seen, &view, by.as_ref());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::bundle::{FreeParameters, Keyframe};
    use crate::selfcalib::model::{BearingLoss, RelativeMotion, WheelMotion};
    use crate::selfcalib::options::SelfCalibratorOptions;

    /// Between two keyframes the robot drives slowly, then three times as fast, straight on.
    #[test]
    fn velocities_as_read_are_those_of_the_first_and_the_last_reading() {
        let options = SelfCalibratorOptions::default();
        let free = FreeParameters::default();
        let mut problem = BundleProblem::new(&options, &Vector3::zeros(), free, BearingLoss::Truncated(4.5));
        let driven = |way_m: f64| {
            let wheels = WheelMotion { left_m: way_m, right_m: way_m };
            RelativeMotion::from_wheels(&wheels, &problem.wheels, &problem.noise)
        };
        let (slow, fast) = (driven(0.1), driven(0.3));
        let mut keyframe = Keyframe::after(slow, Vector3::new(0.1, 0.0, 0.0), 1.0);
        keyframe.extend(&fast, Vector3::new(0.4, 0.0, 0.0), 1.0);
        problem.keyframes.push(keyframe);
        for (late, at, expected) in [(false, 1, 0.3), (true, 0, 0.1)] {
            assert!((problem.velocity_read(at, late) - Vector3::new(expected, 0.0, 0.0)).norm() < 1e-12, "{late}");
        }
    }
}
