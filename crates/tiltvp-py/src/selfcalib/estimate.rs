//! What a self-calibration answers, as frozen Python values.

use nalgebra::{Matrix3, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::selfcalib as core;

use crate::call::invalid;
use crate::convert::{item, known_keys};

/// Fresh `(3, 3)` array.
pub(super) fn matrix3<'py>(py: Python<'py>, m: &Matrix3<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, m.transpose().as_slice()).reshape([3, 3])
}

/// A matrix of a dict.
fn matrix_item(values: &Bound<'_, PyDict>, key: &str) -> PyResult<Matrix3<f64>> {
    let rows: [[f64; 3]; 3] = item(values, key, "three rows of three numbers")?;
    Ok(Matrix3::from_fn(|r, c| rows[r][c]))
}

/// A vector of a dict.
fn vector_item(values: &Bound<'_, PyDict>, key: &str) -> PyResult<Vector3<f64>> {
    let numbers: [f64; 3] = item(values, key, "three numbers")?;
    Ok(Vector3::from(numbers))
}

fn nested(m: &Matrix3<f64>) -> Vec<Vec<f64>> {
    m.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// What a step of a `SelfCalibrator` did.
#[pyclass(frozen, module = "tiltvp._core", eq)]
#[derive(Clone, PartialEq)]
pub(crate) struct CalibrationStep {
    /// Normalised innovation squared of the bearings that were fused: chi-square of `used` degrees of freedom.
    #[pyo3(get)]
    nis: f64,
    /// Bearings of known landmarks that were fused.
    #[pyo3(get)]
    used: usize,
    /// Bearings of known landmarks that did not pass the gate.
    #[pyo3(get)]
    rejected: usize,
    /// Landmarks seen for the first time.
    #[pyo3(get)]
    started: usize,
}

impl From<core::CalibrationStep> for CalibrationStep {
    fn from(step: core::CalibrationStep) -> Self {
        Self { nis: step.nis, used: step.used, rejected: step.rejected, started: step.started }
    }
}

#[pymethods]
impl CalibrationStep {
    fn __repr__(&self) -> String {
        let Self { nis, used, rejected, started } = self;
        format!("CalibrationStep(nis={nis:.3}, used={used}, rejected={rejected}, started={started})")
    }

    /// The attributes by name.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("nis", self.nis)?;
        dict.set_item("used", self.used)?;
        dict.set_item("rejected", self.rejected)?;
        dict.set_item("started", self.started)?;
        Ok(dict)
    }

    /// The step of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        known_keys(values, &["nis", "used", "rejected", "started"])?;
        let count = |key| item(values, key, "a whole number from 0");
        Ok(Self {
            nis: item(values, "nis", "a number")?,
            used: count("used")?,
            rejected: count("rejected")?,
            started: count("started")?,
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

/// Where a camera sits on a robot, with how sure that is.
#[pyclass(frozen, module = "tiltvp._core", eq)]
#[derive(Clone, PartialEq)]
pub(crate) struct MountingEstimate {
    inner: core::MountingEstimate,
}

impl From<core::MountingEstimate> for MountingEstimate {
    fn from(inner: core::MountingEstimate) -> Self {
        Self { inner }
    }
}

/// What a drive can determine.
const DETERMINABLE: [&str; 4] = ["phi", "rho", "psi", "yaw"];

/// The keys of an estimate's dict.
const ESTIMATE_KEYS: [&str; 16] = [
    "x_m",
    "y_m",
    "yaw_rad",
    "phi_rad",
    "rho_m",
    "psi_rad",
    "covariance_xy_yaw",
    "covariance_phi_rho_psi",
    "determined",
    "sigma_of_drive",
    "sigma_of_drive_xy_yaw",
    "advice",
    "rho_near_zero",
    "mean_nis",
    "alarm",
    "reason",
];

impl MountingEstimate {
    fn determined_names(&self) -> Vec<&'static str> {
        let o = &self.inner.observability;
        let all = [("phi", o.phi), ("rho", o.rho), ("psi", o.psi), ("yaw", o.yaw)];
        all.into_iter().filter_map(|(name, known)| known.then_some(name)).collect()
    }
}

#[pymethods]
impl MountingEstimate {
    /// How far the camera is in front of the middle of the wheel axle, metres.
    #[getter]
    fn x_m(&self) -> f64 {
        self.inner.mounting.x_m
    }

    /// How far it is to the left of it, metres.
    #[getter]
    fn y_m(&self) -> f64 {
        self.inner.mounting.y_m
    }

    /// How far its x axis is turned to the left against the robot's, phi + psi, in (-pi, pi] radians.
    #[getter]
    fn yaw_rad(&self) -> f64 {
        self.inner.mounting.yaw_rad
    }

    /// The paper's phi, the direction in which the camera is, in (-pi, pi] radians; means nothing where rho is near 0.
    #[getter]
    fn phi_rad(&self) -> f64 {
        self.inner.mounting.phi_rad()
    }

    /// The paper's rho, the distance of the camera from the middle of the axle, metres.
    #[getter]
    fn rho_m(&self) -> f64 {
        self.inner.mounting.rho_m()
    }

    /// The paper's psi = yaw - phi, in (-pi, pi] radians; means nothing where rho is near 0.
    #[getter]
    fn psi_rad(&self) -> f64 {
        self.inner.mounting.psi_rad()
    }

    /// Fresh (3, 3) float64: covariance of (x, y, yaw).
    #[getter]
    fn covariance_xy_yaw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix3(py, &self.inner.covariance_xy_yaw)
    }

    /// Fresh (3, 3) float64: covariance of (phi, rho, psi); infinite where rho is 0.
    #[getter]
    fn covariance_phi_rho_psi<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix3(py, &self.inner.covariance_phi_rho_psi)
    }

    /// Which of "phi", "rho", "psi", "yaw" the motion so far has determined, without what was believed at the start.
    #[getter]
    fn determined(&self) -> Vec<&'static str> {
        self.determined_names()
    }

    /// Fresh (3,) float64: standard deviations of (phi, rho, psi) by the drive alone, without what was believed at the start.
    #[getter]
    fn sigma_of_drive<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.observability.sigma_phi_rho_psi.as_slice())
    }

    /// What motion would determine what is not determined yet.
    #[getter]
    fn advice(&self) -> &'static str {
        self.inner.observability.advice()
    }

    /// Whether rho is not significantly above zero, where phi and psi mean nothing: use x, y and yaw.
    #[getter]
    fn rho_near_zero(&self) -> bool {
        self.inner.observability.rho_near_zero
    }

    /// Mean normalised innovation squared of a bearing over the last steps: 1 if all is as assumed. None before the first.
    #[getter]
    fn mean_nis(&self) -> Option<f64> {
        self.inner.mean_nis
    }

    /// Whether bearings ever disagreed with the mounting over a window of steps, as after a bump.
    #[getter]
    fn alarm(&self) -> bool {
        self.inner.alarm
    }

    /// What is determined, what motion would help, and whether there was an alarm, in a sentence.
    #[getter]
    fn reason(&self) -> String {
        self.inner.to_string()
    }

    /// Whether the answer can be relied upon: everything determined, finite, and no alarm.
    fn __bool__(&self) -> bool {
        self.inner.reliable()
    }

    /// The attributes by name; arrays as nested lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("x_m", self.x_m())?;
        dict.set_item("y_m", self.y_m())?;
        dict.set_item("yaw_rad", self.yaw_rad())?;
        dict.set_item("phi_rad", self.phi_rad())?;
        dict.set_item("rho_m", self.rho_m())?;
        dict.set_item("psi_rad", self.psi_rad())?;
        dict.set_item("covariance_xy_yaw", nested(&self.inner.covariance_xy_yaw))?;
        dict.set_item("covariance_phi_rho_psi", nested(&self.inner.covariance_phi_rho_psi))?;
        dict.set_item("determined", self.determined_names())?;
        let sigma: Vector3<f64> = self.inner.observability.sigma_phi_rho_psi;
        dict.set_item("sigma_of_drive", sigma.as_slice().to_vec())?;
        let sigma: Vector3<f64> = self.inner.observability.sigma_xy_yaw;
        dict.set_item("sigma_of_drive_xy_yaw", sigma.as_slice().to_vec())?;
        dict.set_item("advice", self.advice())?;
        dict.set_item("rho_near_zero", self.rho_near_zero())?;
        dict.set_item("mean_nis", self.mean_nis())?;
        dict.set_item("alarm", self.alarm())?;
        dict.set_item("reason", self.reason())?;
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let m = &self.inner.mounting;
        format!("MountingEstimate(x_m={:.4}, y_m={:.4}, yaw_rad={:.4}): {}", m.x_m, m.y_m, m.yaw_rad, self.inner)
    }

    /// The estimate of a dict as `to_dict` makes it; what follows from the other items is not read.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        known_keys(values, &ESTIMATE_KEYS)?;
        let number = |key| item::<f64>(values, key, "a number");
        let determined: Vec<String> = item(values, "determined", "a list of names")?;
        if let Some(name) = determined.iter().find(|name| !DETERMINABLE.contains(&name.as_str())) {
            let expected = DETERMINABLE.join(", ");
            return Err(invalid(format!("values[\"determined\"]: unknown name {name:?}, expected {expected}")));
        }
        let has = |name: &str| determined.iter().any(|found| found == name);
        Ok(Self {
            inner: core::MountingEstimate {
                mounting: core::Mounting { x_m: number("x_m")?, y_m: number("y_m")?, yaw_rad: number("yaw_rad")? },
                covariance_xy_yaw: matrix_item(values, "covariance_xy_yaw")?,
                covariance_phi_rho_psi: matrix_item(values, "covariance_phi_rho_psi")?,
                observability: core::Observability {
                    sigma_phi_rho_psi: vector_item(values, "sigma_of_drive")?,
                    sigma_xy_yaw: vector_item(values, "sigma_of_drive_xy_yaw")?,
                    phi: has("phi"),
                    rho: has("rho"),
                    psi: has("psi"),
                    yaw: has("yaw"),
                    rho_near_zero: item(values, "rho_near_zero", "true or false")?,
                },
                mean_nis: item(values, "mean_nis", "a number or None")?,
                alarm: item(values, "alarm", "true or false")?,
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
