//! What an estimator answers, as frozen Python values.

use nalgebra::{Matrix2, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::robust::Stop;
use tiltvp_core::tilt as core;

use crate::call::invalid;
use crate::convert;

/// The tilt of one image.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct TiltEstimate {
    tilt: Option<Tilt>,
    covariance: Matrix2<f64>,
    #[pyo3(get)]
    confidence: f64,
    #[pyo3(get)]
    edge_pixels: usize,
    #[pyo3(get)]
    prefiltered_pixels: usize,
    #[pyo3(get)]
    inlier_pixels: usize,
    #[pyo3(get)]
    shift_px: Option<f64>,
    #[pyo3(get)]
    residual_rms: f64,
    #[pyo3(get)]
    iterations: u32,
    #[pyo3(get)]
    stop: String,
    #[pyo3(get)]
    reason: String,
}

impl From<core::TiltEstimate> for TiltEstimate {
    fn from(estimate: core::TiltEstimate) -> Self {
        let stop = match estimate.stop {
            Stop::Confident { .. } => "confident",
            Stop::TrialLimit { .. } => "trial-limit",
            Stop::Converged { .. } => "converged",
            Stop::Settled { .. } => "settled",
            Stop::IterationLimit { .. } => "iteration-limit",
            Stop::TooFew { .. } => "too-few",
            Stop::NoModel { .. } => "no-model",
            Stop::OutOfReach { .. } => "out-of-reach",
        };
        Self {
            tilt: estimate.tilt,
            covariance: estimate.covariance_rad2,
            confidence: estimate.confidence,
            edge_pixels: estimate.edge_pixels,
            prefiltered_pixels: estimate.prefiltered_pixels,
            inlier_pixels: estimate.inlier_pixels,
            shift_px: estimate.shift_px,
            residual_rms: estimate.residual_rms,
            iterations: estimate.iterations,
            stop: stop.to_owned(),
            reason: estimate.stop.to_string(),
        }
    }
}

#[pymethods]
impl TiltEstimate {
    #[getter]
    fn alpha_rad(&self) -> f64 {
        self.tilt.map_or(f64::NAN, |tilt| tilt.alpha_rad())
    }

    #[getter]
    fn beta_rad(&self) -> f64 {
        self.tilt.map_or(f64::NAN, |tilt| tilt.beta_rad())
    }

    #[getter]
    fn roll_rad(&self) -> f64 {
        self.tilt.map_or(f64::NAN, |tilt| tilt.roll_rad())
    }

    #[getter]
    fn pitch_rad(&self) -> f64 {
        self.tilt.map_or(f64::NAN, |tilt| tilt.pitch_rad())
    }

    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.vector().as_slice())
    }

    #[getter]
    fn covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        convert::to_matrix2(py, &self.covariance)
    }

    /// How the fit went: stop, reason, iterations, residual_rms.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("stop", &self.stop)?;
        dict.set_item("reason", &self.reason)?;
        dict.set_item("iterations", self.iterations)?;
        dict.set_item("residual_rms", self.residual_rms)?;
        Ok(dict)
    }

    fn __bool__(&self) -> bool {
        self.tilt.is_some()
    }

    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("alpha_rad", self.alpha_rad())?;
        dict.set_item("beta_rad", self.beta_rad())?;
        dict.set_item("roll_rad", self.roll_rad())?;
        dict.set_item("pitch_rad", self.pitch_rad())?;
        dict.set_item("normal", self.vector().as_slice().to_vec())?;
        let c = &self.covariance;
        dict.set_item("covariance_rad2", [[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]])?;
        dict.set_item("confidence", self.confidence)?;
        dict.set_item("edge_pixels", self.edge_pixels)?;
        dict.set_item("prefiltered_pixels", self.prefiltered_pixels)?;
        dict.set_item("inlier_pixels", self.inlier_pixels)?;
        dict.set_item("shift_px", self.shift_px)?;
        dict.update(self.report(py)?.as_mapping())?;
        Ok(dict)
    }

    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        let item = |key: &str| {
            values
                .get_item(key)?
                .ok_or_else(|| invalid(format!("values: \"{key}\" is missing, expected a dict as to_dict makes it")))
        };
        let number = |key: &str| -> PyResult<f64> {
            let value = item(key)?;
            value.extract().map_err(|_| invalid(format!("values[\"{key}\"] = {value}, expected a number")))
        };
        let count = |key: &str| -> PyResult<usize> {
            let value = item(key)?;
            value.extract().map_err(|_| invalid(format!("values[\"{key}\"] = {value}, expected a count")))
        };
        let text = |key: &str| -> PyResult<String> {
            let value = item(key)?;
            value.extract().map_err(|_| invalid(format!("values[\"{key}\"] = {value}, expected text")))
        };
        let normal = convert::vector3(&item("normal")?, "values[\"normal\"]")?;
        let (covariance, _) = convert::rows::<2>(&item("covariance_rad2")?, "values[\"covariance_rad2\"]")?;
        let [[a, b], [c, d]] = covariance[..] else {
            return Err(invalid("values[\"covariance_rad2\"]: expected shape (2, 2)".to_owned()));
        };
        let shift = item("shift_px")?;
        Ok(Self {
            tilt: Tilt::from_normal(&normal),
            covariance: Matrix2::new(a, b, c, d),
            confidence: number("confidence")?,
            edge_pixels: count("edge_pixels")?,
            prefiltered_pixels: count("prefiltered_pixels")?,
            inlier_pixels: count("inlier_pixels")?,
            shift_px: if shift.is_none() { None } else { Some(number("shift_px")?) },
            residual_rms: number("residual_rms")?,
            iterations: u32::try_from(count("iterations")?).unwrap_or(u32::MAX),
            stop: text("stop")?,
            reason: text("reason")?,
        })
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
                self.reason
            ),
            None => format!("TiltEstimate(no tilt: {}, edge_pixels={})", self.reason, self.edge_pixels),
        }
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.bits() == other.get().bits())
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        self.bits().0.to_vec().into_pyobject(py)?.call_method0("__repr__")?.hash()
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

    /// Everything as bits, so that equal means the same bytes and NaN equals itself.
    fn bits(&self) -> ([u64; 9], [usize; 3], Option<u64>, u32, &str, &str) {
        let (n, c) = (self.vector(), self.covariance);
        let numbers = [n.x, n.y, n.z, c[(0, 0)], c[(0, 1)], c[(1, 0)], c[(1, 1)], self.confidence, self.residual_rms];
        (
            numbers.map(f64::to_bits),
            [self.edge_pixels, self.prefiltered_pixels, self.inlier_pixels],
            self.shift_px.map(f64::to_bits),
            self.iterations,
            &self.stop,
            &self.reason,
        )
    }
}

/// The edge pixels of one image.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct EdgeElements {
    elements: Vec<core::EdgeElement>,
    size: (usize, usize),
}

impl EdgeElements {
    pub(super) fn new(elements: Vec<core::EdgeElement>, size: (usize, usize)) -> Self {
        Self { elements, size }
    }
}

#[pymethods]
impl EdgeElements {
    #[getter]
    fn u<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u16>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.u))
    }

    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u16>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.v))
    }

    #[getter]
    fn phi_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.phi_rad))
    }

    #[getter]
    fn offset_px<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.offset_px))
    }

    #[getter]
    fn prefiltered<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.prefiltered))
    }

    #[getter]
    fn inlier<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.elements.iter().map(|e| e.inlier))
    }

    /// `(H, W)` bool: the pixels that agree with the estimate.
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
}
