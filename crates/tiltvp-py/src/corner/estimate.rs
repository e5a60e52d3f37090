//! `CornerEstimate` and `CornerHypothesis`: what a frame tells, as frozen Python values.

use nalgebra::Matrix3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::corner::{self as core, Hypothesis};

use super::feature::CornerFeature;
use crate::convert;

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

fn rotation<'py>(py: Python<'py>, matrix: &Matrix3<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, matrix.transpose().as_slice()).reshape([3, 3])
}

#[pymethods]
impl CornerHypothesis {
    /// Fresh (3, 3) float64: the rotation from the object's frame (y along the vertical edge, away from the vertex, x along
    /// the edge x) to the left camera's.
    #[getter]
    fn camera_from_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rotation(py, &self.inner.camera_from_object)
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
        PyArray1::from_slice(py, self.inner.covariance.as_slice()).reshape([6, 6])
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
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (own, dict) = (&self.inner, PyDict::new(py));
        let rows: Vec<Vec<f64>> = own.camera_from_object.row_iter().map(|row| row.iter().copied().collect()).collect();
        dict.set_item("camera_from_object", rows)?;
        dict.set_item("vertex_m", own.vertex_m.map(<[f64; 3]>::from))?;
        let rows: Vec<Vec<f64>> = own.covariance.row_iter().map(|row| row.iter().copied().collect()).collect();
        dict.set_item("covariance", rows)?;
        dict.set_item("probability", own.probability)?;
        dict.set_item("right_handed", own.right_handed)?;
        dict.set_item("misfit", own.misfit)?;
        Ok(dict)
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
}
