//! What a whole log tells, as a frozen Python value.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::selfcalib as core;

use super::mounting::MountingEstimate;
use crate::convert::{item, known_keys};

/// The mounting, and what else was estimated, from a whole log.
#[pyclass(frozen, module = "tiltvp._core", eq)]
#[derive(Clone, PartialEq)]
pub(crate) struct LogCalibration {
    inner: core::LogCalibration,
}

impl From<core::LogCalibration> for LogCalibration {
    fn from(inner: core::LogCalibration) -> Self {
        Self { inner }
    }
}

/// The keys of a log calibration's dict.
const LOG_KEYS: [&str; 14] = [
    "mounting",
    "wheel_base_m",
    "wheel_base_sigma_m",
    "right_over_left",
    "right_over_left_sigma",
    "imbalance",
    "imbalance_sigma",
    "time_offset_s",
    "time_offset_sigma_s",
    "bearings",
    "outliers",
    "residual_rms",
    "iterations",
    "converged",
];

#[pymethods]
impl LogCalibration {
    /// The mounting; covariances are scaled by the residuals where these are larger than assumed.
    #[getter]
    fn mounting(&self) -> MountingEstimate {
        self.inner.estimate.into()
    }

    /// Distance between the wheels, metres, as given or as estimated.
    #[getter]
    fn wheel_base_m(&self) -> f64 {
        self.inner.wheels.base_m
    }

    /// Standard deviation of it; 0 where it was not estimated.
    #[getter]
    fn wheel_base_sigma_m(&self) -> f64 {
        self.inner.wheels_sigma[1]
    }

    /// How much farther the right wheel goes than the left when both report the same: a ratio, 1 where not estimated.
    #[getter]
    fn right_over_left(&self) -> f64 {
        (2.0 * self.inner.wheels.imbalance).exp()
    }

    /// Standard deviation of it; 0 where it was not estimated.
    #[getter]
    fn right_over_left_sigma(&self) -> f64 {
        2.0 * self.inner.wheels_sigma[0] * self.right_over_left()
    }

    /// By how much bearings are later than the odometry, seconds; 0 where it was not estimated.
    #[getter]
    fn time_offset_s(&self) -> f64 {
        self.inner.time_offset_s
    }

    /// Standard deviation of it; 0 where it was not estimated.
    #[getter]
    fn time_offset_sigma_s(&self) -> f64 {
        self.inner.time_offset_sigma_s
    }

    /// Bearings that were used; of those taken at a standstill only the first.
    #[getter]
    fn bearings(&self) -> usize {
        self.inner.bearings
    }

    /// Bearings farther off than 4.5 standard deviations, which count for nothing.
    #[getter]
    fn outliers(&self) -> usize {
        self.inner.outliers
    }

    /// Root of the mean squared residual of the others, in standard deviations of a bearing.
    #[getter]
    fn residual_rms(&self) -> f64 {
        self.inner.residual_rms
    }

    /// Linearisations.
    #[getter]
    fn iterations(&self) -> u32 {
        self.inner.iterations
    }

    /// Whether the descent came to rest.
    #[getter]
    fn converged(&self) -> bool {
        self.inner.converged
    }

    /// Whether the answer can be relied upon: the mounting is determined, and the descent came to rest.
    fn __bool__(&self) -> bool {
        self.inner.converged && self.inner.estimate.reliable()
    }

    /// The attributes by name, those of the mounting among them; arrays as nested lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("mounting", self.mounting().to_dict(py)?)?;
        dict.set_item("wheel_base_m", self.wheel_base_m())?;
        dict.set_item("wheel_base_sigma_m", self.wheel_base_sigma_m())?;
        dict.set_item("right_over_left", self.right_over_left())?;
        dict.set_item("right_over_left_sigma", self.right_over_left_sigma())?;
        dict.set_item("imbalance", self.inner.wheels.imbalance)?;
        dict.set_item("imbalance_sigma", self.inner.wheels_sigma[0])?;
        dict.set_item("time_offset_s", self.time_offset_s())?;
        dict.set_item("time_offset_sigma_s", self.time_offset_sigma_s())?;
        dict.set_item("bearings", self.bearings())?;
        dict.set_item("outliers", self.outliers())?;
        dict.set_item("residual_rms", self.residual_rms())?;
        dict.set_item("iterations", self.iterations())?;
        dict.set_item("converged", self.converged())?;
        Ok(dict)
    }

    /// The calibration of a dict as `to_dict` makes it; what follows from the other items is not read.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        known_keys(values, &LOG_KEYS)?;
        let number = |key| item::<f64>(values, key, "a number");
        let count = |key| item(values, key, "a whole number from 0");
        let mounting: Bound<'_, PyDict> = item(values, "mounting", "a dict")?;
        let mounting = MountingEstimate::from_dict(&values.py().get_type::<MountingEstimate>(), &mounting)?;
        Ok(Self {
            inner: core::LogCalibration {
                estimate: mounting.inner,
                wheels: core::Wheels { imbalance: number("imbalance")?, base_m: number("wheel_base_m")? },
                wheels_sigma: [number("imbalance_sigma")?, number("wheel_base_sigma_m")?],
                time_offset_s: number("time_offset_s")?,
                time_offset_sigma_s: number("time_offset_sigma_s")?,
                bearings: count("bearings")?,
                outliers: count("outliers")?,
                residual_rms: number("residual_rms")?,
                iterations: item(values, "iterations", "a whole number from 0")?,
                converged: item(values, "converged", "true or false")?,
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

    fn __repr__(&self) -> String {
        format!(
            "LogCalibration({}, residual_rms={:.3}, bearings={}, outliers={}, converged={})",
            self.mounting().__repr__(),
            self.residual_rms(),
            self.bearings(),
            self.outliers(),
            self.converged()
        )
    }
}
