//! `SelfCalibrator`, `calibrate`, `simulate_drive`: where a camera sits on a robot, over arrays.

mod drive;
mod log;
mod mounting;
mod step;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use tiltvp_core::Error;
use tiltvp_core::filter::ConsistencyBand;
use tiltvp_core::interrupt::check;
use tiltvp_core::selfcalib::{
    self as core, LogBearing, LogOptions, SelfCalibratorOptions, WHEEL_BASE_MAX_M, WheelMotion,
};

pub(crate) use self::drive::{SimulatedDrive, drive_legs, simulate_drive};
pub(crate) use self::log::{LogCalibration, misreading_clause};
pub(crate) use self::mounting::MountingEstimate;
pub(crate) use self::step::CalibrationStep;
use crate::array::Array;
use crate::call::{call_long, exception, invalid};
use crate::convert::{self, Number};
use crate::options;
use crate::shared::Shared;
use crate::value::changing;

/// Landmarks beyond which a step may take longer than a person waits: of 200 it took 0.05 s, of 1,200 24 s.
const MANY_LANDMARKS: usize = 200;

/// Estimates where a camera sits on a robot, step by step while it drives past landmarks. Changes as it goes.
///
/// `method` is "default", which does not diverge, or "paper", the filter of Scaramuzza 2009 exactly. `start` and
/// `start_sigma` are (x_m, y_m, yaw_rad) of the mounting as it is thought to be, and standard deviations (3,) or
/// covariance (3, 3) of them. Landmarks that are not seen from the poses kept are forgotten: let `keyframes_max` keep a whole
/// drive's for loops to close.
///
/// Raises `tiltvp.errors.InvalidInputError` for options out of their domain or of the other method.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct SelfCalibrator {
    inner: Shared<core::SelfCalibrator>,
}

changing!(SelfCalibrator(core::SelfCalibrator), |own| own);

#[pymethods]
impl SelfCalibrator {
    #[new]
    #[pyo3(signature = (*, wheel_base_m, **options: "Option | None"))]
    fn new(wheel_base_m: Number, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let wheel_base_m = wheel_base_m.of("wheel_base_m")?;
        let parsed =
            options::given(SelfCalibratorOptions { wheel_base_m, ..SelfCalibratorOptions::default() }, options)?;
        let inner = core::SelfCalibrator::new(parsed).map_err(|error| exception(&error))?;
        Ok(inner.into())
    }

    /// Moves by the wheels' displacements, then looks: bearings (N,) of landmarks by whole numbers (N,) from 0.
    ///
    /// Bearings are in the camera's frame, counter-clockwise; of those taken while the robot stands only the first of
    /// each landmark counts. Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense; the filter is
    /// then as before.
    #[pyo3(signature = (delta_left_m, delta_right_m, landmark_ids: "ArrayLike", bearings_rad: "ArrayLike"))]
    fn step(
        &self,
        py: Python<'_>,
        delta_left_m: Number,
        delta_right_m: Number,
        landmark_ids: &Bound<'_, PyAny>,
        bearings_rad: &Bound<'_, PyAny>,
    ) -> PyResult<CalibrationStep> {
        let motion =
            WheelMotion { left_m: delta_left_m.of("delta_left_m")?, right_m: delta_right_m.of("delta_right_m")? };
        let names = convert::vector(landmark_ids, "landmark_ids")?
            .into_iter()
            .map(|name| landmark(name, "landmark_ids"))
            .collect::<PyResult<Vec<u64>>>()?;
        let bearings = convert::vector(bearings_rad, "bearings_rad")?;
        let step = |calibrator: &mut core::SelfCalibrator| calibrator.step(&motion, &names, &bearings);
        let long = names.len() + self.landmarks(py) > MANY_LANDMARKS;
        let done = if long { self.inner.change_long(py, step) } else { self.inner.change(py, step) };
        done.map(CalibrationStep::from)
    }

    /// Steps through a log, (N, 2) left and right, (M, 3) step, landmark, bearing: the estimate after each step.
    #[pyo3(signature = (odometry: "ArrayLike", bearings: "ArrayLike"))]
    fn follow(
        &self,
        py: Python<'_>,
        odometry: &Bound<'_, PyAny>,
        bearings: &Bound<'_, PyAny>,
    ) -> PyResult<Vec<MountingEstimate>> {
        let (readings, mut seen) = log(odometry, bearings)?;
        seen.sort_by_key(|b| b.step);
        let found = self.inner.change_long(py, |filter| {
            let mut rest = seen.as_slice();
            let mut all = Vec::with_capacity(readings.len());
            for (step, motion) in readings.iter().enumerate() {
                let (now, later) = rest.split_at(rest.partition_point(|b| b.step <= step));
                rest = later;
                let names: Vec<u64> = now.iter().map(|b| b.landmark).collect();
                let angles: Vec<f64> = now.iter().map(|b| b.bearing_rad).collect();
                check();
                filter.step(motion, &names, &angles)?;
                all.push(filter.estimate());
            }
            if let Some(beyond) = rest.first() {
                let expected = format!("steps below {}, the length of the odometry", readings.len());
                return Err(Error::argument("bearings", format!("step {}", beyond.step), expected));
            }
            filter.examine();
            if let Some(last) = all.last_mut() {
                *last = filter.estimate();
            }
            Ok(all)
        })?;
        Ok(found.into_iter().map(MountingEstimate::from).collect())
    }

    /// The mounting as it is believed to be now.
    #[getter]
    fn estimate(&self, py: Python<'_>) -> MountingEstimate {
        self.inner.look(py, core::SelfCalibrator::estimate).into()
    }

    /// Looks now for what the drive so far contradicts, which assumption is likely wrong, and how far motions that err together, as on
    /// a carpet, may have moved the answer; `estimate` then says so.
    ///
    /// That happens by itself at the end of `follow`, and not between steps, for it costs some twenty solutions of the window.
    fn examine(&self, py: Python<'_>) -> PyResult<()> {
        self.inner.change_long(py, |calibrator| {
            calibrator.examine();
            Ok(())
        })
    }

    /// Landmarks that are being followed.
    #[getter]
    fn landmarks(&self, py: Python<'_>) -> usize {
        self.inner.look(py, core::SelfCalibrator::landmarks)
    }

    /// Forgets everything but the options.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.inner.change(py, core::SelfCalibrator::reset)
    }

    /// Sets what pickle has kept.
    fn __setstate__(&self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        let kept =
            postcard::from_bytes::<core::SelfCalibrator>(state).ok().filter(core::SelfCalibrator::is_well_formed);
        let kept = kept.ok_or_else(|| invalid("state: expected the bytes that pickle keeps".to_owned()))?;
        self.inner.change(py, |calibrator| {
            *calibrator = kept;
            Ok(())
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let make = py.import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&this.options(py)?))?;
        let state = postcard::to_stdvec(&this.inner.copied(py)).map_err(|error| invalid(format!("state: {error}")))?;
        (make, PyTuple::empty(py), PyBytes::new(py, &state)).into_pyobject(py)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (o, estimate) = self.inner.look(py, |inner| (*inner.options(), inner.estimate()));
        format!("SelfCalibrator(method={:?}, wheel_base_m={}): {estimate}", o.method.name(), o.wheel_base_m)
    }
}

/// A landmark's number. None is below 0: -1 often stands for lines that nobody knows, which would be one landmark.
fn landmark(name: f64, what: &str) -> PyResult<u64> {
    // From 2^53 on two whole numbers may be the same float.
    if name.fract() != 0.0 || !(0.0..2f64.powi(53)).contains(&name) {
        return Err(invalid(format!("{what}: {name}, expected whole numbers from 0, below 2^53")));
    }
    Ok(name as u64)
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

/// The mounting from a whole log at once, by robust sparse least squares.
///
/// `odometry` (N, 2) are the displacements of left and right wheel, `bearings` (M, 3) rows of step (a row of the
/// odometry, after whose motion it was taken), landmark, bearing. `times_s` (N,) are the times of the steps, for
/// `estimate_time_offset`. Bearings have no scale: with `estimate_odometry` the mean displacement of both wheels stays
/// as reported. Other options are those of `SelfCalibrator`.
///
/// Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense, two bearings of a landmark at one step, and
/// logs that determine nothing.
#[pyfunction]
#[pyo3(signature = (
    odometry: "ArrayLike", bearings: "ArrayLike", *, wheel_base_m, times_s: "ArrayLike | None" = None,
    **options: "Option | None"
))]
pub(crate) fn calibrate(
    py: Python<'_>,
    odometry: &Bound<'_, PyAny>,
    bearings: &Bound<'_, PyAny>,
    wheel_base_m: Number,
    times_s: Option<&Bound<'_, PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<LogCalibration> {
    let wheel_base_m = wheel_base_m.of("wheel_base_m")?;
    let mut usual = LogOptions::default();
    usual.filter.wheel_base_m = wheel_base_m;
    let parsed = options::given(usual, options)?;
    let (readings, seen) = log(odometry, bearings)?;
    let times = times_s.map(|times| convert::vector(times, "times_s")).transpose()?;
    let found = call_long(py, || core::calibrate_log(&parsed, &readings, times.as_deref(), &seen))?;
    Ok(LogCalibration::from(found))
}

/// (N, 2) displacements (left, right) of wheels that drive distances (N,) and turn (N,) to the left (eq. 15).
#[pyfunction]
#[pyo3(signature = (distance_m: "ArrayLike", heading_change_rad: "ArrayLike", *, wheel_base_m))]
pub(crate) fn wheel_displacements<'py>(
    py: Python<'py>,
    distance_m: &Bound<'py, PyAny>,
    heading_change_rad: &Bound<'py, PyAny>,
    wheel_base_m: Number,
) -> PyResult<Array<'py, f64>> {
    let wheel_base_m = wheel_base_m.of("wheel_base_m")?;
    let distances = convert::vector(distance_m, "distance_m")?;
    let turns = convert::vector(heading_change_rad, "heading_change_rad")?;
    if distances.len() != turns.len() {
        return Err(invalid(format!("heading_change_rad: {} numbers, expected {}", turns.len(), distances.len())));
    }
    if !(wheel_base_m > 0.0 && wheel_base_m <= WHEEL_BASE_MAX_M) {
        let expected = format!("a positive number of metres, at most {WHEEL_BASE_MAX_M}");
        return Err(invalid(format!("wheel_base_m = {wheel_base_m}, expected {expected}")));
    }
    let rows: Vec<[f64; 2]> = distances
        .iter()
        .zip(&turns)
        .map(|(distance, turn)| WheelMotion::from_motion(*distance, *turn, wheel_base_m))
        .map(|motion| [motion.left_m, motion.right_m])
        .collect();
    convert::to_rows(py, &rows, false)
}

/// (low, high): the mean of `samples` chi-square values of `dof` degrees of freedom is there with that probability.
///
/// The mean NEES of so many runs of a consistent filter falls there.
#[pyfunction]
#[pyo3(signature = (probability, dof: "SupportsIndex", samples: "SupportsIndex"))]
pub(crate) fn consistency_band(
    probability: Number,
    dof: &Bound<'_, PyAny>,
    samples: &Bound<'_, PyAny>,
) -> PyResult<(f64, f64)> {
    let probability = probability.of("probability")?;
    let count = |value, name| convert::number::<u32>(value, name, "a whole number from 1 to 2^32 - 1");
    let (dof, samples) = (count(dof, "dof")?, count(samples, "samples")?);
    ConsistencyBand::of_mean(probability, dof, samples).map(|band| (band.low, band.high)).ok_or_else(|| {
        invalid(format!(
            "probability = {probability}, dof = {dof}, samples = {samples}, expected (0, 1) and counts from 1"
        ))
    })
}
