//! What a step of a `SelfCalibrator` did, as a frozen Python value.

use tiltvp_core::selfcalib as core;

use crate::value::value;

value! {
    /// What a step of a `SelfCalibrator` did.
    CalibrationStep(core::CalibrationStep as own) {
        /// Normalised innovation squared of the bearings that were fused: chi-square of `used` degrees of freedom.
        nis: f64,
        /// Bearings of known landmarks that were fused.
        used: usize,
        /// Bearings of known landmarks that did not pass the gate.
        rejected: usize,
        /// Landmarks seen for the first time.
        started: usize,
    }
}
