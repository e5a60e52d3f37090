//! `LineTracker`: identities of lines through successive frames.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::lines::{self as core, Followed, FrameMemory, Motion, Parallax, TrackerOptions, TrackerState};

use super::matching;
use super::values::Lines;
use crate::call::{exception, invalid};
use crate::convert::{self, Number};
use crate::options;
use crate::shared::Shared;
use crate::value::{changing, value};

value! {
    /// The lines of one frame and whose they are. Frozen.
    TrackedLines as own {
        /// Number of the frame, from 0.
        frame: u64,
        /// (N,): identity of each line, from 0, never given twice.
        track: Vec<i64>,
        /// (N,) int64: how many frames ago each line was last seen, 0 for a new one.
        frames_back: Vec<i64>,
        /// The lines.
        lines: Lines,
        /// How much farther to the left than was told the camera turned, radians, where few tracks go on by that alone and
        /// most by another turn: it was bumped, or wheels slipped. 0 elsewhere.
        jump_rad: f64,
    }
    check if [track.len(), frames_back.len()] != [lines.inner.lines.len(); 2] {
        let n = lines.inner.lines.len();
        return Err(invalid(format!("values: lists of different lengths, expected {n} of each")));
    };
    repr {
        let tracks: Vec<String> = own.track.iter().map(ToString::to_string).collect();
        format!("TrackedLines(frame {}, tracks {})", own.frame, tracks.join(", "))
    };
}

#[pymethods]
impl TrackedLines {
    fn __len__(&self) -> usize {
        self.track.len()
    }
}

/// Follows lines through successive frames: each gets the identity of the line it is, or a new one.
///
/// Where the robot's motion is known, each track's bearing is predicted from the last one and from how near the edge
/// is, as far as bearings have told, and all lines find their tracks together: by bearings, descriptors and sides, at
/// the least cost in all. Where it is not, a line is looked for in the last frame, then in the one before, up to
/// `look_back` frames. The same calls give the same answers. Comparable, copied and pickled with all that it remembers.
///
/// Raises `tiltvp.errors.InvalidInputError` for an option that is unknown or out of its domain.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct LineTracker {
    inner: Shared<core::LineTracker>,
}

changing!(LineTracker(core::LineTracker), |own| (own.options(), own.state()), {
    /// Number of the next frame.
    next_frame: u64 = own.state().next_frame,
    /// How many identities have been given.
    track_count: u64 = own.state().next_track,
});

#[pymethods]
impl LineTracker {
    #[new]
    #[pyo3(signature = (**options: "Option"))]
    fn new(options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut parsed = TrackerOptions::default();
        options::set(&mut parsed, options)?;
        let inner = core::LineTracker::new(parsed).map_err(|error| exception(&error))?;
        Ok(inner.into())
    }

    /// The next frame: its lines, their descriptors (N, K), and the robot's motion since the last one.
    ///
    /// `yaw_change_rad` is its turn, positive to the left, `distance_m` how far the middle between its wheels went
    /// along the arc, negative backwards. Raises `tiltvp.errors.InvalidInputError` for descriptors of another number or
    /// width, lines of another camera or mounting than those before, bearings and motions that are none, and a distance without a
    /// turn; the tracker is as before then.
    #[pyo3(signature = (lines: "Lines", descriptors: "NDArray[np.float32]", *, yaw_change_rad=None, distance_m=None))]
    fn update(
        &self,
        py: Python<'_>,
        lines: &Bound<'_, PyAny>,
        descriptors: &Bound<'_, PyAny>,
        yaw_change_rad: Option<Number>,
        distance_m: Option<Number>,
    ) -> PyResult<TrackedLines> {
        let lines: &Bound<'_, Lines> = convert::object(lines, "lines", "Lines")?;
        let yaw_change_rad = yaw_change_rad.map(|number| number.of("yaw_change_rad")).transpose()?;
        let distance_m = distance_m.map(|number| number.of("distance_m")).transpose()?;
        if yaw_change_rad.is_none() && distance_m.is_some() {
            return Err(invalid("distance_m: given without yaw_change_rad, expected both or neither".to_owned()));
        }
        let motion = yaw_change_rad.map(|turn_rad| Motion { turn_rad, distance_m });
        let (values, n, _) = matching::descriptors(descriptors, "descriptors")?;
        let inner = &lines.get().inner;
        if n != inner.lines.len() {
            return Err(invalid(format!("descriptors: {n} rows, expected {}, one for each line", inner.lines.len())));
        }
        let (frame, tracked, jump_rad) = self.inner.change(py, |tracker| {
            let (frame, mut out) = (tracker.state().next_frame, Vec::new());
            let jump_rad = tracker.update(inner, &values, motion.as_ref(), &mut out)?;
            Ok((frame, out, jump_rad))
        })?;
        let track = tracked.iter().map(|line| line.track as i64).collect();
        let frames_back = tracked.iter().map(|line| i64::from(line.frames_back)).collect();
        Ok(TrackedLines { frame, track, frames_back, lines: lines.get().clone(), jump_rad })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("LineTracker({})", options::shown(py, &self.inner.look(py, |tracker| *tracker.options()))?))
    }

    /// Sets what pickle has kept.
    fn __setstate__(&self, py: Python<'_>, state: (u64, u64, Vec<Memory>, Vec<Edge>, Option<u32>)) -> PyResult<()> {
        let (next_frame, next_track, frames, followed, seen_by) = state;
        let frames = frames.into_iter().map(|(tracks, descriptors)| FrameMemory { tracks, descriptors }).collect();
        let edge =
            |((track, seen), (bearing_rad, inverse_distance, covariance, is_metric), polarity, descriptor): Edge| {
                let parallax = Parallax { bearing_rad, inverse_distance, covariance, is_metric };
                Followed { track, seen, parallax, polarity, descriptor }
            };
        let followed = followed.into_iter().map(edge).collect();
        let state = TrackerState { next_frame, next_track, frames, followed, seen_by };
        self.inner.change(py, |tracker| {
            *tracker = core::LineTracker::with_state(*tracker.options(), state)?;
            Ok(())
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let make = py.import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&this.options(py)?))?;
        let tracker = this.inner.copied(py);
        let edge = |edge: &Followed| -> Edge {
            let Parallax { bearing_rad, inverse_distance, covariance, is_metric } = edge.parallax;
            let place = (bearing_rad, inverse_distance, covariance, is_metric);
            ((edge.track, edge.seen), place, edge.polarity, edge.descriptor.clone())
        };
        let state = tracker.state();
        let frames: Vec<Memory> = state.frames.iter().map(|f| (f.tracks.clone(), f.descriptors.clone())).collect();
        let followed: Vec<Edge> = state.followed.iter().map(edge).collect();
        (make, PyTuple::empty(py), (state.next_frame, state.next_track, frames, followed, state.seen_by))
            .into_pyobject(py)
    }
}

/// A frame as pickle keeps it.
type Memory = (Vec<u64>, Vec<f32>);

/// A track that is followed, as pickle keeps it.
type Edge = ((u64, u64), (f64, f64, [f64; 3], bool), f64, Vec<f32>);
