//! What a filter answers, as frozen Python values: `FilteredTilt` and `FilterStep`.

use nalgebra::{Matrix2, Vector3};
use pyo3::prelude::*;
use tiltvp_core::tilt::{self as core, Verdict};

use super::values;
use crate::field::VerdictWord;
use crate::value::value;

value! {
    /// A tilt as a filter holds it to be. Frozen, comparable, hashable, pickled. False where the filter abstains.
    ///
    /// The filter abstains where `sigma_rad` exceeds `sigma_max_rad`: angles and normal are NaN then, while covariance
    /// and confidence still say how little is known.
    FilteredTilt(core::FilteredTilt as own) {
        /// How far the robot leans, in [0, pi] radians; NaN where the filter abstains.
        alpha_rad: f64 = values::angles(own.tilt.as_ref())[0],
        /// In which direction it leans, in (-pi, pi] radians: 0 forward, +pi/2 left; NaN where the filter abstains.
        beta_rad: f64 = values::angles(own.tilt.as_ref())[1],
        /// Roll about x in radians, right side down positive (Rz Ry Rx, ROS REP 103); NaN where the filter abstains.
        roll_rad: f64 = values::angles(own.tilt.as_ref())[2],
        /// Pitch about y in radians, nose down positive (Rz Ry Rx, ROS REP 103); NaN where the filter abstains.
        pitch_rad: f64 = values::angles(own.tilt.as_ref())[3],
        /// Fresh (3,) float64: the unit ground normal, eq. 1; NaN where the filter abstains.
        normal: Vector3<f64> = values::normal(own.tilt.as_ref()),
        /// Fresh (2, 2) float64 in squared radians: covariance of the normal in its tangent plane; finite also where the
        /// filter abstains.
        covariance_rad2: Matrix2<f64>,
        /// Probability, in [0, 1], that the error is below two degrees if it is normal with that covariance.
        confidence: f64,
        /// One standard deviation in radians in any one direction: the root of half the covariance's trace.
        sigma_rad: f64,
        /// The largest standard deviation of an answer: the filter's option.
        sigma_max_rad: f64,
        /// The standard deviation beside its limit, in a sentence.
        reason: String = own.to_string(),
    }
    make core::FilteredTilt {
        tilt: values::lean(&normal, [alpha_rad, beta_rad, roll_rad, pitch_rad])?,
        covariance_rad2,
        confidence,
        sigma_rad,
        sigma_max_rad,
    };
    repr match own.tilt {
        Some(tilt) => format!(
            "FilteredTilt(alpha_rad={:.5}, beta_rad={:.5}, confidence={:.3}, sigma_rad={:.5})",
            tilt.alpha_rad(), tilt.beta_rad(), own.confidence, own.sigma_rad
        ),
        None => format!("FilteredTilt(no tilt: {own})"),
    };
}

#[pymethods]
impl FilteredTilt {
    /// Whether there is a tilt: false where the filter abstains.
    fn __bool__(&self) -> bool {
        self.inner.tilt.is_some()
    }
}

value! {
    /// What a filter did with an estimate, and why. Frozen, comparable, hashable, pickled. True if it was fused.
    FilterStep as own {
        /// Whether the estimate was fused.
        accepted: bool,
        /// What was done, in a word.
        ///
        /// Fused: "accepted", or "jumped", if so many rejected estimates agreed that the floor's tilt was forgotten.
        /// Left out: "no-tilt", "repeated", if it is that of the image before to the last bit though the wheels have
        /// rolled, "low-confidence", "outside-gate", or "lost", if so many were rejected that the floor's tilt is taken
        /// to be unknown.
        verdict: VerdictWord,
        /// The same in a sentence, with the measured number and the limit.
        reason: String,
        /// The normalised innovation squared, of two degrees of freedom; None if it did not come to that.
        nis: Option<f64>,
    }
}

impl From<Verdict> for FilterStep {
    fn from(verdict: Verdict) -> Self {
        Self {
            accepted: verdict.accepted(),
            verdict: VerdictWord(verdict.name().to_owned()),
            reason: verdict.to_string(),
            nis: verdict.nis(),
        }
    }
}

#[pymethods]
impl FilterStep {
    /// Whether the estimate was fused.
    fn __bool__(&self) -> bool {
        self.accepted
    }
}
