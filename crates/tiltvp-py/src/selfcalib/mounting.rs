//! Where a camera sits on a robot, as a frozen Python value.

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::selfcalib as core;

use super::matrices::{matrix_item, matrix3, nested, vector_item};
use crate::call::invalid;
use crate::convert::{item, known_keys};

/// Where a camera sits on a robot, with how sure that is.
#[pyclass(frozen, module = "tiltvp._core", eq)]
#[derive(Clone, PartialEq)]
pub(crate) struct MountingEstimate {
    pub(super) inner: core::MountingEstimate,
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
    pub(super) fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
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

    pub(super) fn __repr__(&self) -> String {
        let m = &self.inner.mounting;
        format!("MountingEstimate(x_m={:.4}, y_m={:.4}, yaw_rad={:.4}): {}", m.x_m, m.y_m, m.yaw_rad, self.inner)
    }

    /// The estimate of a dict as `to_dict` makes it; what follows from the other items is not read.
    #[classmethod]
    pub(super) fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
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
