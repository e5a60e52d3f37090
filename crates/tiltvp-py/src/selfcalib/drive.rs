//! `simulate_drive`: drives past vertical lines with known truth, and the bound that no estimator can beat on them.

use nalgebra::{Matrix3, Vector3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::Error;
use tiltvp_core::selfcalib::{self as core, SelfCalibratorOptions};
use tiltvp_synth::{BearingDrive, BearingDriveKind, BearingDriveOptions};

use crate::array::Array;
use crate::call::{call_long, exception};
use crate::convert::{self, Word};
use crate::options;
use crate::value::frozen;

/// A simulated drive past vertical lines, and the truth behind it.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct SimulatedDrive {
    options: BearingDriveOptions,
    drive: BearingDrive,
}

#[pymethods]
impl SimulatedDrive {
    /// Fresh (N, 2) float64: displacements of the left and the right wheel in each step, metres.
    #[getter]
    fn odometry<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let rows: Vec<[f64; 2]> = self.drive.readings.iter().map(|m| [m.left_m, m.right_m]).collect();
        convert::to_rows(py, &rows, false)
    }

    /// Fresh (M, 3) float64: step, landmark and bearing in radians of every bearing.
    #[getter]
    fn bearings<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let mut rows = Vec::new();
        for (step, seen) in self.drive.bearings_rad.iter().enumerate() {
            rows.extend(seen.iter().enumerate().map(|(landmark, bearing)| [step as f64, landmark as f64, *bearing]));
        }
        convert::to_rows(py, &rows, false)
    }

    /// Fresh (N, 3) float64: the true pose (x_m, y_m, heading_rad) after each step, from (0, 0, 0).
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let rows: Vec<[f64; 3]> = self.drive.poses.iter().map(|pose| (*pose).into()).collect();
        convert::to_rows(py, &rows, false)
    }

    /// Fresh (L, 2) float64: where the lines are, metres.
    #[getter]
    fn landmarks_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let rows: Vec<[f64; 2]> = self.drive.landmarks_m.iter().map(|place| (*place).into()).collect();
        convert::to_rows(py, &rows, false)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (&'static str,))> {
        let (o, keywords) = (&self.options, PyDict::new(py));
        keywords.set_item("seed", o.seed)?;
        keywords.set_item("mounting", [o.mounting.x_m, o.mounting.y_m, o.mounting.yaw_rad])?;
        keywords.set_item("landmarks", o.landmarks)?;
        keywords.set_item("bearing_sigma_rad", o.bearing_sigma_rad)?;
        keywords.set_item("odometry_k_m", o.odometry_k_m)?;
        keywords.set_item("wheel_base_m", o.wheel_base_m)?;
        keywords.set_item("outliers", o.outliers)?;
        let make = py.import("tiltvp._core")?.getattr("simulate_drive")?;
        Ok((py.import("functools")?.getattr("partial")?.call((make,), Some(&keywords))?, (o.kind.name(),)))
    }

    fn __repr__(&self) -> String {
        let (o, steps) = (&self.options, self.drive.readings.len());
        format!("SimulatedDrive({:?}, seed={}, {steps} steps, {} landmarks)", o.kind.name(), o.seed, o.landmarks)
    }

    /// (3, 3): the smallest covariance of (x, y, yaw) that an unbiased estimator can have on this drive.
    #[pyo3(signature = (*, start_sigma: "ArrayLike"))]
    fn cramer_rao_bound<'py>(&self, py: Python<'py>, start_sigma: &Bound<'_, PyAny>) -> PyResult<Array<'py, f64>> {
        let sigma: Vector3<f64> = convert::vector3(start_sigma, "start_sigma")?;
        let o = self.options;
        let options = SelfCalibratorOptions {
            wheel_base_m: o.wheel_base_m,
            bearing_sigma_rad: o.bearing_sigma_rad,
            odometry_k_m: o.odometry_k_m,
            start: o.mounting,
            start_covariance: Matrix3::from_diagonal(&sigma.map(|s| s * s)),
            ..SelfCalibratorOptions::default()
        };
        let sights = vec![(0..o.landmarks).collect::<Vec<_>>(); self.drive.poses.len()];
        let bound = call_long(py, || {
            let drive = &self.drive;
            core::cramer_rao_bound(&options, &o.mounting, &drive.readings, &drive.poses, &drive.landmarks_m, &sights)
        })?;
        convert::to_matrix(py, &bound)
    }
}

frozen!(SimulatedDrive, |own| own.options, |own| (own.options.kind.name(), own.options.seed));

/// A drive past 10 vertical lines: "paper" (2.3 m straight on, half a turn), "alternating", "straight", "rotation" or "arcs".
///
/// `mounting` is (x_m, y_m, yaw_rad), None: the paper's phi = -0.34, rho = 0.23, psi = 0.33. The noise is that of the
/// defaults of `SelfCalibrator`, wheels are 0.4 m apart, `outliers` is the share of bearings that are of nothing.
#[pyfunction]
#[pyo3(signature = (kind="paper".into(), **options: "Option | None"))]
pub(crate) fn simulate_drive(
    py: Python<'_>,
    kind: Word,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<SimulatedDrive> {
    let options = options::given(
        BearingDriveOptions { kind: kind.choose(kind_from)?, ..BearingDriveOptions::default() },
        options,
    )?;
    options.validate().map_err(|error| exception(&error))?;
    let drive = call_long(py, || Ok::<_, Error>(BearingDrive::new(&options)))?;
    Ok(SimulatedDrive { options, drive })
}

/// (L, 2): distance in metres and turn in radians of the legs of a trajectory of `simulate_drive`.
#[pyfunction]
#[pyo3(signature = (kind="paper".into()))]
pub(crate) fn drive_legs(py: Python<'_>, kind: Word) -> PyResult<Array<'_, f64>> {
    let rows: Vec<[f64; 2]> = kind.choose(kind_from)?.legs().into_iter().map(Into::into).collect();
    convert::to_rows(py, &rows, false)
}

fn kind_from(name: &str) -> Result<BearingDriveKind, Error> {
    let expected = || format!("one of {}", BearingDriveKind::NAMES.join(", "));
    BearingDriveKind::from_name(name).ok_or_else(|| Error::argument("kind", format!("{name:?}"), expected()))
}
