//! Where a camera sits on a robot, as a frozen Python value.

use nalgebra::{Matrix3, Vector3};
use pyo3::prelude::*;
use tiltvp_core::selfcalib as core;

use crate::call::invalid;
use crate::value::value;

value! {
    /// Where a camera sits on a robot, with how sure that is. True if it can be relied upon.
    MountingEstimate(core::MountingEstimate as own) {
        /// How far the camera is in front of the middle of the wheel axle, metres.
        x_m: f64 = own.mounting.x_m,
        /// How far it is to the left of it, metres.
        y_m: f64 = own.mounting.y_m,
        /// How far its x axis is turned to the left against the robot's, phi + psi, in (-pi, pi] radians.
        yaw_rad: f64 = own.mounting.yaw_rad,
        /// The paper's phi, the direction in which the camera is, in (-pi, pi] radians; means nothing where rho is near 0.
        phi_rad: f64 = own.mounting.phi_rad(),
        /// The paper's rho, the distance of the camera from the middle of the axle, metres.
        rho_m: f64 = own.mounting.rho_m(),
        /// The paper's psi = yaw - phi, in (-pi, pi] radians; means nothing where rho is near 0.
        psi_rad: f64 = own.mounting.psi_rad(),
        /// Fresh (3, 3) float64: covariance of (x, y, yaw).
        covariance_xy_yaw: Matrix3<f64>,
        /// Fresh (3, 3) float64: covariance of (phi, rho, psi); infinite where rho is 0.
        covariance_phi_rho_psi: Matrix3<f64>,
        /// Which of "phi", "rho", "psi", "yaw" the motion so far has determined, beliefs at the start aside.
        ///
        /// Angles to 0.05 rad (phi and psi at a rho beyond three of its standard deviations only), rho to 0.02 m or 5
        /// %.
        determined: Vec<String> = determined(&own.observability),
        /// Fresh (3,) float64: standard deviations of (phi, rho, psi) by the drive alone, without what was believed at the
        /// start.
        sigma_of_drive: Vector3<f64> = own.observability.sigma_phi_rho_psi,
        /// Fresh (3,) float64: standard deviations of (x, y, yaw) by the drive alone.
        sigma_of_drive_xy_yaw: Vector3<f64> = own.observability.sigma_xy_yaw,
        /// What motion would determine what is not determined yet.
        advice: String = own.observability.advice().to_owned(),
        /// Whether rho is not significantly above zero, where phi and psi mean nothing: use x, y and yaw.
        rho_near_zero: bool = own.observability.rho_near_zero,
        /// Mean normalised innovation squared of a bearing over the last steps: 1 if all is as assumed. None before the
        /// first.
        mean_nis: Option<f64>,
        /// Whether bearings ever disagreed with the mounting over a window of steps, as after a bump.
        alarm: bool,
        /// Motions from one pose with bearings to the next: of the whole log, or of the filter's window.
        motions: usize = own.contradictions.motions,
        /// Those that the bearings contradict: farther off than five standard deviations of the odometry.
        contradicted_motions: usize = own.contradictions.contradicted_motions,
        /// Turns by some 0.1 rad by the odometry.
        turns: usize = own.contradictions.turns,
        /// Those that the bearings contradict by more than half of the turn, whatever the noise.
        contradicted_turns: usize = own.contradictions.contradicted_turns,
        /// What is most likely wrong where the log does not fit: "turns" (a sign or a unit), "outliers" (a bump, or names), "bump",
        /// "slips", "bearing_sigma_rad", "odometry_k_m", "wheel_base_m", "right_over_left", "time_offset_s", "centre" (another image
        /// centre, or a camera that leans), "rolling_shutter" (lines are seen later on one side than on the other), "creep" (the camera
        /// turns all along the drive) or "drift" (motions of a part of the drive that err together). None if nothing is.
        suspect: Option<String> = own.suspect.map(|suspect| suspect.cause.name().to_owned()),
        /// The value that would suit the log better, of what `suspect` names (times in steps, or in seconds in a log with times); of
        /// "turns", "outliers" and "slips" their share, of "bump" its angle and of "centre" the largest error of a bearing in radians, of
        /// "rolling_shutter" how much later lines are seen on one side, of "creep" the angle in
        /// radians from the first step to the last, of "drift" the factor of a standard deviation.
        suspect_value: Option<f64> = own.suspect.map(|suspect| suspect.value),
        /// What is determined, what motion would help, whether there was an alarm and what is suspected, in a sentence.
        reason: String = own.to_string(),
    }
    make core::MountingEstimate {
        mounting: core::Mounting { x_m, y_m, yaw_rad },
        covariance_xy_yaw,
        covariance_phi_rho_psi,
        observability: {
            let [phi, rho, psi, yaw] = flags(&determined)?;
            let (sigma_phi_rho_psi, sigma_xy_yaw) = (sigma_of_drive, sigma_of_drive_xy_yaw);
            core::Observability { sigma_phi_rho_psi, sigma_xy_yaw, phi, rho, psi, yaw, rho_near_zero }
        },
        mean_nis,
        alarm,
        contradictions: core::Contradictions { motions, contradicted_motions, turns, contradicted_turns },
        suspect: suspected(suspect.as_deref(), suspect_value)?,
    };
    repr {
        let m = &own.mounting;
        format!("MountingEstimate(x_m={:.4}, y_m={:.4}, yaw_rad={:.4}): {own}", m.x_m, m.y_m, m.yaw_rad)
    };
}

/// What a drive can determine.
const DETERMINABLE: [&str; 4] = ["phi", "rho", "psi", "yaw"];

fn determined(o: &core::Observability) -> Vec<String> {
    let known = DETERMINABLE.into_iter().zip([o.phi, o.rho, o.psi, o.yaw]).filter(|(_, known)| *known);
    known.map(|(name, _)| name.to_owned()).collect()
}

/// Reads what [`determined`] wrote.
fn flags(determined: &[String]) -> PyResult<[bool; 4]> {
    if let Some(name) = determined.iter().find(|name| !DETERMINABLE.contains(&name.as_str())) {
        let expected = DETERMINABLE.join(", ");
        return Err(invalid(format!("values[\"determined\"]: unknown name {name:?}, expected {expected}")));
    }
    Ok(DETERMINABLE.map(|name| determined.iter().any(|found| found == name)))
}

/// The suspect of a name and a value.
fn suspected(name: Option<&str>, value: Option<f64>) -> PyResult<Option<core::Suspect>> {
    let Some(name) = name else { return Ok(None) };
    match (core::Cause::from_name(name), value) {
        (Some(cause), Some(value)) => Ok(Some(core::Suspect { cause, value })),
        (None, _) => {
            let expected = core::Cause::NAMES.join(", ");
            Err(invalid(format!("values[\"suspect\"]: unknown name {name:?}, expected {expected}")))
        }
        (_, None) => Err(invalid("values[\"suspect_value\"]: None, expected a number".to_owned())),
    }
}

#[pymethods]
impl MountingEstimate {
    /// Whether the answer can be relied upon: everything determined, finite, no alarm, nothing suspected.
    fn __bool__(&self) -> bool {
        self.inner.reliable()
    }
}
