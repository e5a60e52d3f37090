//! Lines followed through successive frames: on tracks whose bearings are predicted where the robot's motion is known, else
//! matched with the last frame that shows them.

use super::assignment::{AssignmentScratch, FORBIDDEN, assign};
use super::jump::{JUMP_LINES, densest};
use super::parallax::{Motion, Parallax};
use super::tracker_state::{Followed, FrameMemory, TrackedLine, TrackerState};
use crate::error::{Error, Result};
use crate::lines::angles::wrap;
use crate::lines::description::dissimilarity::{check_finite, descriptor_distance};
use crate::lines::line::{Line, Lines};
use crate::lines::matcher::{MatchScratch, select};
use crate::lines::order::Match;
use crate::lines::tracker_options::TrackerOptions;

/// Farther no robot goes between two frames; the fourth power, which covariances have, is far from the end of the floats.
const DISTANCE_MAX_M: f64 = 1e9;

/// Tracks lines through successive frames (Scaramuzza, Siegwart and Martinelli 2009, section 9.1). The same calls give the same answers.
#[derive(Debug, Clone, Default)]
pub struct LineTracker {
    options: TrackerOptions,
    state: TrackerState,
    scratch: MatchScratch,
    matches: Vec<Match>,
    assignment: AssignmentScratch,
    costs: Vec<f64>,
    distances: Vec<f64>,
    pairs: Vec<Option<usize>>,
    offsets: Vec<(f64, f64)>,
    jumps: Vec<f64>,
}

/// A line that goes on: its track, and how many frames ago it was seen.
type Continued = Option<(u64, u32)>;

impl LineTracker {
    /// A tracker that has seen nothing.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn new(options: TrackerOptions) -> Result<Self> {
        Self::with_state(options, TrackerState::default())
    }

    /// A tracker that goes on from a state.
    ///
    /// # Errors
    /// [`Error::InvalidOption`], or [`Error::InvalidArgument`] for a state that no tracker has.
    pub fn with_state(options: TrackerOptions, state: TrackerState) -> Result<Self> {
        options.validate()?;
        state.validate()?;
        Ok(Self { options, state, ..Self::default() })
    }

    /// The options.
    pub fn options(&self) -> &TrackerOptions {
        &self.options
    }

    /// What it remembers.
    pub fn state(&self) -> &TrackerState {
        &self.state
    }

    /// The next frame: gives each of its lines the identity of the line it is, or a new one.
    ///
    /// `descriptors` hold as many values for each line. `motion` is what the robot did since the last frame: where it is known,
    /// bearings are predicted, and all lines find their tracks together; where it is not, only lines of the last frame are
    /// predicted after it.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless there is a descriptor for each line, as wide as those before, bearings are angles, which rise
    /// where matches are `ordered`, lines are of the camera and mounting of those before, the motion is one, and there are numbers left
    /// for the frame and its lines; the tracker is as before.
    ///
    /// Returns how much farther to the left than `motion` the camera turned, radians, where few lines go on by that alone and most by
    /// another turn: it was bumped, or wheels slipped. 0 elsewhere.
    pub fn update(
        &mut self,
        lines: &Lines,
        descriptors: &[f32],
        motion: Option<&Motion>,
        out: &mut Vec<TrackedLine>,
    ) -> Result<f64> {
        lines.check_after(self.state.seen_by, self.options.matching.ordered)?;
        let seen_by = lines.frame.seen_by.or(self.state.seen_by);
        let lines = &lines.lines;
        let width = self.check(lines, descriptors, motion)?;
        let (continued, jump_rad) = match motion {
            Some(motion) => self.follow(lines, descriptors, width, motion),
            None => (self.look_back(lines, descriptors, width), 0.0),
        };
        let frame = self.state.next_frame;
        out.clear();
        for (line, known) in lines.iter().zip(continued) {
            let (track, frames_back) = known.unwrap_or((self.state.next_track, 0));
            self.state.next_track = self.state.next_track.max(track + 1);
            out.push(TrackedLine { frame, track, frames_back, line: *line });
        }
        self.remember(descriptors, width, motion, out);
        self.state.seen_by = seen_by;
        Ok(jump_rad)
    }

    /// Each line on the track of the last frame that shows it (section 9.1).
    fn look_back(&mut self, lines: &[Line], descriptors: &[f32], width: usize) -> Vec<Continued> {
        let mut continued: Vec<Continued> = vec![None; lines.len()];
        let mut claimed: Vec<u64> = Vec::new();
        for (k, frame) in self.state.frames.iter().enumerate() {
            if claimed.len() == lines.len() || width == 0 {
                break;
            }
            if frame.tracks.is_empty() || self.scratch.measure(descriptors, &frame.descriptors, width).is_err() {
                continue;
            }
            let size = (lines.len(), frame.tracks.len());
            select(&mut self.scratch, size, |_, _| true, &self.options.matching, &mut self.matches);
            // Of a line whose nearest is another's no second best is taken.
            for found in &self.matches {
                let track = frame.tracks[found.b];
                let Err(place) = claimed.binary_search(&track) else { continue };
                if continued[found.a].is_none() {
                    claimed.insert(place, track);
                    continued[found.a] = Some((track, (k + 1) as u32));
                }
            }
        }
        continued
    }

    /// All lines on tracks together, by predicted bearings and descriptors: first with the turn as it is given, then with the
    /// turn that most tracks agree on. Also how much farther to the left than given the camera turned, where it jumped.
    fn follow(&mut self, lines: &[Line], descriptors: &[f32], width: usize, motion: &Motion) -> (Vec<Continued>, f64) {
        for edge in &mut self.state.followed {
            edge.parallax.predict(motion, &self.options);
        }
        self.distances.clear();
        self.distances.resize(lines.len() * self.state.followed.len(), f64::NAN);
        let sigma = self.options.turn_sigma_rad;
        self.pair(lines, descriptors, width, 0.0, sigma.powi(2));
        let jump_rad = self.jump(lines, descriptors, width);
        let Self { options, state, pairs, offsets, .. } = self;
        offsets.clear();
        offsets.extend(pairs.iter().zip(lines).filter_map(|(j, line)| {
            let edge = &state.followed[(*j)?].parallax;
            Some((wrap(line.bearing_rad - edge.bearing_rad), edge.covariance[0] + line_variance(line, options)))
        }));
        let (common, turn_variance) = common_offset(offsets, sigma);
        self.pair(lines, descriptors, width, common, turn_variance);
        let Self { options, state, pairs, .. } = self;
        let frame = state.next_frame;
        let mut continued = vec![None; lines.len()];
        // The turn that tracks agree on is theirs already: a track that took its inverse distance from it would pull it along, frame
        // after frame. Each takes in its bearing by the turn as it was given.
        for (i, line) in lines.iter().enumerate() {
            let Some(j) = pairs[i] else { continue };
            let edge = &mut state.followed[j];
            continued[i] = Some((edge.track, (frame - edge.seen) as u32));
            edge.seen = frame;
            edge.parallax.covariance[0] += sigma.powi(2);
            edge.parallax.correct(line.bearing_rad, line_variance(line, options), options);
        }
        for edge in state.followed.iter_mut().filter(|edge| edge.seen != frame) {
            edge.parallax.bearing_rad = wrap(edge.parallax.bearing_rad + common);
            edge.parallax.covariance[0] += turn_variance;
        }
        (continued, jump_rad)
    }

    /// Pairs lines and tracks whose predicted bearings are off by `common`, known with a variance. Returns how many go on.
    fn pair(&mut self, lines: &[Line], descriptors: &[f32], width: usize, common: f64, turn_variance: f64) -> usize {
        let Self { options, state, assignment, costs, distances, pairs, .. } = self;
        let m = state.followed.len();
        costs.clear();
        for (i, line) in lines.iter().enumerate() {
            for (j, edge) in state.followed.iter().enumerate() {
                let variance = edge.parallax.covariance[0] + line_variance(line, options) + turn_variance;
                let squared = wrap(line.bearing_rad - edge.parallax.bearing_rad - common).powi(2) / variance;
                if squared > options.gate_sigmas.powi(2) || changes_sides(line, edge) {
                    costs.push(FORBIDDEN);
                    continue;
                }
                let distance = &mut distances[i * m + j];
                if distance.is_nan() {
                    *distance = descriptor_distance(&descriptors[i * width..(i + 1) * width], &edge.descriptor);
                }
                costs.push(if *distance > options.descriptor_max {
                    FORBIDDEN
                } else {
                    squared
                        + (*distance / options.descriptor_sigma).powi(2)
                        + (variance / options.bearing_sigma_rad.powi(2)).ln()
                });
            }
        }
        assign(costs, (lines.len(), m), options.new_cost, assignment, pairs);
        pairs.iter().flatten().count()
    }

    /// Where fewer than half of the lines go on, and twice as many and at least half would by another turn, pairs them by that.
    /// Returns by how much that is farther to the left; 0 elsewhere.
    fn jump(&mut self, lines: &[Line], descriptors: &[f32], width: usize) -> f64 {
        let Self { options, state, pairs, jumps, .. } = self;
        let last = |edge: &&Followed| edge.seen + 1 == state.next_frame;
        let going_on = pairs.iter().flatten().count();
        let half = state.followed.iter().filter(last).count().min(lines.len()).div_ceil(2);
        if going_on >= half || half < JUMP_LINES {
            return 0.0;
        }
        jumps.clear();
        for (i, line) in lines.iter().enumerate() {
            let values = &descriptors[i * width..(i + 1) * width];
            let alike = |edge: &&Followed| descriptor_distance(values, &edge.descriptor) <= options.descriptor_max;
            let edges = state.followed.iter().filter(last).filter(|edge| !changes_sides(line, edge)).filter(alike);
            jumps.extend(edges.map(|edge| wrap(line.bearing_rad - edge.parallax.bearing_rad)));
        }
        let offset = densest(jumps, 2.0 * options.gate_sigmas * options.turn_sigma_rad);
        let sigma = options.turn_sigma_rad;
        if offset.is_nan() {
            return 0.0;
        }
        self.turn_tracks(offset);
        if self.pair(lines, descriptors, width, 0.0, sigma.powi(2)) >= half.max(2 * going_on) {
            return -offset;
        }
        self.turn_tracks(-offset);
        self.pair(lines, descriptors, width, 0.0, sigma.powi(2));
        0.0
    }

    /// Turns the predicted bearings of all tracks.
    fn turn_tracks(&mut self, by: f64) {
        for edge in &mut self.state.followed {
            edge.parallax.bearing_rad = wrap(edge.parallax.bearing_rad + by);
        }
    }

    /// Keeps the lines of a frame.
    fn remember(&mut self, descriptors: &[f32], width: usize, motion: Option<&Motion>, tracked: &[TrackedLine]) {
        let Self { options, state, .. } = self;
        let frame = state.next_frame;
        if motion.is_none() {
            state.followed.clear();
        }
        for (i, found) in tracked.iter().enumerate() {
            let values = &descriptors[i * width..(i + 1) * width];
            let place = state.followed.iter().position(|edge| edge.track == found.track);
            if let Some(edge) = place.map(|place| &mut state.followed[place]) {
                (edge.seen, edge.polarity) = (frame, found.line.polarity);
                edge.descriptor.copy_from_slice(values);
            } else {
                let is_metric = motion.is_none_or(|motion| motion.distance_m.is_some());
                let variance = line_variance(&found.line, options);
                state.followed.push(Followed {
                    track: found.track,
                    seen: frame,
                    parallax: Parallax::new(found.line.bearing_rad, variance, is_metric, options),
                    polarity: found.line.polarity,
                    descriptor: values.to_vec(),
                });
            }
        }
        state.followed.retain(|edge| frame + 1 - edge.seen <= options.look_back as u64);
        state.next_frame += 1;
        state.frames.truncate(options.look_back - 1);
        let tracks = tracked.iter().map(|line| line.track).collect();
        state.frames.push_front(FrameMemory { tracks, descriptors: descriptors.to_vec() });
    }

    /// The number of values of a descriptor, 0 without lines.
    fn check(&self, lines: &[Line], descriptors: &[f32], motion: Option<&Motion>) -> Result<usize> {
        if let Some(motion) = motion {
            if !motion.turn_rad.is_finite() {
                return Err(Error::argument("yaw_change_rad", motion.turn_rad, "a finite angle, or none"));
            }
            let within = -DISTANCE_MAX_M..=DISTANCE_MAX_M;
            if let Some(distance) = motion.distance_m.filter(|distance| !within.contains(distance)) {
                return Err(Error::argument("distance_m", distance, "a distance of at most 1e9 metres, or none"));
            }
        }
        let width = descriptors.len().checked_div(lines.len()).unwrap_or(0);
        if descriptors.len() != lines.len() * width || (width == 0 && !lines.is_empty()) {
            let got = format!("{} values for {} lines", descriptors.len(), lines.len());
            return Err(Error::argument("descriptors", got, "as many values for each line"));
        }
        check_finite("descriptors", descriptors)?;
        self.state.check_room(1, lines.len() as u64)?;
        match self.state.widths().find(|before| width > 0 && *before != width) {
            None => Ok(width),
            Some(before) => {
                let expected = format!("{before}, as before");
                Err(Error::argument("descriptors", format!("{width} values for each line"), expected))
            }
        }
    }
}

/// Whether a line is no track's, since what is brighter on the left stays so.
fn changes_sides(line: &Line, edge: &Followed) -> bool {
    line.polarity * edge.polarity < -0.5
}

/// The variance of a line's bearing.
fn line_variance(line: &Line, options: &TrackerOptions) -> f64 {
    line.sigma_rad.powi(2) + options.bearing_sigma_rad.powi(2)
}

/// What most offsets agree on, each with its variance, and its variance; before any it is zero with a standard deviation. The
/// weighted median, and the mean of those within three standard deviations of it.
fn common_offset(offsets: &mut [(f64, f64)], sigma: f64) -> (f64, f64) {
    if offsets.len() < 3 {
        return (0.0, sigma * sigma);
    }
    offsets.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * offsets.iter().map(|(_, variance)| 1.0 / variance).sum::<f64>();
    let mut sum = 0.0;
    let median = offsets.iter().find(|(_, variance)| {
        sum += 1.0 / variance;
        sum >= half
    });
    let median = median.map_or(0.0, |(off, _)| *off);
    let (mut weights, mut mean) = (sigma.powi(-2), 0.0);
    for (off, variance) in offsets.iter().filter(|(off, variance)| (off - median).powi(2) < 9.0 * variance) {
        weights += 1.0 / variance;
        mean += off / variance;
    }
    (mean / weights, 1.0 / weights)
}
