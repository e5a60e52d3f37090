//! `LineTracker`: identities of lines through successive frames.

use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::lines::{self as core, Followed, FrameMemory, Motion, Parallax, TrackerOptions, TrackerState};

use super::matching;
use super::values::Lines;
use crate::call::{call, exception, invalid};
use crate::convert;

/// The lines of one frame and whose they are.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct TrackedLines {
    frame: u64,
    tracked: Vec<core::TrackedLine>,
    lines: Py<Lines>,
}

#[pymethods]
impl TrackedLines {
    /// Number of the frame, from 0.
    #[getter]
    fn frame(&self) -> u64 {
        self.frame
    }

    /// (N,) int64: identity of each line, never given twice.
    #[getter]
    fn track<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.tracked.iter().map(|line| line.track as i64))
    }

    /// (N,) int64: how many frames ago each line was last seen, 0 for a new one.
    #[getter]
    fn frames_back<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.tracked.iter().map(|line| i64::from(line.frames_back)))
    }

    /// The lines.
    #[getter]
    fn lines(&self, py: Python<'_>) -> Py<Lines> {
        self.lines.clone_ref(py)
    }

    fn __len__(&self) -> usize {
        self.tracked.len()
    }

    fn __repr__(&self) -> String {
        let tracks: Vec<String> = self.tracked.iter().map(|line| line.track.to_string()).collect();
        format!("TrackedLines(frame {}, tracks {})", self.frame, tracks.join(", "))
    }
}

/// Follows lines through successive frames.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct LineTracker {
    inner: Mutex<core::LineTracker>,
}

impl LineTracker {
    fn lock(&self) -> MutexGuard<'_, core::LineTracker> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn copied(&self) -> Self {
        Self { inner: Mutex::new(self.lock().clone()) }
    }
}

#[pymethods]
impl LineTracker {
    #[new]
    #[pyo3(signature = (**options))]
    fn new(options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut parsed = TrackerOptions::default();
        for (key, value) in options.into_iter().flat_map(PyDictMethods::iter) {
            let key: String = key.extract()?;
            let name = format!("option {key}");
            match key.as_str() {
                "look_back" => parsed.look_back = convert::whole(&value, &name, "a whole number from 1")?,
                "nearest_m" => parsed.nearest_m = convert::whole(&value, &name, "a distance")?,
                "camera_m" => parsed.camera_m = convert::whole(&value, &name, "x and y")?,
                "turn_sigma_rad" => parsed.turn_sigma_rad = convert::whole(&value, &name, "an angle")?,
                "distance_sigma" => parsed.distance_sigma = convert::whole(&value, &name, "a share")?,
                "rate_sigma_rad" => parsed.rate_sigma_rad = convert::whole(&value, &name, "an angle")?,
                "bearing_sigma_rad" => parsed.bearing_sigma_rad = convert::whole(&value, &name, "an angle")?,
                "gate_sigmas" => parsed.gate_sigmas = convert::whole(&value, &name, "a number")?,
                "descriptor_sigma" => parsed.descriptor_sigma = convert::whole(&value, &name, "a distance")?,
                "descriptor_max" => parsed.descriptor_max = convert::whole(&value, &name, "a distance")?,
                "new_cost" => parsed.new_cost = convert::whole(&value, &name, "a number")?,
                _ if matching::set(&mut parsed.matching, &key, &value)? => {}
                _ => {
                    let expected = "look_back, nearest_m, camera_m, turn_sigma_rad, distance_sigma, rate_sigma_rad, \
                         bearing_sigma_rad, gate_sigmas, descriptor_sigma, descriptor_max, new_cost, f1, f2, f3, mutual, \
                         ordered";
                    return Err(invalid(format!("{name}: unknown, expected one of {expected}")));
                }
            }
        }
        let inner = core::LineTracker::new(parsed).map_err(|error| exception(&error))?;
        Ok(Self { inner: Mutex::new(inner) })
    }

    /// The options in force, by name, defaults included; a fresh dict, good as keywords.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let options = *self.lock().options();
        let dict = PyDict::new(py);
        dict.set_item("look_back", options.look_back)?;
        dict.set_item("nearest_m", options.nearest_m)?;
        dict.set_item("camera_m", PyTuple::new(py, options.camera_m)?)?;
        dict.set_item("turn_sigma_rad", options.turn_sigma_rad)?;
        dict.set_item("distance_sigma", options.distance_sigma)?;
        dict.set_item("rate_sigma_rad", options.rate_sigma_rad)?;
        dict.set_item("bearing_sigma_rad", options.bearing_sigma_rad)?;
        dict.set_item("gate_sigmas", options.gate_sigmas)?;
        dict.set_item("descriptor_sigma", options.descriptor_sigma)?;
        dict.set_item("descriptor_max", options.descriptor_max)?;
        dict.set_item("new_cost", options.new_cost)?;
        matching::in_force(&dict, &options.matching)?;
        Ok(dict)
    }

    /// Number of the next frame.
    #[getter]
    fn next_frame(&self) -> u64 {
        self.lock().state().next_frame
    }

    /// How many identities have been given.
    #[getter]
    fn track_count(&self) -> u64 {
        self.lock().state().next_track
    }

    /// The next frame.
    #[pyo3(signature = (lines, descriptors, *, yaw_change_rad=None, distance_m=None))]
    fn update(
        &self,
        py: Python<'_>,
        lines: &Bound<'_, Lines>,
        descriptors: &Bound<'_, PyAny>,
        yaw_change_rad: Option<f64>,
        distance_m: Option<f64>,
    ) -> PyResult<TrackedLines> {
        if yaw_change_rad.is_none() && distance_m.is_some() {
            return Err(invalid("distance_m: given without yaw_change_rad, expected both or neither".to_owned()));
        }
        let motion = yaw_change_rad.map(|turn_rad| Motion { turn_rad, distance_m });
        let (values, n, _) = matching::descriptors(descriptors, "descriptors")?;
        let inner = lines.get().inner();
        if n != inner.lines.len() {
            return Err(invalid(format!("descriptors: {n} rows, expected {}, one for each line", inner.lines.len())));
        }
        let (frame, tracked) = call(py, || {
            let mut tracker = self.lock();
            let (frame, mut out) = (tracker.state().next_frame, Vec::new());
            tracker.update(inner, &values, motion.as_ref(), &mut out)?;
            Ok((frame, out))
        })?;
        Ok(TrackedLines { frame, tracked, lines: lines.clone().unbind() })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let options = self.options(py)?;
        let words: Vec<String> =
            options.iter().map(|(key, value)| Ok(format!("{key}={}", value.repr()?))).collect::<PyResult<_>>()?;
        Ok(format!("LineTracker({})", words.join(", ")))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let Ok(other) = other.cast::<Self>() else { return false };
        // One at a time: a tracker may be compared with itself.
        let mine = self.lock().clone();
        let other = other.get().lock();
        (mine.options(), mine.state()) == (other.options(), other.state())
    }

    fn __copy__(&self) -> Self {
        self.copied()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.copied()
    }

    /// Sets what pickle has kept.
    fn __setstate__(&self, state: (u64, u64, Vec<Memory>, Vec<Edge>)) -> PyResult<()> {
        let (next_frame, next_track, frames, followed) = state;
        let frames = frames.into_iter().map(|(tracks, descriptors)| FrameMemory { tracks, descriptors }).collect();
        let edge = |((track, seen), (bearing_rad, nearness, covariance, is_metric), polarity, descriptor): Edge| {
            let parallax = Parallax { bearing_rad, nearness, covariance, is_metric };
            Followed { track, seen, parallax, polarity, descriptor }
        };
        let followed = followed.into_iter().map(edge).collect();
        let mut inner = self.lock();
        let state = TrackerState { next_frame, next_track, frames, followed };
        *inner = core::LineTracker::with_state(*inner.options(), state).map_err(|error| exception(&error))?;
        Ok(())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let make = py.import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&this.options(py)?))?;
        let tracker = this.lock();
        let edge = |edge: &Followed| -> Edge {
            let Parallax { bearing_rad, nearness, covariance, is_metric } = edge.parallax;
            let place = (bearing_rad, nearness, covariance, is_metric);
            ((edge.track, edge.seen), place, edge.polarity, edge.descriptor.clone())
        };
        let state = tracker.state();
        let frames: Vec<Memory> = state.frames.iter().map(|f| (f.tracks.clone(), f.descriptors.clone())).collect();
        let followed: Vec<Edge> = state.followed.iter().map(edge).collect();
        (make, PyTuple::empty(py), (state.next_frame, state.next_track, frames, followed)).into_pyobject(py)
    }
}

/// A frame as pickle keeps it.
type Memory = (Vec<u64>, Vec<f32>);

/// A track that is followed, as pickle keeps it.
type Edge = ((u64, u64), (f64, f64, [f64; 3], bool), f64, Vec<f32>);
