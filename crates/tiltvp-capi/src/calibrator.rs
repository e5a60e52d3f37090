//! Where a camera sits on a robot, step by step while it drives.

use std::ffi::c_char;
use std::mem::MaybeUninit;
use std::sync::{Mutex, MutexGuard};

use nalgebra::Matrix3;
use tiltvp_core::Error;
use tiltvp_core::selfcalib::{self as core, SelfCalibratorOptions, WheelMotion};

use crate::border::{Failure, Outcome, Status, answer, end, given, make, run};
use crate::pointers::{maybe_text, slice};
use crate::text::{TILTVP_REASON_BYTES, options};

/// Estimates where a camera sits on a robot from the wheels' displacements and bearings of landmarks. Threads wait for each other.
pub struct SelfCalibrator {
    inner: Mutex<core::SelfCalibrator>,
}

/// What a step did.
#[repr(C)]
pub struct CalibrationStep {
    /// Normalised innovation squared of the bearings that were fused: chi-square of `used` degrees of freedom.
    pub nis: f64,
    /// Bearings of known landmarks that were fused.
    pub used: usize,
    /// Bearings of known landmarks that did not pass the gate.
    pub rejected: usize,
    /// Landmarks seen for the first time.
    pub started: usize,
}

/// The mounting as it is known.
#[repr(C)]
pub struct MountingEstimate {
    /// Whether it can be relied upon: everything determined, finite, no alarm, nothing suspected.
    pub reliable: bool,
    /// Whether the drive so far has determined phi.
    pub phi_determined: bool,
    /// Whether it has determined rho.
    pub rho_determined: bool,
    /// Whether it has determined psi.
    pub psi_determined: bool,
    /// Whether it has determined yaw.
    pub yaw_determined: bool,
    /// Whether rho is not significantly above zero, where phi and psi mean nothing: use x, y and yaw.
    pub rho_near_zero: bool,
    /// Whether bearings ever disagreed with the mounting over a window of steps, as after a bump.
    pub alarm: bool,
    /// How far the camera is in front of the middle of the wheel axle, metres.
    pub x_m: f64,
    /// How far it is to the left of it, metres.
    pub y_m: f64,
    /// How far its x axis is turned to the left against the robot's, phi + psi, in (-pi, pi] radians.
    pub yaw_rad: f64,
    /// The direction in which the camera is, in (-pi, pi] radians.
    pub phi_rad: f64,
    /// Its distance from the middle of the axle, metres.
    pub rho_m: f64,
    /// yaw - phi, in (-pi, pi] radians.
    pub psi_rad: f64,
    /// Covariance of (x_m, y_m, yaw_rad), 3 x 3 in row order.
    pub covariance_xy_yaw: [f64; 9],
    /// Covariance of (phi_rad, rho_m, psi_rad), 3 x 3 in row order; infinite at rho = 0.
    pub covariance_phi_rho_psi: [f64; 9],
    /// Mean normalised innovation squared of a bearing over the last steps, 1 if all is as assumed; NaN before the first.
    pub mean_nis: f64,
    /// Whether it can be relied upon, what is determined, what motion would help and what is suspected: a sentence.
    pub reason: [c_char; TILTVP_REASON_BYTES],
}

/// A calibrator that has seen nothing. `options` is a text in TOML with the options of `SelfCalibrator` in docs/options.md, NULL for
/// the defaults; `wheel_base_m` is none of them here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tiltvp_self_calibrator_new(
    wheel_base_m: f64,
    options: *const c_char,
    calibrator: Option<&mut MaybeUninit<*mut SelfCalibrator>>,
) -> Status {
    make(calibrator, "calibrator", || {
        // SAFETY: a text of the caller's, or NULL.
        let text = unsafe { maybe_text(options, "options") }?;
        let usual = SelfCalibratorOptions { wheel_base_m, ..SelfCalibratorOptions::default() };
        let given = self::options(text, |method| with_method(usual, method))?;
        if given.wheel_base_m.to_bits() != wheel_base_m.to_bits() {
            return Err(Error::option("wheel_base_m", given.wheel_base_m, "it as an argument alone").into());
        }
        Ok(SelfCalibrator { inner: Mutex::new(core::SelfCalibrator::new(given)?) })
    })
}

/// Moves by the displacements of the wheels in metres, then takes the bearings of `count` landmarks by their numbers: radians in the
/// camera's frame, counter-clockwise.
///
/// `step` may be NULL. What makes no sense is refused; the calibrator is then as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tiltvp_self_calibrator_step(
    calibrator: Option<&SelfCalibrator>,
    delta_left_m: f64,
    delta_right_m: f64,
    landmark_ids: *const u64,
    bearings_rad: *const f64,
    count: usize,
    step: Option<&mut MaybeUninit<CalibrationStep>>,
) -> Status {
    run(|| {
        let mut inner = given(calibrator, "calibrator")?.locked()?;
        // SAFETY: rows of the caller's, or NULL.
        let (landmarks, bearings) =
            unsafe { (slice(landmark_ids, count, "landmark_ids")?, slice(bearings_rad, count, "bearings_rad")?) };
        let motion = WheelMotion { left_m: delta_left_m, right_m: delta_right_m };
        let core::CalibrationStep { nis, used, rejected, started } = inner.step(&motion, landmarks, bearings)?;
        if let Some(step) = step {
            step.write(CalibrationStep { nis, used, rejected, started });
        }
        Ok(())
    })
}

/// Looks for what the drive so far contradicts and which assumption is likely wrong; estimates then say so. It costs some twenty
/// solutions of the window: call it before an estimate that decides something, not after every step.
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_self_calibrator_examine(calibrator: Option<&SelfCalibrator>) -> Status {
    run(|| {
        given(calibrator, "calibrator")?.locked()?.examine();
        Ok(())
    })
}

/// The mounting as it is known now. What is suspected is as of the last `tiltvp_self_calibrator_examine`.
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_self_calibrator_estimate(
    calibrator: Option<&SelfCalibrator>,
    estimate: Option<&mut MaybeUninit<MountingEstimate>>,
) -> Status {
    answer(estimate, "estimate", || {
        let found = given(calibrator, "calibrator")?.locked()?.estimate();
        Ok(MountingEstimate::from(&found))
    })
}

/// Ends a calibrator. NULL is nothing to end.
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_self_calibrator_free(calibrator: Option<Box<SelfCalibrator>>) {
    end(calibrator);
}

impl SelfCalibrator {
    /// The calibrator, for this thread alone; none after a fault, which may have left it in any state.
    fn locked(&self) -> Outcome<MutexGuard<'_, core::SelfCalibrator>> {
        self.inner.lock().map_err(|_| {
            Failure(Status::InternalError, "calibrator: a fault has ended a step of it, make a new one".to_owned())
        })
    }
}

/// The method is an option among others here.
fn with_method(mut usual: SelfCalibratorOptions, method: Option<&str>) -> tiltvp_core::Result<SelfCalibratorOptions> {
    use tiltvp_core::options::{Options, Value};
    if let Some(method) = method {
        usual.set("method", &Value::Text(method.to_owned()))?;
    }
    Ok(usual)
}

/// Nine numbers in row order.
fn rows(matrix: &Matrix3<f64>) -> [f64; 9] {
    std::array::from_fn(|i| matrix[(i / 3, i % 3)])
}

impl From<&core::MountingEstimate> for MountingEstimate {
    fn from(found: &core::MountingEstimate) -> Self {
        let (at, known) = (&found.mounting, &found.observability);
        Self {
            reliable: found.reliable(),
            phi_determined: known.phi,
            rho_determined: known.rho,
            psi_determined: known.psi,
            yaw_determined: known.yaw,
            rho_near_zero: known.rho_near_zero,
            alarm: found.alarm,
            x_m: at.x_m,
            y_m: at.y_m,
            yaw_rad: at.yaw_rad,
            phi_rad: at.phi_rad(),
            rho_m: at.rho_m(),
            psi_rad: at.psi_rad(),
            covariance_xy_yaw: rows(&found.covariance_xy_yaw),
            covariance_phi_rho_psi: rows(&found.covariance_phi_rho_psi),
            mean_nis: found.mean_nis.unwrap_or(f64::NAN),
            reason: crate::text::sentence(&found.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ptr;

    use super::*;
    use crate::testing::{boxed, last_error, made};

    fn calibrator(options: *const c_char) -> Box<SelfCalibrator> {
        // SAFETY: a text, or NULL.
        boxed(|handle| unsafe { tiltvp_self_calibrator_new(0.4, options, handle) })
    }

    /// Steps of a drive past three landmarks, here and by the core.
    #[test]
    fn steps_and_estimates_are_those_of_the_core() {
        let here = calibrator(c"start = [0.1, 0.0, 0.2]".as_ptr());
        let mut options = SelfCalibratorOptions { wheel_base_m: 0.4, ..SelfCalibratorOptions::default() };
        options.start = core::Mounting { x_m: 0.1, y_m: 0.0, yaw_rad: 0.2 };
        let mut expected = core::SelfCalibrator::new(options).unwrap();
        let landmarks = [5u64, 6, u64::MAX];
        for k in 0..40u32 {
            let bearings: [f64; 3] = std::array::from_fn(|i| 0.9 * i as f64 + 0.01 * f64::from(k));
            let motion = WheelMotion { left_m: 0.05, right_m: if k % 3 == 0 { 0.07 } else { 0.05 } };
            let core::CalibrationStep { nis, used, .. } = expected.step(&motion, &landmarks, &bearings).unwrap();
            // SAFETY: three of each.
            let step = made(|place| unsafe {
                let (names, angles) = (landmarks.as_ptr(), bearings.as_ptr());
                tiltvp_self_calibrator_step(Some(&here), motion.left_m, motion.right_m, names, angles, 3, place)
            });
            assert_eq!((step.nis, step.used), (nis, used));
        }
        assert_eq!(tiltvp_self_calibrator_examine(Some(&here)), Status::Ok);
        expected.examine();
        let (found, expected) =
            (made(|place| tiltvp_self_calibrator_estimate(Some(&here), place)), expected.estimate());
        assert_eq!((found.x_m, found.y_m, found.yaw_rad), {
            let at = expected.mounting;
            (at.x_m, at.y_m, at.yaw_rad)
        });
        assert_eq!((found.reliable, found.alarm), (expected.reliable(), expected.alarm));
        assert_eq!(found.covariance_xy_yaw[5], expected.covariance_xy_yaw[(1, 2)]);
        assert_eq!(found.reason, crate::text::sentence(&expected.to_string()));
    }

    #[test]
    fn a_calibrator_that_has_seen_nothing_says_so() {
        let found = made(|place| tiltvp_self_calibrator_estimate(Some(&calibrator(ptr::null())), place));
        assert!(!found.reliable && !found.yaw_determined && !found.alarm && found.mean_nis.is_nan());
    }

    #[test]
    fn what_makes_no_sense_is_refused_and_null_too() {
        let mut handle = MaybeUninit::uninit();
        // SAFETY: texts.
        let statuses = unsafe {
            [
                tiltvp_self_calibrator_new(0.0, ptr::null(), Some(&mut handle)),
                tiltvp_self_calibrator_new(0.4, c"gate_probability = 2".as_ptr(), Some(&mut handle)),
                tiltvp_self_calibrator_new(0.4, c"method = 'none'".as_ptr(), Some(&mut handle)),
                tiltvp_self_calibrator_new(0.4, c"wheel_base_m = 0.5".as_ptr(), Some(&mut handle)),
            ]
        };
        assert_eq!(statuses, [Status::InvalidOption; 4]);
        let (here, one) = (calibrator(ptr::null()), [0u64; 2]);
        // SAFETY: so many of each, or NULL.
        let statuses = unsafe {
            [
                tiltvp_self_calibrator_step(None, 0.0, 0.0, ptr::null(), ptr::null(), 0, None),
                tiltvp_self_calibrator_step(Some(&here), 0.1, 0.1, one.as_ptr(), ptr::null(), 1, None),
                tiltvp_self_calibrator_step(Some(&here), f64::NAN, 0.1, ptr::null(), ptr::null(), 0, None),
                tiltvp_self_calibrator_step(Some(&here), 0.1, 0.1, one.as_ptr(), [0.0; 2].as_ptr(), 2, None),
                tiltvp_self_calibrator_examine(None),
                tiltvp_self_calibrator_estimate(Some(&here), None),
            ]
        };
        assert_eq!(statuses, [Status::InvalidArgument; 6]);
        // SAFETY: nothing is looked at.
        let status = unsafe { tiltvp_self_calibrator_step(Some(&here), 0.1, 0.1, ptr::null(), ptr::null(), 0, None) };
        assert_eq!(status, Status::Ok, "{}", last_error());
        tiltvp_self_calibrator_free(None);
    }
}
