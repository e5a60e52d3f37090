//! `simulate_drive`: drives past vertical lines with known truth, and the bound that no estimator can beat on them.

use nalgebra::{Matrix3, Vector3};
use numpy::PyArray2;
use pyo3::prelude::*;
use tiltvp_core::Error;
use tiltvp_core::selfcalib::{self as core, Mounting, SelfCalibratorOptions};
use tiltvp_synth::{BearingDrive, BearingDriveKind, BearingDriveOptions};

use super::matrices::matrix3;
use crate::call::{call, invalid};
use crate::convert;

/// A simulated drive, and the truth behind it.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct SimulatedDrive {
    options: BearingDriveOptions,
    drive: BearingDrive,
}

#[pymethods]
impl SimulatedDrive {
    /// Fresh (N, 2) float64: displacements of the left and the right wheel in each step, metres.
    #[getter]
    fn odometry<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows: Vec<[f64; 2]> = self.drive.readings.iter().map(|m| [m.left_m, m.right_m]).collect();
        convert::to_rows(py, &rows, false)
    }

    /// Fresh (M, 3) float64: step, landmark and bearing in radians of every bearing.
    #[getter]
    fn bearings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut rows = Vec::new();
        for (step, seen) in self.drive.bearings_rad.iter().enumerate() {
            rows.extend(seen.iter().enumerate().map(|(landmark, bearing)| [step as f64, landmark as f64, *bearing]));
        }
        convert::to_rows(py, &rows, false)
    }

    /// Fresh (N, 3) float64: the true pose (x_m, y_m, heading_rad) after each step, from (0, 0, 0).
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows: Vec<[f64; 3]> = self.drive.poses.iter().map(|pose| (*pose).into()).collect();
        convert::to_rows(py, &rows, false)
    }

    /// Fresh (L, 2) float64: where the lines are, metres.
    #[getter]
    fn landmarks_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows: Vec<[f64; 2]> = self.drive.landmarks_m.iter().map(|place| (*place).into()).collect();
        convert::to_rows(py, &rows, false)
    }

    /// (3, 3): the smallest covariance of (x, y, yaw) that an unbiased estimator can have on this drive.
    #[pyo3(signature = (*, start_sigma))]
    fn cramer_rao_bound<'py>(
        &self,
        py: Python<'py>,
        start_sigma: &Bound<'_, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
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
        let bound = call(py, || {
            let drive = &self.drive;
            core::cramer_rao_bound(&options, &o.mounting, &drive.readings, &drive.poses, &drive.landmarks_m, &sights)
        })?;
        matrix3(py, &bound)
    }
}

/// Draws a drive past vertical lines.
#[pyfunction]
#[pyo3(signature = (
    kind="paper", *, seed=0, mounting=None, landmarks=None, bearing_sigma_rad=None, odometry_k_m=None,
    wheel_base_m=None, outliers=None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of the user")]
pub(crate) fn simulate_drive(
    py: Python<'_>,
    kind: &str,
    seed: u64,
    mounting: Option<&Bound<'_, PyAny>>,
    landmarks: Option<usize>,
    bearing_sigma_rad: Option<f64>,
    odometry_k_m: Option<f64>,
    wheel_base_m: Option<f64>,
    outliers: Option<f64>,
) -> PyResult<SimulatedDrive> {
    let kind = kind_from(kind)?;
    let mut options = BearingDriveOptions { kind, seed, ..BearingDriveOptions::default() };
    if let Some(mounting) = mounting {
        let v = convert::vector3(mounting, "mounting")?;
        options.mounting = Mounting { x_m: v.x, y_m: v.y, yaw_rad: v.z };
    }
    options.landmarks = landmarks.unwrap_or(options.landmarks).min(1000);
    for (name, value, field) in [
        ("bearing_sigma_rad", bearing_sigma_rad, &mut options.bearing_sigma_rad),
        ("odometry_k_m", odometry_k_m, &mut options.odometry_k_m),
        ("wheel_base_m", wheel_base_m, &mut options.wheel_base_m),
        ("outliers", outliers, &mut options.outliers),
    ] {
        if let Some(value) = value {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(invalid(format!("{name} = {value}, expected a finite number of zero or more")));
            }
            *field = value;
        }
    }
    if options.wheel_base_m == 0.0 {
        return Err(invalid("wheel_base_m = 0, expected a positive number of metres".to_owned()));
    }
    let drive = call(py, || Ok::<_, Error>(BearingDrive::new(&options)))?;
    Ok(SimulatedDrive { options, drive })
}

/// (L, 2): distance in metres and turn in radians of the legs of a trajectory.
#[pyfunction]
#[pyo3(signature = (kind="paper"))]
pub(crate) fn drive_legs<'py>(py: Python<'py>, kind: &str) -> PyResult<Bound<'py, PyAny>> {
    let rows: Vec<[f64; 2]> = kind_from(kind)?.legs().into_iter().map(Into::into).collect();
    convert::to_rows(py, &rows, false)
}

fn kind_from(name: &str) -> PyResult<BearingDriveKind> {
    BearingDriveKind::ALL.into_iter().find(|known| known.name() == name).ok_or_else(|| {
        let known = BearingDriveKind::ALL.map(BearingDriveKind::name).join(", ");
        invalid(format!("kind = {name:?}, expected one of {known}"))
    })
}
