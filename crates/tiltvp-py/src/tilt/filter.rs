//! `TiltFilter`: successive tilts fused.

use nalgebra::{Matrix2, Matrix6, Vector2, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::tilt::{self as core, TiltFilterOptions, TiltFilterState, Verdict};

use super::estimate::TiltEstimate;
use super::filtered::{FilterStep, FilteredTilt};
use crate::call::{exception, invalid};
use crate::convert;
use crate::options;
use crate::shared::Shared;
use crate::value::changing;

/// Keys of the dict of a state, by the way of pickle.
const STATE_KEYS: [&str; 11] = [
    "floor",
    "mounting",
    "scene",
    "covariance",
    "common",
    "driven_m",
    "pending",
    "agreeing",
    "rejected",
    "latest",
    "rolled_m",
];

/// Fuses the tilts of successive images: a Kalman filter of the ground normal on the sphere.
///
/// The floor's tilt turns with the robot's heading and walks slowly; errors that images of one place share are not
/// averaged away; estimates that say nothing or do not fit are left out, steps are followed. Changes as it goes; may be
/// pickled, copied and compared, state included, and used from several threads. See docs/tilt.md for the model.
///
/// Raises `tiltvp.errors.InvalidInputError` for options out of their domain.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct TiltFilter {
    inner: Shared<core::TiltFilter>,
}

changing!(TiltFilter(core::TiltFilter), |own| own, {
    /// The ground normal in the robot's frame, as the filter holds it to be now.
    estimate: FilteredTilt = own.estimate().into(),
    /// The floor's part of it alone, in the frame of the wheels.
    floor: FilteredTilt = own.floor().into(),
    /// The robot's own part alone, what it would see on level ground; None unless `estimate_mounting`.
    mounting: Option<FilteredTilt> = own.mounting().map(FilteredTilt::from),
    /// The largest normalised innovation squared that passes the gate.
    nis_limit: f64 = own.nis_limit(),
    /// How many estimates in a row the gate has rejected: above 0, the estimate may be about to jump.
    rejected: u32 = own.state().rejected,
});

#[pymethods]
impl TiltFilter {
    #[new]
    #[pyo3(signature = (**options: "Option | None"))]
    fn new(options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let parsed = options::given(TiltFilterOptions::default(), options)?;
        let inner = core::TiltFilter::new(parsed).map_err(|error| exception(&error))?;
        Ok(inner.into())
    }

    /// The robot has turned (left positive) and driven (either way) since the last call; None: it has not.
    ///
    /// Where turns are not known, `walk_rad_per_sqrt_step` of 0.1 rad for each second between calls stands for them.
    #[pyo3(signature = (yaw_rad: "float | None" = None, distance_m: "float | None" = None))]
    fn predict(
        &self,
        py: Python<'_>,
        yaw_rad: Option<&Bound<'_, PyAny>>,
        distance_m: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let [yaw_rad, distance_m] = motion(yaw_rad, distance_m)?;
        self.inner.change(py, |filter| filter.predict(yaw_rad, distance_m))
    }

    /// Fuses an estimate, or says why not.
    ///
    /// In its place a pair may stand: a ground normal (3,) of any length, and its covariance (2, 2) in squared radians
    /// in the tangent plane. Its confidence is the probability of an error below two degrees under that covariance.
    #[pyo3(signature = (estimate: "TiltEstimate | tuple[ArrayLike, ArrayLike]", /))]
    fn update(&self, py: Python<'_>, estimate: &Bound<'_, PyAny>) -> PyResult<FilterStep> {
        let measured = measurement(estimate)?;
        self.inner.change(py, |filter| fuse(filter, &measured)).map(FilterStep::from)
    }

    /// `predict`, then `update`; where either is refused, the filter is as before.
    #[pyo3(signature = (
        estimate: "TiltEstimate | tuple[ArrayLike, ArrayLike]", /, yaw_rad: "float | None" = None,
        distance_m: "float | None" = None,
    ))]
    fn step(
        &self,
        py: Python<'_>,
        estimate: &Bound<'_, PyAny>,
        yaw_rad: Option<&Bound<'_, PyAny>>,
        distance_m: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<FilterStep> {
        let measured = measurement(estimate)?;
        let [yaw_rad, distance_m] = motion(yaw_rad, distance_m)?;
        let fused = self.inner.change(py, |filter| {
            let mut next = filter.clone();
            next.predict(yaw_rad, distance_m)?;
            let verdict = fuse(&mut next, &measured)?;
            *filter = next;
            Ok(verdict)
        });
        fused.map(FilterStep::from)
    }

    /// Forgets everything but the options.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.inner.change(py, |filter| {
            filter.reset();
            Ok(())
        })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("TiltFilter({})", options::shown(py, &self.inner.look(py, |filter| *filter.options()))?))
    }

    /// Sets what pickle has kept.
    fn __setstate__(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        let values = state.cast::<PyDict>().map_err(|_| invalid("state: expected a dict".to_owned()))?;
        let state = read_state(values)?;
        self.inner.change(py, |filter| {
            *filter = core::TiltFilter::with_state(*filter.options(), state)?;
            Ok(())
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let make = py.import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&this.options(py)?))?;
        let state = written_state(py, this.inner.copied(py).state())?;
        (make, PyTuple::empty(py), state).into_pyobject(py)
    }
}

/// What there is to fuse: an estimate's tilt, covariance and confidence, or a normal and its covariance.
enum Measurement {
    Estimate(Option<Tilt>, Matrix2<f64>, f64),
    Normal(Vector3<f64>, Matrix2<f64>),
}

fn measurement(value: &Bound<'_, PyAny>) -> PyResult<Measurement> {
    if let Ok(estimate) = value.cast::<TiltEstimate>() {
        let (tilt, covariance, confidence) = estimate.get().measurement();
        return Ok(Measurement::Estimate(tilt, covariance, confidence));
    }
    let pair = value.cast::<PyTuple>().ok().filter(|pair| pair.len() == 2);
    let Some(pair) = pair else {
        let kind = value.get_type().name()?;
        return Err(invalid(format!("estimate: {kind}, expected a TiltEstimate or a tuple (normal, covariance_rad2)")));
    };
    Ok(Measurement::Normal(
        convert::vector3(&pair.get_item(0)?, "normal")?,
        convert::matrix(&pair.get_item(1)?, "covariance_rad2")?,
    ))
}

fn fuse(filter: &mut core::TiltFilter, measured: &Measurement) -> Result<Verdict, tiltvp_core::Error> {
    match measured {
        Measurement::Estimate(tilt, covariance, confidence) => Ok(filter.update_tilt(*tilt, covariance, *confidence)),
        Measurement::Normal(normal, covariance) => filter.update_normal(normal, covariance),
    }
}

/// The turn and the way of a prediction, nothing where not given.
fn motion(yaw_rad: Option<&Bound<'_, PyAny>>, distance_m: Option<&Bound<'_, PyAny>>) -> PyResult<[f64; 2]> {
    let read = |value: Option<&Bound<'_, PyAny>>, name| value.map_or(Ok(0.0), |value| number(value, name));
    Ok([read(yaw_rad, "yaw_rad")?, read(distance_m, "distance_m")?])
}

fn number(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    convert::number(value, name, "a number")
}

fn written_state<'py>(py: Python<'py>, state: &TiltFilterState) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("floor", state.floor.as_slice().to_vec())?;
    dict.set_item("mounting", state.mounting.as_slice().to_vec())?;
    dict.set_item("scene", state.scene.as_slice().to_vec())?;
    dict.set_item("covariance", state.covariance.as_slice().to_vec())?;
    dict.set_item("common", state.common.as_ref().map(nested))?;
    dict.set_item("driven_m", state.driven_m)?;
    dict.set_item("pending", state.pending.as_ref().map(pair))?;
    dict.set_item("agreeing", state.agreeing)?;
    dict.set_item("rejected", state.rejected)?;
    dict.set_item("latest", state.latest.as_ref().map(pair))?;
    dict.set_item("rolled_m", state.rolled_m)?;
    Ok(dict)
}

fn read_state(values: &Bound<'_, PyDict>) -> PyResult<TiltFilterState> {
    convert::known_keys(values, &STATE_KEYS)?;
    let matrix = |rows: [[f64; 2]; 2]| Matrix2::new(rows[0][0], rows[0][1], rows[1][0], rows[1][1]);
    let vector = |key: &str| convert::item::<[f64; 3]>(values, key, "three numbers").map(Vector3::from);
    let covariance: Vec<f64> = convert::item(values, "covariance", "36 numbers")?;
    if covariance.len() != 36 {
        return Err(invalid(format!("state[\"covariance\"]: {} numbers, expected 36", covariance.len())));
    }
    let pair = |key: &str| -> PyResult<Option<(Vector3<f64>, Matrix2<f64>)>> {
        let told: Option<([f64; 3], [[f64; 2]; 2])> = convert::item(values, key, "None or a normal and a matrix")?;
        Ok(told.map(|(normal, covariance)| (normal.into(), matrix(covariance))))
    };
    Ok(TiltFilterState {
        floor: vector("floor")?,
        mounting: vector("mounting")?,
        scene: Vector2::from(convert::item::<[f64; 2]>(values, "scene", "two numbers")?),
        covariance: Matrix6::from_column_slice(&covariance),
        common: convert::item::<Option<[[f64; 2]; 2]>>(values, "common", "None or a matrix")?.map(matrix),
        driven_m: convert::item(values, "driven_m", "a number")?,
        pending: pair("pending")?,
        agreeing: convert::item(values, "agreeing", "a count")?,
        rejected: convert::item(values, "rejected", "a count")?,
        latest: pair("latest")?,
        rolled_m: convert::item(values, "rolled_m", "a number")?,
    })
}

/// A normal and its covariance.
fn pair((normal, covariance): &(Vector3<f64>, Matrix2<f64>)) -> (Vec<f64>, [[f64; 2]; 2]) {
    (normal.as_slice().to_vec(), nested(covariance))
}

/// A matrix as nested rows.
fn nested(m: &Matrix2<f64>) -> [[f64; 2]; 2] {
    [[m[(0, 0)], m[(0, 1)]], [m[(1, 0)], m[(1, 1)]]]
}
