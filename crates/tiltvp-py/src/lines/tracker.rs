//! `LineTracker`: identities of lines through successive frames.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::lines::{self as core, FrameMemory, TrackerOptions, TrackerState};

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
                "gate_rad" => parsed.gate_rad = convert::whole(&value, &name, "an angle")?,
                "gate_settled_rad" => parsed.gate_settled_rad = convert::whole(&value, &name, "an angle")?,
                "gate_growth_rad" => parsed.gate_growth_rad = convert::whole(&value, &name, "an angle")?,
                "bearing_weight" => parsed.bearing_weight = convert::whole(&value, &name, "a number")?,
                "extrapolate" => parsed.extrapolate = convert::whole(&value, &name, "True or False")?,
                _ if matching::set(&mut parsed.matching, &key, &value)? => {}
                _ => {
                    let expected = "look_back, gate_rad, gate_settled_rad, gate_growth_rad, bearing_weight, extrapolate, f1, f2, f3, \
                         mutual, ordered";
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
        dict.set_item("gate_rad", options.gate_rad)?;
        dict.set_item("gate_settled_rad", options.gate_settled_rad)?;
        dict.set_item("gate_growth_rad", options.gate_growth_rad)?;
        dict.set_item("bearing_weight", options.bearing_weight)?;
        dict.set_item("extrapolate", options.extrapolate)?;
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
    #[pyo3(signature = (lines, descriptors, *, yaw_change_rad=None))]
    fn update(
        &self,
        py: Python<'_>,
        lines: &Bound<'_, Lines>,
        descriptors: &Bound<'_, PyAny>,
        yaw_change_rad: Option<f64>,
    ) -> PyResult<TrackedLines> {
        let (values, n, _) = matching::descriptors(descriptors, "descriptors")?;
        let inner = lines.get().inner();
        if n != inner.lines.len() {
            return Err(invalid(format!("descriptors: {n} rows, expected {}, one for each line", inner.lines.len())));
        }
        let (frame, tracked) = call(py, || {
            let mut tracker = self.lock();
            let (frame, mut out) = (tracker.state().next_frame, Vec::new());
            tracker.update(inner, &values, yaw_change_rad, &mut out)?;
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
    fn __setstate__(&self, state: (u64, u64, Vec<Memory>)) -> PyResult<()> {
        let (next_frame, next_track, frames) = state;
        let frames: VecDeque<FrameMemory> = frames
            .into_iter()
            .map(|(bearings_rad, rates_rad, tracks, descriptors, heading_rad, stretch)| FrameMemory {
                bearings_rad,
                rates_rad,
                tracks,
                descriptors,
                heading_rad,
                stretch,
            })
            .collect();
        let mut inner = self.lock();
        let state = TrackerState { next_frame, next_track, frames };
        *inner = core::LineTracker::with_state(*inner.options(), state).map_err(|error| exception(&error))?;
        Ok(())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let make = py.import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&this.options(py)?))?;
        let tracker = this.lock();
        let memory = |frame: &FrameMemory| -> Memory {
            let f = frame.clone();
            (f.bearings_rad, f.rates_rad, f.tracks, f.descriptors, f.heading_rad, f.stretch)
        };
        let state = tracker.state();
        let frames: Vec<Memory> = state.frames.iter().map(memory).collect();
        (make, PyTuple::empty(py), (state.next_frame, state.next_track, frames)).into_pyobject(py)
    }
}

/// A frame as pickle keeps it.
type Memory = (Vec<f64>, Vec<Option<f64>>, Vec<u64>, Vec<f32>, f64, u64);
