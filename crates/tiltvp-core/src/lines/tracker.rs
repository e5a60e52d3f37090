//! Lines followed through successive frames: matched with the last frame that shows them, up to a number of frames back.

use std::collections::VecDeque;

use super::candidates::wrap;
use super::line::{Line, Lines};
use super::matcher::{Match, MatchOptions, MatchScratch, select};
use crate::error::{Error, Result};

/// Options of the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerOptions {
    /// How many frames back a line is looked for before it is taken for a new one. Default 20.
    pub look_back: usize,
    /// How lines of two frames are matched.
    pub matching: MatchOptions,
    /// Greatest difference from the bearing that is predicted for one frame to the next, in radians, where the turn of the
    /// robot is known. Default 0.1.
    pub gate_rad: f64,
    /// The same for a line whose change of bearing is known from before, to which as much as that change is added, but no
    /// more than `gate_rad`; only with `extrapolate`. Default 0.02.
    pub gate_settled_rad: f64,
    /// How much wider the gates are for each further frame back, in radians. Default 0.005.
    pub gate_growth_rad: f64,
    /// What is added to the distance of descriptors at the gate, in proportion less for bearings closer to the predicted one:
    /// of lines that look alike the one in the right place is the nearest. Default 1.
    pub bearing_weight: f64,
    /// Whether bearings are predicted to go on changing as they did, beside the turn of the robot. Default true.
    pub extrapolate: bool,
}

impl Default for TrackerOptions {
    fn default() -> Self {
        Self {
            look_back: 20,
            matching: MatchOptions::default(),
            gate_rad: 0.1,
            gate_settled_rad: 0.02,
            gate_growth_rad: 0.005,
            bearing_weight: 1.0,
            extrapolate: true,
        }
    }
}

impl TrackerOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        self.matching.validate()?;
        if !(1..=100_000).contains(&self.look_back) {
            return Err(Error::option("look_back", self.look_back, "a whole number of frames from 1 to 100000"));
        }
        if !(self.gate_rad > 0.0 && self.gate_rad.is_finite()) {
            return Err(Error::option("gate_rad", self.gate_rad, "a positive angle"));
        }
        if !(self.gate_settled_rad > 0.0 && self.gate_settled_rad.is_finite()) {
            return Err(Error::option("gate_settled_rad", self.gate_settled_rad, "a positive angle"));
        }
        if !(self.bearing_weight >= 0.0 && self.bearing_weight.is_finite()) {
            return Err(Error::option("bearing_weight", self.bearing_weight, "a distance of at least 0"));
        }
        if !(self.gate_growth_rad >= 0.0 && self.gate_growth_rad.is_finite()) {
            return Err(Error::option("gate_growth_rad", self.gate_growth_rad, "an angle of at least 0"));
        }
        Ok(())
    }
}

/// A line of a frame and whose it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackedLine {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// Identity, from 0; never given twice.
    pub track: u64,
    /// How many frames ago the line was last seen; 0 for a new one.
    pub frames_back: u32,
    /// The line.
    pub line: Line,
}

/// What the tracker remembers of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameMemory {
    /// Bearing of each line, radians.
    pub bearings_rad: Vec<f64>,
    /// Change of each line's bearing per frame beside the turn of the robot, radians, where it is known.
    pub rates_rad: Vec<Option<f64>>,
    /// Identity of each line.
    pub tracks: Vec<u64>,
    /// Descriptors, one after the other.
    pub descriptors: Vec<f32>,
    /// Heading of the robot since the turn became known, radians.
    pub heading_rad: f64,
    /// Number of the stretch of frames between which the turns are known.
    pub stretch: u64,
}

/// All that a tracker remembers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackerState {
    /// Number of the next frame.
    pub next_frame: u64,
    /// Identity of the next new line.
    pub next_track: u64,
    /// The last frames, the latest first.
    pub frames: VecDeque<FrameMemory>,
}

/// Follows lines through successive frames (paper 001 section 9.1). The same calls give the same answers.
#[derive(Debug, Clone, Default)]
pub struct LineTracker {
    options: TrackerOptions,
    state: TrackerState,
    scratch: MatchScratch,
    matches: Vec<Match>,
    claimed: Vec<u64>,
}

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
        for frame in &state.frames {
            let n = frame.tracks.len();
            let known = frame.tracks.iter().all(|track| *track < state.next_track);
            let whole = if n == 0 { frame.descriptors.is_empty() } else { frame.descriptors.len().is_multiple_of(n) };
            if frame.bearings_rad.len() != n || frame.rates_rad.len() != n || !known || !whole {
                return Err(Error::argument("state", "a frame whose parts disagree", "a state that a tracker gave"));
            }
        }
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
    /// `descriptors` hold as many values for each line. `yaw_change_rad` is the turn of the robot since the last frame,
    /// positive to the left; where it is known, bearings are predicted and far ones are no candidates.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless there is a descriptor for each line, as wide as those before, and the turn is finite.
    pub fn update(
        &mut self,
        lines: &Lines,
        descriptors: &[f32],
        yaw_change_rad: Option<f64>,
        out: &mut Vec<TrackedLine>,
    ) -> Result<()> {
        let lines = &lines.lines;
        let width = self.check(lines, descriptors, yaw_change_rad)?;
        let latest = self.state.frames.front();
        let mut memory = FrameMemory {
            bearings_rad: lines.iter().map(|line| line.bearing_rad).collect(),
            rates_rad: vec![None; lines.len()],
            tracks: vec![u64::MAX; lines.len()],
            descriptors: descriptors.to_vec(),
            heading_rad: latest.map_or(0.0, |f| f.heading_rad) + yaw_change_rad.unwrap_or(0.0),
            stretch: latest.map_or(0, |f| f.stretch) + u64::from(yaw_change_rad.is_none()),
        };
        let mut back = vec![0u32; lines.len()];
        self.claimed.clear();
        for (k, frame) in self.state.frames.iter().enumerate() {
            if self.claimed.len() == lines.len() || width == 0 {
                break;
            }
            if frame.tracks.is_empty() {
                continue;
            }
            let steps = (k + 1) as f64;
            let turn = memory.heading_rad - frame.heading_rad;
            let options = &self.options;
            let known_turn = frame.stretch == memory.stretch;
            let rate = |j: usize| frame.rates_rad[j].filter(|_| options.extrapolate);
            let expected = |j: usize| frame.bearings_rad[j] - turn + steps * rate(j).unwrap_or(0.0);
            let gate = |j: usize| {
                let wide = options.gate_rad;
                let narrow = rate(j).map_or(wide, |rate| (options.gate_settled_rad + rate.abs()).min(wide));
                narrow + options.gate_growth_rad * k as f64
            };
            let off = |i: usize, j: usize| wrap(memory.bearings_rad[i] - expected(j)).abs();
            let allowed = |i: usize, j: usize| {
                memory.tracks[i] == u64::MAX
                    && self.claimed.binary_search(&frame.tracks[j]).is_err()
                    && (!known_turn || off(i, j) <= gate(j))
            };
            let size = (lines.len(), frame.tracks.len());
            self.scratch.measure(descriptors, &frame.descriptors, width)?;
            if known_turn {
                self.scratch.add(size, |i, j| options.bearing_weight * (off(i, j) / gate(j)).min(1.0));
            }
            select(&mut self.scratch, size, allowed, &self.options.matching, &mut self.matches);
            for found in &self.matches {
                let track = frame.tracks[found.b];
                // Without the mutual check two lines may claim one: the first has it.
                let Err(place) = self.claimed.binary_search(&track) else { continue };
                self.claimed.insert(place, track);
                memory.tracks[found.a] = track;
                back[found.a] = (k + 1) as u32;
                if known_turn {
                    let change = wrap(memory.bearings_rad[found.a] - frame.bearings_rad[found.b] + turn) / steps;
                    memory.rates_rad[found.a] = Some(change);
                }
            }
        }
        for track in memory.tracks.iter_mut().filter(|track| **track == u64::MAX) {
            *track = self.state.next_track;
            self.state.next_track += 1;
        }
        out.clear();
        out.extend(lines.iter().zip(&memory.tracks).zip(&back).map(|((line, track), back)| TrackedLine {
            frame: self.state.next_frame,
            track: *track,
            frames_back: *back,
            line: *line,
        }));
        self.state.next_frame += 1;
        self.state.frames.truncate(self.options.look_back - 1);
        self.state.frames.push_front(memory);
        Ok(())
    }

    /// The number of values of a descriptor, 0 without lines.
    fn check(&self, lines: &[Line], descriptors: &[f32], yaw_change_rad: Option<f64>) -> Result<usize> {
        if let Some(turn) = yaw_change_rad
            && !turn.is_finite()
        {
            return Err(Error::argument("yaw_change_rad", turn, "a finite angle, or none"));
        }
        let width = descriptors.len().checked_div(lines.len()).unwrap_or(0);
        if descriptors.len() != lines.len() * width || (width == 0 && !lines.is_empty()) {
            let got = format!("{} values for {} lines", descriptors.len(), lines.len());
            return Err(Error::argument("descriptors", got, "as many values for each line"));
        }
        let before = self.state.frames.iter().find(|frame| !frame.tracks.is_empty());
        if let Some(before) = before
            && width > 0
            && before.descriptors.len() / before.tracks.len() != width
        {
            let expected = format!("{}, as before", before.descriptors.len() / before.tracks.len());
            return Err(Error::argument("descriptors", format!("{width} values for each line"), expected));
        }
        Ok(width)
    }
}
