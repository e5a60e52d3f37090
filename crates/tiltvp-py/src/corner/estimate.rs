//! `CornerEstimate` and `CornerHypothesis`: what a frame tells, as frozen Python values.

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::corner::{self as core, Hypothesis, Verdict};

use super::feature::CornerFeature;
use super::matrix;
use crate::call::invalid;
use crate::convert;

/// Keys of the dict of a `CornerHypothesis`.
const KEYS: [&str; 7] =
    ["camera_from_object", "edges", "vertex_m", "covariance", "probability", "right_handed", "misfit"];

/// Keys of the dict of a `CornerEstimate`.
const ESTIMATE_KEYS: [&str; 10] = [
    "hypotheses",
    "reason",
    "features_left",
    "features_right",
    "chosen_left",
    "chosen_right",
    "edge_lengths_m",
    "edge_ends_m",
    "followed",
    "object",
];

/// One explanation of what is seen: an attitude, from two cameras also a place, and how likely it is.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct CornerHypothesis {
    inner: Hypothesis,
}

/// What one frame tells of a corner: the likeliest pose if one stands out, and all hypotheses.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct CornerEstimate {
    inner: core::CornerEstimate,
}

impl CornerEstimate {
    pub(super) fn new(inner: core::CornerEstimate) -> Self {
        Self { inner }
    }
}

impl CornerHypothesis {
    pub(super) fn new(inner: &Hypothesis) -> Self {
        Self { inner: *inner }
    }

    pub(super) fn inner(&self) -> &Hypothesis {
        &self.inner
    }
}

#[pymethods]
impl CornerHypothesis {
    /// Fresh (3, 3) float64: the rotation from the object's frame (y along the vertical edge, away from the vertex, x along
    /// the edge x) to the left camera's.
    #[getter]
    fn camera_from_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.camera_from_object)
    }

    /// Fresh (3, 3) float64, rows x, y, z: directions of the corner's edges away from its vertex, left camera's frame. The
    /// frame of `camera_from_object` keeps its axes from frame to frame, whatever the edges are called.
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        convert::to_rows(py, &self.inner.edges.map(<[f64; 3]>::from), false)
    }

    /// Fresh (3,) float64: the vertex in the left camera's frame, metres; None from one image.
    #[getter]
    fn vertex_m<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.inner.vertex_m.map(|vertex| PyArray1::from_slice(py, vertex.as_slice()))
    }

    /// Fresh (3,) float64: where the left camera is in the object's frame, metres; None from one image.
    #[getter]
    fn camera_in_object_m<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.inner.camera_in_object_m().map(|place| PyArray1::from_slice(py, place.as_slice()))
    }

    /// Fresh (6, 6) float64: covariance of the attitude's rotation vector (left camera's frame, radians) and of the vertex
    /// (metres; zero from one image).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.covariance)
    }

    /// The probability that it is this one, in [0, 1].
    #[getter]
    fn probability(&self) -> f64 {
        self.inner.probability
    }

    /// Whether the edges x, y, z are a right-handed triple, as of an outer corner.
    #[getter]
    fn right_handed(&self) -> bool {
        self.inner.right_handed
    }

    /// Root mean square misfit per degree of freedom in standard deviations of the rays; 0 for a single feature.
    #[getter]
    fn misfit(&self) -> f64 {
        self.inner.misfit
    }

    fn __repr__(&self) -> String {
        let place =
            self.inner.vertex_m.map_or(String::new(), |v| format!(", vertex ({:.3}, {:.3}, {:.3}) m", v.x, v.y, v.z));
        format!("CornerHypothesis(probability {:.3}{place})", self.inner.probability)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner == other.get().inner)
    }

    /// Plain numbers and lists, good for JSON.
    pub(super) fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (own, dict) = (&self.inner, PyDict::new(py));
        dict.set_item("camera_from_object", matrix::nested(&own.camera_from_object))?;
        dict.set_item("edges", own.edges.map(<[f64; 3]>::from))?;
        dict.set_item("vertex_m", own.vertex_m.map(<[f64; 3]>::from))?;
        dict.set_item("covariance", matrix::nested(&own.covariance))?;
        dict.set_item("probability", own.probability)?;
        dict.set_item("right_handed", own.right_handed)?;
        dict.set_item("misfit", own.misfit)?;
        Ok(dict)
    }

    /// The hypothesis that `to_dict` wrote.
    #[classmethod]
    pub(super) fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        convert::known_keys(values, &KEYS)?;
        let edges: [[f64; 3]; 3] = convert::item(values, "edges", "three rows of three numbers")?;
        let vertex_m: Option<[f64; 3]> = convert::item(values, "vertex_m", "three numbers or None")?;
        Ok(Self {
            inner: Hypothesis {
                camera_from_object: matrix::item(values, "camera_from_object")?,
                edges: edges.map(Vector3::from),
                vertex_m: vertex_m.map(Vector3::from),
                covariance: matrix::item(values, "covariance")?,
                probability: convert::item(values, "probability", "a number")?,
                right_handed: convert::item(values, "right_handed", "True or False")?,
                misfit: convert::item(values, "misfit", "a number")?,
            },
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        (slf.get_type().getattr("from_dict")?, (slf.get().to_dict(py)?,)).into_pyobject(py)
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}

#[pymethods]
impl CornerEstimate {
    /// The pose, a `CornerHypothesis`; None where none stands out.
    #[getter]
    fn pose(&self) -> Option<CornerHypothesis> {
        self.inner.pose().map(|pose| CornerHypothesis { inner: *pose })
    }

    /// All hypotheses, the likeliest first.
    #[getter]
    fn hypotheses(&self) -> Vec<CornerHypothesis> {
        self.inner.hypotheses.iter().map(|hypothesis| CornerHypothesis { inner: *hypothesis }).collect()
    }

    /// The probability of the likeliest hypothesis; 0 where there is none.
    #[getter]
    fn confidence(&self) -> f64 {
        self.inner.hypotheses.first().map_or(0.0, |best| best.probability)
    }

    /// Why there is no pose; empty where there is one.
    #[getter]
    fn reason(&self) -> &'static str {
        self.inner.verdict.reason()
    }

    /// The corners of the left or only image.
    #[getter]
    fn features_left(&self) -> Vec<CornerFeature> {
        self.inner.features[0].iter().map(CornerFeature::new).collect()
    }

    /// The corners of the right image.
    #[getter]
    fn features_right(&self) -> Vec<CornerFeature> {
        self.inner.features[1].iter().map(CornerFeature::new).collect()
    }

    /// Which corners of the left image the pose is from, the one that is its object first.
    #[getter]
    fn chosen_left(&self) -> Vec<usize> {
        self.inner.chosen_left.clone()
    }

    /// Which corner of the right image it is from, or None.
    #[getter]
    fn chosen_right(&self) -> Option<usize> {
        self.inner.chosen_right
    }

    /// Fresh (3,) float64: how long the edges x, y, z are, metres, to where lines along the others meet them; NaN where no
    /// image shows that. From two grey images and with right angles.
    #[getter]
    fn edge_lengths_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let lengths = self.inner.ends.map(|end| end.map_or(f64::NAN, |end| end.length_m));
        PyArray1::from_slice(py, &lengths)
    }

    /// Fresh (3, 3) float64, rows x, y, z: where these edges end in the left camera's frame, metres, from both images alone; NaN
    /// where only one of them shows it, or none.
    #[getter]
    fn edge_ends_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let place = |end: core::EdgeEnd| end.place_m.map(<[f64; 3]>::from);
        convert::to_rows(py, &self.inner.ends.map(|end| end.and_then(place).unwrap_or([f64::NAN; 3])), false)
    }

    /// Whether the pose of a frame before was a prior.
    #[getter]
    fn followed(&self) -> bool {
        self.inner.followed
    }

    /// The number of the corner that is the object, from 1: it grows where another corner has become the object; from one
    /// camera, whose attitude all parallel corners share, only after the poses before were forgotten.
    #[getter]
    fn object(&self) -> u32 {
        self.inner.object
    }

    fn __bool__(&self) -> bool {
        self.inner.pose().is_some()
    }

    fn __repr__(&self) -> String {
        let count = self.inner.hypotheses.len();
        match self.inner.pose() {
            Some(pose) => format!("CornerEstimate(probability {:.3}, {count} hypotheses)", pose.probability),
            None => format!("CornerEstimate(no pose: {}, {count} hypotheses)", self.inner.verdict.reason()),
        }
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner == other.get().inner)
    }

    /// Plain numbers and lists, good for JSON.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (own, dict) = (&self.inner, PyDict::new(py));
        let hypotheses = own.hypotheses.iter().map(|inner| CornerHypothesis { inner: *inner }.to_dict(py));
        dict.set_item("hypotheses", hypotheses.collect::<PyResult<Vec<_>>>()?)?;
        dict.set_item("reason", own.verdict.reason())?;
        for (key, features) in ["features_left", "features_right"].into_iter().zip(&own.features) {
            let features = features.iter().map(|inner| CornerFeature::new(inner).to_dict(py));
            dict.set_item(key, features.collect::<PyResult<Vec<_>>>()?)?;
        }
        dict.set_item("chosen_left", own.chosen_left.clone())?;
        dict.set_item("chosen_right", own.chosen_right)?;
        dict.set_item("edge_lengths_m", own.ends.map(|end| end.map(|end| end.length_m)))?;
        let place = |end: core::EdgeEnd| end.place_m.map(<[f64; 3]>::from);
        dict.set_item("edge_ends_m", own.ends.map(|end| end.and_then(place)))?;
        dict.set_item("followed", own.followed)?;
        dict.set_item("object", own.object)?;
        Ok(dict)
    }

    /// The estimate that `to_dict` wrote.
    #[classmethod]
    fn from_dict(cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        convert::known_keys(values, &ESTIMATE_KEYS)?;
        let dicts = |key: &str| convert::item::<Vec<Bound<'_, PyDict>>>(values, key, "a list of dicts");
        let features = |key: &str| -> PyResult<Vec<core::CornerFeature>> {
            dicts(key)?.iter().map(|values| Ok(*CornerFeature::from_dict(cls, values)?.inner())).collect()
        };
        let reason: String = convert::item(values, "reason", "a string")?;
        let verdict = Verdict::ALL.into_iter().find(|verdict| verdict.reason() == reason);
        let verdict =
            verdict.ok_or_else(|| invalid(format!("reason: {reason:?}, expected one that `reason` gives")))?;
        let lengths: [Option<f64>; 3] = convert::item(values, "edge_lengths_m", "three numbers or None")?;
        let places: [Option<[f64; 3]>; 3] = convert::item(values, "edge_ends_m", "three places or None")?;
        let end =
            |k: usize| lengths[k].map(|length_m| core::EdgeEnd { length_m, place_m: places[k].map(Vector3::from) });
        let hypotheses = dicts("hypotheses")?;
        let hypotheses = hypotheses.iter().map(|values| Ok(CornerHypothesis::from_dict(cls, values)?.inner));
        Ok(Self {
            inner: core::CornerEstimate {
                hypotheses: hypotheses.collect::<PyResult<_>>()?,
                verdict,
                features: [features("features_left")?, features("features_right")?],
                chosen_left: convert::item(values, "chosen_left", "whole numbers")?,
                chosen_right: convert::item(values, "chosen_right", "a whole number or None")?,
                ends: [end(0), end(1), end(2)],
                followed: convert::item(values, "followed", "True or False")?,
                object: convert::item(values, "object", "a whole number")?,
            },
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        (slf.get_type().getattr("from_dict")?, (slf.get().to_dict(py)?,)).into_pyobject(py)
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}
