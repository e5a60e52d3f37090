//! What a whole log tells, as a frozen Python value.

use nalgebra::Vector2;
use pyo3::prelude::*;
use tiltvp_core::selfcalib as core;

use super::mounting::MountingEstimate;
use crate::call::invalid;
use crate::value::value;

value! {
    /// The mounting, and what else was estimated, from a whole log. True if it can be relied upon.
    LogCalibration(core::LogCalibration as own) {
        /// The mounting; covariances are scaled by the residuals where these are larger than assumed.
        mounting: MountingEstimate = MountingEstimate::from(own.estimate),
        /// Distance between the wheels, metres, as given or as estimated.
        wheel_base_m: f64 = own.wheels.base_m,
        /// Standard deviation of it; 0 where it was not estimated.
        wheel_base_sigma_m: f64 = own.wheels_sigma[1],
        /// How much farther the right wheel goes than the left when both report the same: a ratio, 1 where not estimated.
        right_over_left: f64 = right_over_left(own),
        /// Standard deviation of it; 0 where it was not estimated.
        right_over_left_sigma: f64 = 2.0 * own.wheels_sigma[0] * right_over_left(own),
        /// Half the logarithm of `right_over_left`.
        imbalance: f64 = own.wheels.imbalance,
        /// Standard deviation of it; 0 where it was not estimated.
        imbalance_sigma: f64 = own.wheels_sigma[0],
        /// By how much bearings are later than the odometry, seconds; 0 where it was not estimated.
        time_offset_s: f64,
        /// Standard deviation of it; 0 where it was not estimated.
        time_offset_sigma_s: f64,
        /// Fresh (2,) float64: how far the image centre about which the bearings were taken is off, along bearings 0 and 90 degrees, in
        /// units of the radius at which lines are seen: radians; 0 where it was not estimated. A camera that leans errs alike.
        centre_off_rad: Vector2<f64>,
        /// Fresh (2,) float64: standard deviations of it; 0 where it was not estimated.
        centre_off_sigma_rad: Vector2<f64>,
        /// Fresh (2,) float64: how much later than in the middle of the image lines along bearings 0 and 90 degrees are seen, as through
        /// a rolling shutter: seconds, in a log without times steps; 0 where it was not estimated. Others by the cosine of their bearing
        /// of the one and the sine of the other.
        rolling_shutter_s: Vector2<f64>,
        /// Fresh (2,) float64: standard deviations of it; 0 where it was not estimated.
        rolling_shutter_sigma_s: Vector2<f64>,
        /// Bearings that were used; of those taken at a standstill only the first.
        bearings: usize,
        /// Bearings farther off than 4.5 standard deviations, which count for nothing.
        outliers: usize,
        /// Root of the mean squared residual of the others, in standard deviations of a bearing.
        residual_rms: f64,
        /// Linearisations.
        iterations: u32,
        /// Whether the descent came to rest.
        converged: bool,
        /// Standard deviation of a bearing: as given, or as the residuals tell it where they say that it is larger.
        bearing_sigma_rad: f64,
        /// Variance of a wheel's displacement for each metre of it, likewise.
        odometry_k_m: f64,
        /// How the log may have been meant, where it fits that way only: "reflected" (wheels swapped, both negated, or bearings
        /// clockwise), "left wheel negated", "right wheel negated", "degrees", "millimetres" or "cumulative". None if it fits.
        misreading: Option<String> = own.misreading.map(|misreading| misreading.name().to_owned()),
        /// Fresh (N, 2) float64: the parts of the drive whose motions the bearings contradict, as on a carpet, each from which share of it
        /// to which, 0 to 1. Their odometry is taken to have ten times its standard deviations.
        doubted: Vec<Vector2<f64>>,
        /// Names of landmarks whose bearings are those of two places, which were taken apart.
        merged_landmarks: Vec<u64>,
        /// Whether the answer can be relied upon, and what speaks against it, in a sentence.
        reason: String = own.to_string(),
    }
    make core::LogCalibration {
        estimate: mounting.inner,
        wheels: core::Wheels { imbalance, base_m: wheel_base_m },
        wheels_sigma: [imbalance_sigma, wheel_base_sigma_m],
        time_offset_s,
        time_offset_sigma_s,
        centre_off_rad,
        centre_off_sigma_rad,
        rolling_shutter_s,
        rolling_shutter_sigma_s,
        bearings,
        outliers,
        residual_rms,
        iterations,
        converged,
        bearing_sigma_rad,
        odometry_k_m,
        misreading: misread("values[\"misreading\"]", misreading.as_deref())?,
        doubted,
        merged_landmarks,
    };
    repr format!(
        "LogCalibration({}, residual_rms={:.3}, bearings={}, outliers={}, converged={})",
        MountingEstimate::from(own.estimate).text(), own.residual_rms, own.bearings, own.outliers, own.converged
    );
}

fn right_over_left(log: &core::LogCalibration) -> f64 {
    (2.0 * log.wheels.imbalance).exp()
}

/// A clause: what a log fits with that was misread, by one of the names of `LogCalibration.misreading`.
///
/// Raises `tiltvp.errors.InvalidInputError` for another name.
#[pyfunction]
pub(crate) fn misreading_clause(name: &str) -> PyResult<String> {
    Ok(misread("name", Some(name))?.map(|misreading| misreading.to_string()).unwrap_or_default())
}

/// The misreading of a name; `argument` is what has it.
fn misread(argument: &str, name: Option<&str>) -> PyResult<Option<core::Misreading>> {
    let found = name.map(|name| core::Misreading::from_name(name).ok_or(name)).transpose();
    found.map_err(|name| {
        let expected = core::Misreading::NAMES.join(", ");
        invalid(format!("{argument}: unknown name {name:?}, expected {expected}"))
    })
}

#[pymethods]
impl LogCalibration {
    /// Whether the answer can be relied upon: the mounting can be, the descent came to rest, and the log was not misread.
    fn __bool__(&self) -> bool {
        self.inner.reliable()
    }
}
