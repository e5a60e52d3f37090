//! What a filter answers, as frozen Python values: `FilteredTilt` and `FilterStep`.

use nalgebra::{Matrix2, Vector3};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::tilt::{self as core, Verdict};

use crate::call::invalid;
use crate::convert;

/// Keys of the dict of a `FilteredTilt`.
const TILT_KEYS: [&str; 10] = [
    "alpha_rad",
    "beta_rad",
    "roll_rad",
    "pitch_rad",
    "normal",
    "covariance_rad2",
    "confidence",
    "sigma_rad",
    "sigma_max_rad",
    "reason",
];

/// Keys of the dict of a `FilterStep`.
const STEP_KEYS: [&str; 4] = ["accepted", "verdict", "reason", "nis"];

/// A tilt as a filter holds it to be, with how sure it is.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct FilteredTilt {
    tilt: Option<Tilt>,
    covariance: Matrix2<f64>,
    /// Probability, in [0, 1], that the error is below two degrees if it is normal with that covariance.
    #[pyo3(get)]
    confidence: f64,
    /// One standard deviation in radians in any one direction: the root of half the covariance's trace.
    #[pyo3(get)]
    sigma_rad: f64,
    /// The largest standard deviation of an answer, in radians.
    #[pyo3(get)]
    sigma_max_rad: f64,
    /// The standard deviation beside its limit, in a sentence.
    #[pyo3(get)]
    reason: String,
}

impl From<core::FilteredTilt> for FilteredTilt {
    fn from(found: core::FilteredTilt) -> Self {
        Self {
            tilt: found.tilt,
            covariance: found.covariance_rad2,
            confidence: found.confidence,
            sigma_rad: found.sigma_rad,
            sigma_max_rad: found.sigma_max_rad,
            reason: found.to_string(),
        }
    }
}

impl FilteredTilt {
    fn vector(&self) -> Vector3<f64> {
        self.tilt.map_or(Vector3::repeat(f64::NAN), |tilt| tilt.normal())
    }

    fn angle(&self, of: impl Fn(&Tilt) -> f64) -> f64 {
        self.tilt.as_ref().map_or(f64::NAN, of)
    }

    /// Everything as bits, so that equal means the same bytes and NaN equals itself.
    fn bits(&self) -> Vec<u64> {
        let numbers = [self.confidence, self.sigma_rad, self.sigma_max_rad];
        self.vector().iter().chain(self.covariance.iter()).chain(&numbers).map(|x| x.to_bits()).collect()
    }
}

#[pymethods]
impl FilteredTilt {
    /// How far the robot leans, in [0, pi] radians; NaN where the filter abstains.
    #[getter]
    fn alpha_rad(&self) -> f64 {
        self.angle(Tilt::alpha_rad)
    }

    /// In which direction it leans, in (-pi, pi] radians: 0 forward, +pi/2 left; NaN where the filter abstains.
    #[getter]
    fn beta_rad(&self) -> f64 {
        self.angle(Tilt::beta_rad)
    }

    /// Roll about x in radians, right side down positive (Rz Ry Rx, ROS REP 103); NaN where the filter abstains.
    #[getter]
    fn roll_rad(&self) -> f64 {
        self.angle(Tilt::roll_rad)
    }

    /// Pitch about y in radians, nose down positive (Rz Ry Rx, ROS REP 103); NaN where the filter abstains.
    #[getter]
    fn pitch_rad(&self) -> f64 {
        self.angle(Tilt::pitch_rad)
    }

    /// Fresh (3,) float64: the unit ground normal, eq. 1; NaN where the filter abstains.
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.vector().as_slice())
    }

    /// Fresh (2, 2) float64 in squared radians: covariance of the normal in its tangent plane; finite also where the filter
    /// abstains.
    #[getter]
    fn covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        convert::to_matrix2(py, &self.covariance)
    }

    /// Whether there is a tilt: false where the filter abstains.
    fn __bool__(&self) -> bool {
        self.tilt.is_some()
    }

    /// The attributes by name; arrays as nested lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("alpha_rad", self.alpha_rad())?;
        dict.set_item("beta_rad", self.beta_rad())?;
        dict.set_item("roll_rad", self.roll_rad())?;
        dict.set_item("pitch_rad", self.pitch_rad())?;
        dict.set_item("normal", self.vector().as_slice().to_vec())?;
        dict.set_item("covariance_rad2", nested(&self.covariance))?;
        dict.set_item("confidence", self.confidence)?;
        dict.set_item("sigma_rad", self.sigma_rad)?;
        dict.set_item("sigma_max_rad", self.sigma_max_rad)?;
        dict.set_item("reason", &self.reason)?;
        Ok(dict)
    }

    /// The value of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values.cast::<PyDict>().map_err(|_| invalid("values: expected a dict".to_owned()))?;
        convert::known_keys(values, &TILT_KEYS)?;
        let found = Self {
            tilt: Tilt::from_normal(&convert::vector3(&convert::raw_item(values, "normal")?, "values[\"normal\"]")?),
            covariance: matrix2(&convert::raw_item(values, "covariance_rad2")?, "values[\"covariance_rad2\"]")?,
            confidence: convert::item(values, "confidence", "a number")?,
            sigma_rad: convert::item(values, "sigma_rad", "a number")?,
            sigma_max_rad: convert::item(values, "sigma_max_rad", "a number")?,
            reason: convert::item(values, "reason", "text")?,
        };
        let angles = [found.alpha_rad(), found.beta_rad(), found.roll_rad(), found.pitch_rad()];
        for (key, angle) in ["alpha_rad", "beta_rad", "roll_rad", "pitch_rad"].into_iter().zip(angles) {
            let given: f64 = convert::item(values, key, "a number")?;
            if (given - angle).abs() > 1e-9 || given.is_nan() != angle.is_nan() {
                return Err(invalid(format!("values[\"{key}\"] = {given}, expected {angle}, as the normal has it")));
            }
        }
        Ok(found)
    }

    fn __repr__(&self) -> String {
        match self.tilt {
            Some(tilt) => format!(
                "FilteredTilt(alpha_rad={:.5}, beta_rad={:.5}, confidence={:.3}, sigma_rad={:.5})",
                tilt.alpha_rad(),
                tilt.beta_rad(),
                self.confidence,
                self.sigma_rad
            ),
            None => format!("FilteredTilt(no tilt: {})", self.reason),
        }
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.bits() == other.get().bits())
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        PyTuple::new(py, self.bits())?.hash()
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

/// What a filter did with an estimate, and why.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct FilterStep {
    /// Whether the estimate was fused.
    #[pyo3(get)]
    accepted: bool,
    /// What was done, in a word.
    #[pyo3(get)]
    verdict: String,
    /// The same in a sentence, with the measured number and the limit.
    #[pyo3(get)]
    reason: String,
    /// The normalised innovation squared, of two degrees of freedom; None if it did not come to that.
    #[pyo3(get)]
    nis: Option<f64>,
}

impl From<Verdict> for FilterStep {
    fn from(verdict: Verdict) -> Self {
        Self {
            accepted: verdict.accepted(),
            verdict: verdict.name().to_owned(),
            reason: verdict.to_string(),
            nis: verdict.nis(),
        }
    }
}

impl FilterStep {
    fn bits(&self) -> (bool, &str, &str, Option<u64>) {
        (self.accepted, &self.verdict, &self.reason, self.nis.map(f64::to_bits))
    }
}

#[pymethods]
impl FilterStep {
    /// Whether the estimate was fused.
    fn __bool__(&self) -> bool {
        self.accepted
    }

    /// The attributes by name.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("accepted", self.accepted)?;
        dict.set_item("verdict", &self.verdict)?;
        dict.set_item("reason", &self.reason)?;
        dict.set_item("nis", self.nis)?;
        Ok(dict)
    }

    /// The value of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values.cast::<PyDict>().map_err(|_| invalid("values: expected a dict".to_owned()))?;
        convert::known_keys(values, &STEP_KEYS)?;
        Ok(Self {
            accepted: convert::item(values, "accepted", "a bool")?,
            verdict: convert::item(values, "verdict", "text")?,
            reason: convert::item(values, "reason", "text")?,
            nis: convert::item(values, "nis", "a number or None")?,
        })
    }

    fn __repr__(&self) -> String {
        format!("FilterStep({}, {})", self.verdict, self.reason)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.bits() == other.get().bits())
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        self.bits().into_pyobject(py)?.hash()
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

/// A `(2, 2)` matrix.
pub(super) fn matrix2(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Matrix2<f64>> {
    match convert::rows::<2>(value, name)?.0[..] {
        [[a, b], [c, d]] => Ok(Matrix2::new(a, b, c, d)),
        ref rows => Err(invalid(format!("{name}: {} rows of 2, expected shape (2, 2)", rows.len()))),
    }
}

/// A matrix as nested rows.
pub(super) fn nested(m: &Matrix2<f64>) -> [[f64; 2]; 2] {
    [[m[(0, 0)], m[(0, 1)]], [m[(1, 0)], m[(1, 1)]]]
}
