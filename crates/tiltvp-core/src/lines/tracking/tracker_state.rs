//! The state of a tracker of lines, and a line with its track.

use std::collections::VecDeque;

use super::parallax::Parallax;
use crate::error::{Error, Result};
use crate::lines::line::Line;

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
    /// Identity of each line.
    pub tracks: Vec<u64>,
    /// Descriptors, one after the other.
    pub descriptors: Vec<f32>,
}

/// What the tracker remembers of a track that is followed by its bearing.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    /// Identity.
    pub track: u64,
    /// Number of the frame that showed it last.
    pub seen: u64,
    /// Where it is expected in the latest frame.
    pub parallax: Parallax,
    /// [`Line::polarity`] when it was seen last.
    pub polarity: f64,
    /// Descriptor when it was seen last.
    pub descriptor: Vec<f32>,
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
    /// Tracks of the frames since the motion is known, and of the one before.
    pub followed: Vec<Followed>,
    /// The [`fingerprint`](crate::lines::fingerprint) of the camera and the mounting that all lines were found with; none where that is
    /// not known.
    pub seen_by: Option<u32>,
}

/// The largest number of a frame or a track, half of what a number can be: whoever counts to there will not see the end.
const COUNT_MAX: u64 = u64::MAX / 2;

/// Whether no two are alike.
fn differ(tracks: &[u64]) -> bool {
    let mut sorted = tracks.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).all(|two| two[0] != two[1])
}

impl TrackerState {
    /// Whether its parts agree with each other.
    pub(crate) fn validate(&self) -> Result<()> {
        let is_known = |track: &u64| *track < self.next_track;
        let is_whole = |frame: &FrameMemory| match frame.tracks.len() {
            0 => frame.descriptors.is_empty(),
            n => {
                frame.descriptors.len().is_multiple_of(n) && frame.tracks.iter().all(is_known) && differ(&frame.tracks)
            }
        };
        let followed: Vec<_> = self.followed.iter().map(|edge| edge.track).collect();
        let is_true = |edge: &Followed| is_known(&edge.track) && edge.seen < self.next_frame;
        self.check_room(0, 0)?;
        if !self.frames.iter().all(is_whole) || !self.followed.iter().all(is_true) || !differ(&followed) {
            return Err(Error::argument(
                "state",
                "frames or tracks whose parts disagree",
                "a state that a tracker gave",
            ));
        }
        Ok(())
    }

    /// Whether so many frames and lines more can be counted.
    pub(crate) fn check_room(&self, frames: u64, lines: u64) -> Result<()> {
        for (name, number, more) in [("next_frame", self.next_frame, frames), ("next_track", self.next_track, lines)] {
            if number > COUNT_MAX.saturating_sub(more) {
                return Err(Error::argument(name, number, "a number below 2^63"));
            }
        }
        Ok(())
    }

    /// How many values the descriptors of each frame with lines have, and of each track.
    pub(crate) fn widths(&self) -> impl Iterator<Item = usize> {
        let frames = self.frames.iter().filter(|frame| !frame.tracks.is_empty());
        let widths = frames.map(|frame| frame.descriptors.len() / frame.tracks.len());
        widths.chain(self.followed.iter().map(|edge| edge.descriptor.len()))
    }
}
