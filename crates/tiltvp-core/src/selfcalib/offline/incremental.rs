//! A log as a bundle problem that is solved as it grows, so that loops close while the map is still nearly right.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::log::{LogBearing, LogOptions, LogStep, SortedLog};
use super::triangulation::triangulated;
use crate::geometry::wrap_angle;
use crate::interrupt::check;
use crate::selfcalib::bundle::{BundleProblem, FIRST_DAMPING, FreeParameters, Keyframe, Observation};
use crate::selfcalib::model::{BearingLoss, RelativeMotion, WheelMotion, compose};

/// Keyframes after which the log so far is solved: a fifth of those that there are, at least 5, at most 50, but in a long log a fortieth.
/// A fifth makes the work of all stages six times that of the last. At most 50 keep the drift between stages below what a loop closure can
/// mend, a fortieth the work of all stages below forty times that of the last.
const STAGE_SHARE: usize = 5;
const LEAST_STAGE: usize = 5;
const MOST_STAGE: usize = 50;
const LONG_STAGE_SHARE: usize = 40;

/// Keyframes after which a landmark that is seen again counts as another one where loops are not closed: 2 m at 4 cm a step, in
/// which odometry drifts little.
const LOOP_GAP: usize = 60;

/// Observations, and the angle between their directions, from which on a landmark is initialised, radians. At the default noise of
/// half a degree, 0.15 rad tell the distance to 8 %.
const LEAST_OBSERVATIONS: usize = 3;
const PARALLAX_RAD: f64 = 0.15;

/// Observations from which on a landmark is initialised whatever its parallax: distant ones tell the heading.
const MOST_OBSERVATIONS: usize = 12;

/// Mean disagreement of the bearings of a landmark up to which it is initialised: a share of the parallax, which the wrong mounting
/// of an early stage explains, and standard deviations, which only two landmarks with one identifier exceed.
const DISAGREEMENT_SHARE: f64 = 0.1;
const DISAGREEMENT_SIGMAS: f64 = 6.0;

/// Iterations and tolerance of the cost with which the problem is solved while it grows: the next stage goes on from there.
const STAGE_ITERATIONS: u32 = 6;
const STAGE_TOLERANCE: f64 = 1.0;

/// The loss of bearings while the log grows. Its threshold is below that of the window, since a whole log has no gate before it:
/// 5 % of right bearings have less weight.
pub(super) const ROBUST_LOSS: BearingLoss = BearingLoss::Huber(2.0);

/// Bearings of landmarks that are not initialised: keyframes and angles.
type Candidates = BTreeMap<u64, Vec<(usize, f64)>>;

/// A problem that grows step by step.
struct IncrementalProblem<'a> {
    options: &'a LogOptions,
    problem: BundleProblem,
    /// Slot and last keyframe of the landmarks that have been initialised.
    initialised: BTreeMap<u64, (usize, usize)>,
    candidates: Candidates,
    /// The keyframe of each step.
    keyframes: Vec<usize>,
    /// Keyframes after which a landmark counts as another one.
    gap: usize,
    /// Whether bearings were taken at the last keyframe.
    has_bearings: bool,
    /// The odometry since the robot stands, which is none that counts yet, and how long that is.
    standing: (WheelMotion, f64),
}

/// A problem, and what of the log is what in it.
pub(super) struct NamedProblem {
    pub(super) problem: BundleProblem,
    /// The identifier of each landmark.
    pub(super) names: Vec<u64>,
    /// The keyframe of each step.
    pub(super) keyframes: Vec<usize>,
}

/// The problem of the whole log, solved roughly as it grows. `free` is what is estimated meanwhile.
///
/// Where `loops` are closed a landmark keeps its place when it is seen again; otherwise it counts as another one after some
/// keyframes.
pub(super) fn incremental_problem(
    log: &SortedLog<'_>,
    guess: &Vector3<f64>,
    free: FreeParameters,
    loops: bool,
) -> NamedProblem {
    let mut growing = IncrementalProblem::new(log.options, guess, free, if loops { usize::MAX } else { LOOP_GAP });
    growing.add_log(log, true);
    growing.initialise_landmarks(LEAST_OBSERVATIONS, PARALLAX_RAD);
    growing.solve();
    growing.problem.reanchor();
    growing.named()
}

/// The problem of the whole log with the mounting and the poses of another problem, as far as that goes.
pub(super) fn problem_along(log: &SortedLog<'_>, other: &BundleProblem, free: FreeParameters) -> NamedProblem {
    let mut growing = IncrementalProblem::new(log.options, &other.mounting, free, usize::MAX);
    growing.add_log(log, false);
    for (keyframe, other) in growing.problem.keyframes.iter_mut().zip(&other.keyframes) {
        keyframe.pose = other.pose;
    }
    growing.named()
}

impl<'a> IncrementalProblem<'a> {
    fn new(options: &'a LogOptions, guess: &Vector3<f64>, free: FreeParameters, gap: usize) -> Self {
        let problem = BundleProblem::new(&options.filter, guess, free, ROBUST_LOSS);
        Self {
            options,
            problem,
            initialised: BTreeMap::new(),
            candidates: Candidates::new(),
            keyframes: Vec::new(),
            gap,
            has_bearings: true,
            standing: <(WheelMotion, f64)>::default(),
        }
    }

    /// Adds a log. If `solve`, landmarks are initialised and the problem is solved in stages.
    fn add_log(&mut self, log: &SortedLog<'_>, solve: bool) {
        let mut solved = 1;
        for step in log.steps() {
            let stage = (solved / STAGE_SHARE).clamp(LEAST_STAGE, MOST_STAGE.max(solved / LONG_STAGE_SHARE));
            if solve && self.has_bearings && self.problem.keyframes.len() >= solved + stage {
                self.initialise_landmarks(LEAST_OBSERVATIONS, PARALLAX_RAD);
                self.solve();
                solved = self.problem.keyframes.len();
            }
            self.add_motion(&step);
            self.keyframes.push(self.problem.keyframes.len() - 1);
            for bearing in step.bearings {
                self.add_bearing(bearing);
            }
        }
        if !self.has_bearings && self.problem.keyframes.len() > 1 {
            self.problem.keyframes.pop();
        }
    }

    /// The problem with all landmarks.
    fn named(mut self) -> NamedProblem {
        self.initialise_landmarks(1, 0.0);
        self.forget_start_distances();
        let mut names = vec![0; self.problem.landmarks.len()];
        for (name, (slot, _)) in self.initialised {
            names[slot] = name;
        }
        NamedProblem { problem: self.problem, names, keyframes: self.keyframes }
    }

    fn solve(&mut self) {
        self.problem.reanchor();
        self.problem.levenberg_marquardt_carrying(STAGE_ITERATIONS, STAGE_TOLERANCE, FIRST_DAMPING);
    }

    /// Adds the motion of a step; nothing happens at a standstill, until what it tells adds up to a motion.
    fn add_motion(&mut self, step: &LogStep<'_>) {
        let filter = &self.options.filter;
        self.standing.0 += *step.reading;
        self.standing.1 += step.seconds;
        // By the wheels that are told: `problem_along` has to make the same keyframes, and estimated ones change meanwhile.
        if self.standing.0.is_tremor(filter.wheel_base_m, filter.bearing_sigma_rad) {
            return;
        }
        let (reading, seconds) = std::mem::take(&mut self.standing);
        // Where it stood before, no longer than it takes as fast as in the last step.
        let seconds = seconds.min(step.seconds * (reading.largest_m() / step.reading.largest_m()));
        let problem = &mut self.problem;
        let odometry = RelativeMotion::from_wheels(&reading, &problem.wheels, &problem.noise);
        let Some(last) = problem.keyframes.last_mut() else { return };
        let pose = compose(&last.pose, &odometry.motion);
        if self.has_bearings {
            let keyframe = Keyframe::after(odometry, pose, seconds);
            problem.keyframes.push(Keyframe { readings: vec![reading], ..keyframe });
            self.has_bearings = false;
        } else {
            last.extend(&odometry, pose, seconds);
            last.readings.push(reading);
        }
    }

    /// Adds a bearing, unless its landmark has one at this keyframe already.
    fn add_bearing(&mut self, seen: &LogBearing) {
        let here = self.problem.keyframes.len() - 1;
        self.has_bearings = true;
        let gap = self.gap;
        if let Some((slot, last)) = self.initialised.get_mut(&seen.landmark).filter(|(_, last)| here - last <= gap) {
            if *last < here {
                self.problem.keyframes[here].observations.push(Observation::new(*slot, seen.bearing_rad));
                *last = here;
            }
            return;
        }
        let candidate = self.candidates.entry(seen.landmark).or_default();
        if candidate.last().is_some_and(|(last, _)| here - last > gap) {
            candidate.clear();
        }
        if candidate.last().is_none_or(|(keyframe, _)| *keyframe != here) {
            candidate.push((here, seen.bearing_rad));
        }
    }

    /// Initialises the candidates with so many observations that have enough parallax and agree, or that are seen for long.
    fn initialise_landmarks(&mut self, observations: usize, parallax: f64) {
        let o = &self.options.filter;
        let mut found = Vec::new();
        for (id, seen) in self.candidates.iter().filter(|(_, seen)| seen.len() >= observations) {
            check();
            let angle = self.parallax(seen);
            let (landmark, off) = triangulated(&self.problem, o, seen);
            let agree = off <= DISAGREEMENT_SHARE * angle + DISAGREEMENT_SIGMAS * self.problem.bearing_sigma;
            if observations == 1 || angle >= parallax && agree || seen.len() >= MOST_OBSERVATIONS {
                found.push((*id, landmark));
            }
        }
        self.problem.make_room(found.len());
        for (id, landmark) in found {
            let slot = self.problem.add_landmark(landmark, -o.start_distance_m.ln(), o.start_distance_log_sigma);
            let mut last = 0;
            for (keyframe, bearing) in self.candidates.remove(&id).into_iter().flatten() {
                self.problem.keyframes[keyframe].observations.push(Observation::new(slot, bearing));
                last = keyframe;
            }
            self.initialised.insert(id, (slot, last));
        }
    }

    /// Leaves the distances of landmarks with parallax to their bearings. What is known of them at the start is about their anchors, which
    /// stay where they were first seen: by it a map would hold to the place that it has, where all else leaves a long way free to bend.
    fn forget_start_distances(&mut self) {
        let mut seen = vec![Vec::new(); self.problem.landmarks.len()];
        for (at, keyframe) in self.problem.keyframes.iter().enumerate() {
            for observation in &keyframe.observations {
                seen[observation.landmark].push((at, observation.bearing));
            }
        }
        for (landmark, seen) in seen.iter().enumerate() {
            if self.parallax(seen) >= PARALLAX_RAD {
                self.problem.forget_distance(landmark);
            }
        }
    }

    /// The largest angle between the directions in which a landmark was seen.
    fn parallax(&self, seen: &[(usize, f64)]) -> f64 {
        let direction = |(keyframe, bearing): &(usize, f64)| bearing + self.problem.keyframes[*keyframe].pose.z;
        let first = seen.first().map_or(0.0, direction);
        let (low, high) = seen.iter().fold((0.0f64, 0.0f64), |(low, high), seen| {
            let d = wrap_angle(direction(seen) - first);
            (low.min(d), high.max(d))
        });
        high - low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_after_the_last_bearings_are_left_out() {
        let (options, readings) = (LogOptions::default(), [WheelMotion { left_m: 0.1, right_m: 0.1 }; 4]);
        let bearings = [0, 1].map(|step| LogBearing { step, landmark: 7, bearing_rad: 0.5 });
        let log = SortedLog::new(&options, &readings, None, &bearings).unwrap();
        let mut growing = IncrementalProblem::new(&options, &Vector3::zeros(), FreeParameters::default(), usize::MAX);
        growing.add_log(&log, false);
        // The start, and one after each of the first two motions.
        assert_eq!(growing.problem.keyframes.len(), 3);
    }

    #[test]
    fn wheels_that_tremble_make_the_keyframes_of_wheels_that_stand() {
        let options = LogOptions::default();
        let keyframes = |tremor_m: f64| {
            let mut readings = vec![WheelMotion { left_m: 0.1, right_m: 0.1 }; 102];
            for (k, reading) in readings[1..101].iter_mut().enumerate() {
                let to_and_fro = if k % 2 == 0 { tremor_m } else { -tremor_m };
                *reading = WheelMotion { left_m: to_and_fro, right_m: -to_and_fro };
            }
            let bearings: Vec<_> = (0..102).map(|step| LogBearing { step, landmark: 7, bearing_rad: 0.5 }).collect();
            let log = SortedLog::new(&options, &readings, None, &bearings).unwrap();
            let mut growing =
                IncrementalProblem::new(&options, &Vector3::zeros(), FreeParameters::default(), usize::MAX);
            growing.add_log(&log, false);
            growing.problem.keyframes
        };
        for tremor_m in [0.0, 1e-9, 1e-4] {
            let found = keyframes(tremor_m);
            assert_eq!(found.len(), 3, "{tremor_m}");
            assert!((found[2].seconds - 1.0).abs() < 0.01, "{tremor_m}: {} s", found[2].seconds);
        }
    }
}
