//! How many of the odometry's motions, and of its turns, the bearings contradict.

use crate::geometry::wrap_angle;
use crate::selfcalib::bundle::BundleProblem;

/// What a turn of the odometry adds up to before it is compared, radians: ten times the noise of a heading that ten bearings of half
/// a degree tell, and less than any turn that a calibration rests on.
const TURN_RAD: f64 = 0.1;

/// Net turn from which on such a run counts as one, radians: below, it went to and fro.
const LEAST_NET_RAD: f64 = 0.05;

/// Share of a turn by which it may be wrong: a wheel base is known to a few tenths, a sign or a unit makes twice the turn.
const WRONG_SHARE: f64 = 0.5;

/// How many motions and turns there are, and how many the bearings contradict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contradictions {
    /// Motions from one pose with bearings to the next.
    pub motions: usize,
    /// Those that differ from the odometry by more than five standard deviations.
    pub contradicted_motions: usize,
    /// Turns by some 0.1 rad by the odometry.
    pub turns: usize,
    /// Those that differ from the odometry by more than half of themselves, whatever the noise.
    pub contradicted_turns: usize,
}

impl Contradictions {
    /// Whether most turns are contradicted, of at least three.
    pub fn most_turns(&self) -> bool {
        self.turns >= 3 && 2 * self.contradicted_turns > self.turns
    }
}

impl BundleProblem {
    /// The motions and turns that the solution contradicts.
    pub(crate) fn contradictions(&self) -> Contradictions {
        let mut found = Contradictions::default();
        let (mut way, mut told, mut solved) = (0.0, 0.0, 0.0);
        for to in 1..self.keyframes.len() {
            let (before, keyframe) = (&self.keyframes[to - 1], &self.keyframes[to]);
            if keyframe.observations.is_empty() {
                continue;
            }
            found.motions += 1;
            found.contradicted_motions += usize::from(self.slipped(to));
            way += keyframe.odometry.motion.z.abs();
            told += keyframe.odometry.motion.z;
            solved += wrap_angle(keyframe.pose.z - before.pose.z);
            if way >= TURN_RAD {
                if told.abs() >= LEAST_NET_RAD {
                    found.turns += 1;
                    found.contradicted_turns += usize::from((solved - told).abs() > WRONG_SHARE * told.abs());
                }
                (way, told, solved) = (0.0, 0.0, 0.0);
            }
        }
        found
    }
}
