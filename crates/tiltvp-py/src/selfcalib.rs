//! `SelfCalibrator`, `calibrate`, `simulate_drive`: where a camera sits on a robot, over arrays.

mod drive;
mod log;
mod matrices;
mod mounting;
mod step;

use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra::{Matrix3, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use tiltvp_core::Error;
use tiltvp_core::filter::ConsistencyBand;
use tiltvp_core::selfcalib::{
    self as core, CalibrationMethod, LogBearing, LogOptions, Mounting, SelfCalibratorOptions, WheelMotion,
};

pub(crate) use self::drive::{SimulatedDrive, drive_legs, simulate_drive};
pub(crate) use self::log::LogCalibration;
pub(crate) use self::mounting::MountingEstimate;
pub(crate) use self::step::CalibrationStep;
use crate::call::{call, exception, invalid};
use crate::convert;

/// Estimates where a camera sits on a robot while it drives.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct SelfCalibrator {
    inner: Mutex<core::SelfCalibrator>,
}

/// The keywords that a user may leave out.
#[derive(Default)]
struct Given<'a, 'py> {
    bearing_sigma_rad: Option<f64>,
    odometry_k_m: Option<f64>,
    step_sigma_m: Option<f64>,
    step_sigma_rad: Option<f64>,
    start: Option<&'a Bound<'py, PyAny>>,
    start_sigma: Option<&'a Bound<'py, PyAny>>,
    start_distance_m: Option<f64>,
    start_distance_log_sigma: Option<f64>,
}

fn options(wheel_base_m: f64, given: &Given<'_, '_>) -> PyResult<SelfCalibratorOptions> {
    let mut options = SelfCalibratorOptions { wheel_base_m, ..SelfCalibratorOptions::default() };
    for (value, field) in [
        (given.bearing_sigma_rad, &mut options.bearing_sigma_rad),
        (given.odometry_k_m, &mut options.odometry_k_m),
        (given.step_sigma_m, &mut options.step_sigma_m),
        (given.step_sigma_rad, &mut options.step_sigma_rad),
        (given.start_distance_m, &mut options.start_distance_m),
        (given.start_distance_log_sigma, &mut options.start_distance_log_sigma),
    ] {
        *field = value.unwrap_or(*field);
    }
    if let Some(start) = given.start {
        let v = convert::vector3(start, "start")?;
        options.start = Mounting { x_m: v.x, y_m: v.y, yaw_rad: v.z };
    }
    if let Some(sigma) = given.start_sigma {
        let (rows, single) = convert::rows::<3>(sigma, "start_sigma")?;
        options.start_covariance = match (rows.as_slice(), single) {
            ([s], true) => Matrix3::from_diagonal(&Vector3::from(*s).map(|s| if s > 0.0 { s * s } else { f64::NAN })),
            ([a, b, c], false) => Matrix3::from_rows(&[*a, *b, *c].map(|row| Vector3::from(row).transpose())),
            _ => return Err(invalid(format!("start_sigma: {} rows, expected (3,) or (3, 3)", rows.len()))),
        };
    }
    Ok(options)
}

impl SelfCalibrator {
    fn lock(&self) -> MutexGuard<'_, core::SelfCalibrator> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl SelfCalibrator {
    #[new]
    #[pyo3(signature = (
        *, wheel_base_m, bearing_sigma_rad=None, odometry_k_m=None, start=None, start_sigma=None, method="default",
        start_distance_m=None, start_distance_log_sigma=None, start_distance_sigma_m=None, gate_probability=None,
        memory=None, odometry_inflation=None, step_sigma_m=None, step_sigma_rad=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of the user")]
    fn new(
        wheel_base_m: f64,
        bearing_sigma_rad: Option<f64>,
        odometry_k_m: Option<f64>,
        start: Option<&Bound<'_, PyAny>>,
        start_sigma: Option<&Bound<'_, PyAny>>,
        method: &str,
        start_distance_m: Option<f64>,
        start_distance_log_sigma: Option<f64>,
        start_distance_sigma_m: Option<f64>,
        gate_probability: Option<f64>,
        memory: Option<&Bound<'_, PyAny>>,
        odometry_inflation: Option<f64>,
        step_sigma_m: Option<f64>,
        step_sigma_rad: Option<f64>,
    ) -> PyResult<Self> {
        let given = Given {
            bearing_sigma_rad,
            odometry_k_m,
            step_sigma_m,
            step_sigma_rad,
            start,
            start_sigma,
            start_distance_m,
            start_distance_log_sigma,
        };
        let mut options = options(wheel_base_m, &given)?;
        options.method = CalibrationMethod::from_name(method).map_err(|error| exception(&error))?;
        let paper = options.method == CalibrationMethod::Paper;
        for (name, given, of_paper) in [
            ("start_distance_sigma_m", start_distance_sigma_m.is_some(), true),
            ("odometry_inflation", odometry_inflation.is_some(), true),
            ("gate_probability", gate_probability.is_some(), false),
            ("memory", memory.is_some(), false),
            ("step_sigma_m", step_sigma_m.is_some(), false),
            ("step_sigma_rad", step_sigma_rad.is_some(), false),
            ("start_distance_log_sigma", start_distance_log_sigma.is_some(), false),
        ] {
            if given && paper != of_paper {
                let other = if of_paper { "paper" } else { "default" };
                return Err(invalid(format!("option {name}: not one of method {method:?}, but of {other:?}")));
            }
        }
        options.start_distance_sigma_m = start_distance_sigma_m.unwrap_or(options.start_distance_sigma_m);
        options.odometry_inflation = odometry_inflation.unwrap_or(options.odometry_inflation);
        options.gate_probability = gate_probability.unwrap_or(options.gate_probability);
        if let Some(memory) = memory {
            options.memory = convert::whole(memory, "option memory", "a whole number from 8 to 100000")?;
        }
        let inner = core::SelfCalibrator::new(options).map_err(|error| exception(&error))?;
        Ok(Self { inner: Mutex::new(inner) })
    }

    /// The options in force that the method reads, by name, defaults included; a fresh dict, good as keywords.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let o = *self.lock().options();
        let dict = PyDict::new(py);
        dict.set_item("wheel_base_m", o.wheel_base_m)?;
        dict.set_item("bearing_sigma_rad", o.bearing_sigma_rad)?;
        dict.set_item("odometry_k_m", o.odometry_k_m)?;
        dict.set_item("start", (o.start.x_m, o.start.y_m, o.start.yaw_rad))?;
        dict.set_item("start_sigma", matrices::matrix3(py, &o.start_covariance)?)?;
        dict.set_item("method", o.method.name())?;
        dict.set_item("start_distance_m", o.start_distance_m)?;
        match o.method {
            CalibrationMethod::Default => {
                dict.set_item("start_distance_log_sigma", o.start_distance_log_sigma)?;
                dict.set_item("gate_probability", o.gate_probability)?;
                dict.set_item("memory", o.memory)?;
                dict.set_item("step_sigma_m", o.step_sigma_m)?;
                dict.set_item("step_sigma_rad", o.step_sigma_rad)?;
            }
            CalibrationMethod::Paper => {
                dict.set_item("start_distance_sigma_m", o.start_distance_sigma_m)?;
                dict.set_item("odometry_inflation", o.odometry_inflation)?;
            }
        }
        Ok(dict)
    }

    /// Moves by the wheels' displacements, then looks.
    fn step(
        &self,
        py: Python<'_>,
        delta_left_m: f64,
        delta_right_m: f64,
        landmark_ids: &Bound<'_, PyAny>,
        bearings_rad: &Bound<'_, PyAny>,
    ) -> PyResult<CalibrationStep> {
        let motion = WheelMotion { left_m: delta_left_m, right_m: delta_right_m };
        let names = convert::vector(landmark_ids, "landmark_ids")?
            .into_iter()
            .map(|name| landmark(name, "landmark_ids"))
            .collect::<PyResult<Vec<u64>>>()?;
        let bearings = convert::vector(bearings_rad, "bearings_rad")?;
        call(py, || self.lock().step(&motion, &names, &bearings)).map(CalibrationStep::from)
    }

    /// Steps through a whole log: the (N,) estimates after each step.
    fn follow(
        &self,
        py: Python<'_>,
        odometry: &Bound<'_, PyAny>,
        bearings: &Bound<'_, PyAny>,
    ) -> PyResult<Vec<MountingEstimate>> {
        let (readings, mut seen) = log(odometry, bearings)?;
        seen.sort_by_key(|b| b.step);
        let found = call(py, || {
            let mut inner = self.lock();
            let mut filter = inner.clone();
            let mut rest = seen.as_slice();
            let mut all = Vec::with_capacity(readings.len());
            for (step, motion) in readings.iter().enumerate() {
                let (now, later) = rest.split_at(rest.partition_point(|b| b.step <= step));
                rest = later;
                let names: Vec<u64> = now.iter().map(|b| b.landmark).collect();
                let angles: Vec<f64> = now.iter().map(|b| b.bearing_rad).collect();
                filter.step(motion, &names, &angles)?;
                all.push(filter.estimate());
            }
            if let Some(beyond) = rest.first() {
                let expected = format!("steps below {}, the length of the odometry", readings.len());
                return Err(Error::argument("bearings", format!("step {}", beyond.step), expected));
            }
            *inner = filter;
            Ok(all)
        })?;
        Ok(found.into_iter().map(MountingEstimate::from).collect())
    }

    /// The mounting as it is believed to be now.
    #[getter]
    fn estimate(&self) -> MountingEstimate {
        self.lock().estimate().into()
    }

    /// Landmarks that are being followed.
    #[getter]
    fn landmarks(&self) -> usize {
        self.lock().landmarks()
    }

    /// Forgets everything but the options.
    fn reset(&self) -> PyResult<()> {
        self.lock().reset().map_err(|error| exception(&error))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let Ok(other) = other.cast::<Self>() else { return false };
        // One at a time: a calibrator may be compared with itself.
        let mine = self.lock().clone();
        mine == *other.get().lock()
    }

    fn __copy__(&self) -> Self {
        Self { inner: Mutex::new(self.lock().clone()) }
    }

    /// Sets what pickle has kept.
    fn __setstate__(&self, state: &[u8]) -> PyResult<()> {
        let kept = postcard::from_bytes::<core::SelfCalibrator>(state).ok().filter(core::SelfCalibrator::is_consistent);
        *self.lock() = kept.ok_or_else(|| invalid("state: expected the bytes that pickle keeps".to_owned()))?;
        Ok(())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let make = py.import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&this.options(py)?))?;
        let state = postcard::to_stdvec(&*this.lock()).map_err(|error| invalid(format!("state: {error}")))?;
        (make, PyTuple::empty(py), PyBytes::new(py, &state)).into_pyobject(py)
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__()
    }

    fn __repr__(&self) -> String {
        let inner = self.lock();
        let o = inner.options();
        format!("SelfCalibrator(method={:?}, wheel_base_m={}): {}", o.method.name(), o.wheel_base_m, inner.estimate())
    }
}

/// A landmark's number: any whole number.
fn landmark(name: f64, what: &str) -> PyResult<u64> {
    if name.fract() != 0.0 || name.abs() > 2f64.powi(53) {
        return Err(invalid(format!("{what}: {name}, expected whole numbers")));
    }
    Ok((name as i64) as u64)
}

fn log(odometry: &Bound<'_, PyAny>, bearings: &Bound<'_, PyAny>) -> PyResult<(Vec<WheelMotion>, Vec<LogBearing>)> {
    let readings = convert::rows::<2>(odometry, "odometry")?.0;
    let readings = readings.into_iter().map(|[left_m, right_m]| WheelMotion { left_m, right_m }).collect();
    let bearing = |[step, name, bearing_rad]: [f64; 3]| {
        if step < 0.0 || step.fract() != 0.0 {
            return Err(invalid(format!("bearings: step {step}, expected whole numbers from 0")));
        }
        Ok(LogBearing { step: step as usize, landmark: landmark(name, "bearings: landmark")?, bearing_rad })
    };
    let bearings = convert::rows::<3>(bearings, "bearings")?.0;
    Ok((readings, bearings.into_iter().map(bearing).collect::<PyResult<_>>()?))
}

/// The mounting from a whole log at once.
#[pyfunction]
#[pyo3(signature = (
    odometry, bearings, *, wheel_base_m, bearing_sigma_rad=None, odometry_k_m=None, start=None, start_sigma=None,
    start_distance_m=None, start_distance_log_sigma=None, estimate_odometry=false, estimate_time_offset=false,
    times_s=None, max_iterations=None, step_sigma_m=None, step_sigma_rad=None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of the user")]
pub(crate) fn calibrate(
    py: Python<'_>,
    odometry: &Bound<'_, PyAny>,
    bearings: &Bound<'_, PyAny>,
    wheel_base_m: f64,
    bearing_sigma_rad: Option<f64>,
    odometry_k_m: Option<f64>,
    start: Option<&Bound<'_, PyAny>>,
    start_sigma: Option<&Bound<'_, PyAny>>,
    start_distance_m: Option<f64>,
    start_distance_log_sigma: Option<f64>,
    estimate_odometry: bool,
    estimate_time_offset: bool,
    times_s: Option<&Bound<'_, PyAny>>,
    max_iterations: Option<u32>,
    step_sigma_m: Option<f64>,
    step_sigma_rad: Option<f64>,
) -> PyResult<LogCalibration> {
    let given = Given {
        bearing_sigma_rad,
        odometry_k_m,
        step_sigma_m,
        step_sigma_rad,
        start,
        start_sigma,
        start_distance_m,
        start_distance_log_sigma,
    };
    let defaults = LogOptions::default();
    let options = LogOptions {
        filter: options(wheel_base_m, &given)?,
        estimate_odometry,
        estimate_time_offset,
        max_iterations: max_iterations.unwrap_or(defaults.max_iterations),
    };
    let (readings, seen) = log(odometry, bearings)?;
    let times = times_s.map(|times| convert::vector(times, "times_s")).transpose()?;
    let found = call(py, || core::calibrate_log(&options, &readings, times.as_deref(), &seen))?;
    Ok(LogCalibration::from(found))
}

/// (N, 2) displacements (left, right) of wheels that drive distances (N,) and turn (N,) to the left (eq. 15).
#[pyfunction]
#[pyo3(signature = (distance_m, heading_change_rad, *, wheel_base_m))]
pub(crate) fn wheel_displacements<'py>(
    py: Python<'py>,
    distance_m: &Bound<'py, PyAny>,
    heading_change_rad: &Bound<'py, PyAny>,
    wheel_base_m: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let distances = convert::vector(distance_m, "distance_m")?;
    let turns = convert::vector(heading_change_rad, "heading_change_rad")?;
    if distances.len() != turns.len() {
        return Err(invalid(format!("heading_change_rad: {} numbers, expected {}", turns.len(), distances.len())));
    }
    if !(wheel_base_m > 0.0 && wheel_base_m.is_finite()) {
        return Err(invalid(format!("wheel_base_m = {wheel_base_m}, expected a positive number of metres")));
    }
    let rows: Vec<[f64; 2]> = distances
        .iter()
        .zip(&turns)
        .map(|(distance, turn)| WheelMotion::from_motion(*distance, *turn, wheel_base_m))
        .map(|motion| [motion.left_m, motion.right_m])
        .collect();
    convert::to_rows(py, &rows, false)
}

/// (low, high): where the mean of `samples` chi-square values of `dof` degrees of freedom falls with that probability.
#[pyfunction]
pub(crate) fn consistency_band(probability: f64, dof: u32, samples: u32) -> PyResult<(f64, f64)> {
    ConsistencyBand::of_mean(probability, dof, samples).map(|band| (band.low, band.high)).ok_or_else(|| {
        invalid(format!(
            "probability = {probability}, dof = {dof}, samples = {samples}, expected (0, 1) and counts from 1"
        ))
    })
}
