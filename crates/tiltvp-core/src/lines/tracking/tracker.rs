//! Lines followed through successive frames: on tracks whose bearings are predicted where the robot's motion is known, else
//! matched with the last frame that shows them.

use super::assignment::{AssignmentScratch, FORBIDDEN, assign};
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
    pub fn update(
        &mut self,
        lines: &Lines,
        descriptors: &[f32],
        motion: Option<&Motion>,
        out: &mut Vec<TrackedLine>,
    ) -> Result<()> {
        lines.check_after(self.state.seen_by, self.options.matching.ordered)?;
        let seen_by = lines.frame.seen_by.or(self.state.seen_by);
        let lines = &lines.lines;
        let width = self.check(lines, descriptors, motion)?;
        let continued = match motion {
            Some(motion) => self.follow(lines, descriptors, width, motion),
            None => self.look_back(lines, descriptors, width),
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
        Ok(())
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
    /// turn that most tracks agree on.
    fn follow(&mut self, lines: &[Line], descriptors: &[f32], width: usize, motion: &Motion) -> Vec<Continued> {
        let Self { options, state, assignment, costs, distances, pairs, offsets, .. } = self;
        for edge in &mut state.followed {
            edge.parallax.predict(motion, options);
        }
        let (n, m) = (lines.len(), state.followed.len());
        let gate = |i: usize, j: usize, turn_variance: f64| {
            let edge = &state.followed[j].parallax;
            let off = wrap(lines[i].bearing_rad - edge.bearing_rad);
            (off, edge.covariance[0] + line_variance(&lines[i], options) + turn_variance)
        };
        distances.clear();
        distances.resize(n * m, f64::NAN);
        let (mut common, mut turn_variance) = (0.0, options.turn_sigma_rad.powi(2));
        for pass in 0..2 {
            costs.clear();
            for i in 0..n {
                for (j, edge) in state.followed.iter().enumerate() {
                    let (off, variance) = gate(i, j, turn_variance);
                    let squared = wrap(off - common).powi(2) / variance;
                    // A line does not change sides: what is brighter on the left stays so.
                    if squared > options.gate_sigmas.powi(2) || lines[i].polarity * edge.polarity < -0.5 {
                        costs.push(FORBIDDEN);
                        continue;
                    }
                    let distance = &mut distances[i * m + j];
                    if distance.is_nan() {
                        let values = &descriptors[i * width..(i + 1) * width];
                        *distance = descriptor_distance(values, &edge.descriptor);
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
            assign(costs, (n, m), options.new_cost, assignment, pairs);
            if pass == 0 {
                offsets.clear();
                let found = pairs.iter().enumerate().filter_map(|(i, j)| Some((i, (*j)?)));
                offsets.extend(found.map(|(i, j)| gate(i, j, 0.0)));
                (common, turn_variance) = common_offset(offsets, options.turn_sigma_rad);
            }
        }
        let frame = state.next_frame;
        let mut continued = vec![None; n];
        // The turn that tracks agree on is theirs already: a track that took its inverse distance from it would pull it along, frame
        // after frame. Each takes in its bearing by the turn as it was given.
        for (i, line) in lines.iter().enumerate() {
            let Some(j) = pairs[i] else { continue };
            let edge = &mut state.followed[j];
            continued[i] = Some((edge.track, (frame - edge.seen) as u32));
            edge.seen = frame;
            edge.parallax.covariance[0] += options.turn_sigma_rad.powi(2);
            edge.parallax.correct(line.bearing_rad, line_variance(line, options), options);
        }
        for edge in state.followed.iter_mut().filter(|edge| edge.seen != frame) {
            edge.parallax.bearing_rad = wrap(edge.parallax.bearing_rad + common);
            edge.parallax.covariance[0] += turn_variance;
        }
        continued
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
