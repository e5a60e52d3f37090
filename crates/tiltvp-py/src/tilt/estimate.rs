//! What an estimator answers, as frozen Python values.

use nalgebra::{Matrix2, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::tilt as core;

use super::report::FitReport;
use super::values;
use crate::call::invalid;
use crate::convert;

/// Keys of the dict of a `TiltEstimate`.
const KEYS: [&str; 15] = [
    "alpha_rad",
    "beta_rad",
    "roll_rad",
    "pitch_rad",
    "normal",
    "covariance_rad2",
    "confidence",
    "edge_pixels",
    "prefiltered_pixels",
    "inlier_pixels",
    "shift_px",
    "stop",
    "reason",
    "iterations",
    "residual_rms",
];

/// The tilt of one image: angles, ground normal, covariance, counts, and how the fit went.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct TiltEstimate {
    tilt: Option<Tilt>,
    covariance: Matrix2<f64>,
    /// Probability, in [0, 1], that the error is below two degrees; 0 without a tilt.
    #[pyo3(get)]
    confidence: f64,
    /// Edge pixels in the elevation band.
    #[pyo3(get)]
    edge_pixels: usize,
    /// Edge pixels that passed the prefilter.
    #[pyo3(get)]
    prefiltered_pixels: usize,
    /// Edge pixels that agree with the estimate.
    #[pyo3(get)]
    inlier_pixels: usize,
    /// The shift l of the vanishing point in pixels (eq. 20), before any factor; None but for the image-space methods.
    #[pyo3(get)]
    shift_px: Option<f64>,
    /// How the fit went.
    #[pyo3(get)]
    report: FitReport,
}

impl From<core::TiltEstimate> for TiltEstimate {
    fn from(estimate: core::TiltEstimate) -> Self {
        Self {
            tilt: estimate.tilt,
            covariance: estimate.covariance_rad2,
            confidence: estimate.confidence,
            edge_pixels: estimate.edge_pixels,
            prefiltered_pixels: estimate.prefiltered_pixels,
            inlier_pixels: estimate.inlier_pixels,
            shift_px: estimate.shift_px,
            report: FitReport::new(estimate.stop, estimate.iterations, estimate.residual_rms),
        }
    }
}

impl TiltEstimate {
    /// The part of it that a filter looks at.
    pub(super) fn measurement(&self) -> (Option<Tilt>, Matrix2<f64>, f64) {
        (self.tilt, self.covariance, self.confidence)
    }
}

#[pymethods]
impl TiltEstimate {
    /// How far the robot leans, in [0, pi] radians; NaN without a tilt.
    #[getter]
    fn alpha_rad(&self) -> f64 {
        self.tilt.map_or(f64::NAN, |tilt| tilt.alpha_rad())
    }

    /// In which direction it leans, in (-pi, pi] radians: 0 forward, +pi/2 left; NaN without a tilt.
    #[getter]
    fn beta_rad(&self) -> f64 {
        self.tilt.map_or(f64::NAN, |tilt| tilt.beta_rad())
    }

    /// Roll about x in radians, right side down positive (Rz Ry Rx, ROS REP 103); NaN without a tilt.
    #[getter]
    fn roll_rad(&self) -> f64 {
        self.tilt.map_or(f64::NAN, |tilt| tilt.roll_rad())
    }

    /// Pitch about y in radians, nose down positive (Rz Ry Rx, ROS REP 103); NaN without a tilt.
    #[getter]
    fn pitch_rad(&self) -> f64 {
        self.tilt.map_or(f64::NAN, |tilt| tilt.pitch_rad())
    }

    /// Fresh (3,) float64: the unit ground normal in the robot frame, eq. 1; NaN without a tilt.
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.vector().as_slice())
    }

    /// Fresh (2, 2) float64 in squared radians: covariance of the normal in its tangent plane; infinite without a tilt.
    #[getter]
    fn covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        convert::to_matrix2(py, &self.covariance)
    }

    /// Why the fit stopped, in a sentence: `report.reason`.
    #[getter]
    fn reason(&self) -> &str {
        &self.report.reason
    }

    /// Whether there is a tilt.
    fn __bool__(&self) -> bool {
        self.tilt.is_some()
    }

    /// The attributes by name, those of the report among them; arrays as nested lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (key, angle) in self.angles() {
            dict.set_item(key, angle)?;
        }
        dict.set_item("normal", self.vector().as_slice().to_vec())?;
        values::set_covariance(&dict, &self.covariance)?;
        dict.set_item("confidence", self.confidence)?;
        dict.set_item("edge_pixels", self.edge_pixels)?;
        dict.set_item("prefiltered_pixels", self.prefiltered_pixels)?;
        dict.set_item("inlier_pixels", self.inlier_pixels)?;
        dict.set_item("shift_px", self.shift_px)?;
        dict.update(self.report.to_dict(py)?.as_mapping())?;
        Ok(dict)
    }

    /// The estimate of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values::dict(values, &KEYS)?;
        let normal = convert::vector3(&convert::raw_item(values, "normal")?, "values[\"normal\"]")?;
        let estimate = Self {
            tilt: Tilt::from_normal(&normal),
            covariance: values::covariance(values)?,
            confidence: convert::item(values, "confidence", "a number")?,
            edge_pixels: convert::item(values, "edge_pixels", "a count")?,
            prefiltered_pixels: convert::item(values, "prefiltered_pixels", "a count")?,
            inlier_pixels: convert::item(values, "inlier_pixels", "a count")?,
            shift_px: convert::item(values, "shift_px", "a number or None")?,
            report: FitReport::read(values)?,
        };
        for (key, angle) in estimate.angles() {
            let given: f64 = convert::item(values, key, "a number")?;
            if (given - angle).abs() > 1e-9 || given.is_nan() != angle.is_nan() {
                return Err(invalid(format!("values[\"{key}\"] = {given}, expected {angle}, as the normal has it")));
            }
        }
        Ok(estimate)
    }

    fn __repr__(&self) -> String {
        match self.tilt {
            Some(tilt) => format!(
                "TiltEstimate(alpha_rad={:.5}, beta_rad={:.5}, confidence={:.3}, inlier_pixels={} of {}, {})",
                tilt.alpha_rad(),
                tilt.beta_rad(),
                self.confidence,
                self.inlier_pixels,
                self.edge_pixels,
                self.report.reason
            ),
            None => format!("TiltEstimate(no tilt: {}, edge_pixels={})", self.report.reason, self.edge_pixels),
        }
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.bits() == other.get().bits())
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        let normal: [u64; 3] = self.vector().map(f64::to_bits).into();
        (normal.to_vec(), self.edge_pixels, self.report.bits()).into_pyobject(py)?.repr()?.hash()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        (slf.get_type().getattr("from_dict")?, (slf.get().to_dict(slf.py())?,)).into_pyobject(slf.py())
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}

impl TiltEstimate {
    fn vector(&self) -> Vector3<f64> {
        self.tilt.map_or(Vector3::repeat(f64::NAN), |tilt| tilt.normal())
    }

    /// The angles that follow from the normal, by name.
    fn angles(&self) -> [(&'static str, f64); 4] {
        [
            ("alpha_rad", self.alpha_rad()),
            ("beta_rad", self.beta_rad()),
            ("roll_rad", self.roll_rad()),
            ("pitch_rad", self.pitch_rad()),
        ]
    }

    /// Everything as bits, so that equal means the same bytes and NaN equals itself.
    fn bits(&self) -> impl PartialEq + use<'_> {
        let n = self.vector();
        (
            [n.x, n.y, n.z, self.confidence].map(f64::to_bits),
            values::covariance_bits(&self.covariance),
            [self.edge_pixels, self.prefiltered_pixels, self.inlier_pixels],
            self.shift_px.map(f64::to_bits),
            self.report.bits(),
        )
    }
}

/// The edge pixels of one image, in row order: where each is, its direction and offset, and what became of it.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct EdgeElements {
    elements: Vec<core::EdgeElement>,
    /// Columns and rows of the image.
    size: (usize, usize),
}

/// An edge pixel as a pickle keeps it.
type EdgeRow = (u16, u16, f64, f64, [f32; 3], bool, bool);

impl EdgeElements {
    pub(super) fn new(elements: Vec<core::EdgeElement>, size: (usize, usize)) -> Self {
        Self { elements, size }
    }

    fn bits(&self) -> impl Iterator<Item = (u16, u16, u64, u64, [u32; 3], bool, bool)> + '_ {
        let bits = |e: &core::EdgeElement| {
            let normal = e.normal.map(f32::to_bits);
            (e.u, e.v, e.phi_rad.to_bits(), e.offset_px.to_bits(), normal, e.prefiltered, e.inlier)
        };
        self.elements.iter().map(bits)
    }
}

#[pymethods]
impl EdgeElements {
    /// Fresh (N,) uint16: columns.
    #[getter]
    fn u<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u16>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.u))
    }

    /// Fresh (N,) uint16: rows.
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u16>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.v))
    }

    /// Fresh (N,) float64: gradient directions in [0, pi) radians, eq. 16.
    #[getter]
    fn phi_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.phi_rad))
    }

    /// Fresh (N,) float64: edge offsets s in pixels, eq. 17; NaN where the lens does not see the vertical.
    #[getter]
    fn offset_px<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.offset_px))
    }

    /// Fresh (N, 3) float64: unit normals of the edges' great circles in the robot frame; NaN for the image-space methods.
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let entries = self.elements.iter().flat_map(|e| e.normal.map(f64::from));
        PyArray1::from_iter(py, entries).reshape([self.elements.len(), 3])
    }

    /// Fresh (N,) bool: the pixels that passed the prefilter.
    #[getter]
    fn prefiltered<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.prefiltered))
    }

    /// Fresh (N,) bool: the pixels that agree with the estimate.
    #[getter]
    fn inlier<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.inlier))
    }

    /// Fresh (H, W) bool: the pixels that agree with the estimate, over the image.
    #[getter]
    fn inlier_mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<bool>>> {
        let (width, height) = self.size;
        let mut mask = vec![false; width * height];
        for element in self.elements.iter().filter(|e| e.inlier) {
            if let Some(place) = mask.get_mut(usize::from(element.v) * width + usize::from(element.u)) {
                *place = true;
            }
        }
        PyArray1::from_vec(py, mask).reshape([height, width])
    }

    fn __len__(&self) -> usize {
        self.elements.len()
    }

    fn __repr__(&self) -> String {
        let inliers = self.elements.iter().filter(|e| e.inlier).count();
        format!("EdgeElements({} edge pixels, {inliers} inliers)", self.elements.len())
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = other.get();
            self.size == other.size && self.bits().eq(other.bits())
        })
    }

    /// The value of its columns and its size, for pickle.
    #[classmethod]
    fn _from_rows(_cls: &Bound<'_, PyType>, rows: Vec<EdgeRow>, size: (usize, usize)) -> Self {
        let element = |(u, v, phi_rad, offset_px, normal, prefiltered, inlier): EdgeRow| core::EdgeElement {
            u,
            v,
            phi_rad,
            offset_px,
            normal,
            prefiltered,
            inlier,
        };
        Self { elements: rows.into_iter().map(element).collect(), size }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let row = |e: &core::EdgeElement| (e.u, e.v, e.phi_rad, e.offset_px, e.normal, e.prefiltered, e.inlier);
        let this = slf.get();
        let rows: Vec<_> = this.elements.iter().map(row).collect();
        (slf.get_type().getattr("_from_rows")?, (rows, this.size)).into_pyobject(slf.py())
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}
