//! The lean in values: the ground normal and the angles that follow from it.

use nalgebra::Vector3;
use pyo3::PyResult;
use tiltvp_core::geometry::Tilt;

use crate::call::invalid;

/// The ground normal; NaN without a lean.
pub(super) fn normal(tilt: Option<&Tilt>) -> Vector3<f64> {
    tilt.map_or(Vector3::repeat(f64::NAN), Tilt::normal)
}

/// Alpha, beta, roll and pitch in radians; NaN without a lean.
pub(super) fn angles(tilt: Option<&Tilt>) -> [f64; 4] {
    tilt.map_or([f64::NAN; 4], |tilt| [tilt.alpha_rad(), tilt.beta_rad(), tilt.roll_rad(), tilt.pitch_rad()])
}

/// The lean of a normal that a dict holds beside the angles, alpha, beta, roll and pitch. Refuses angles of another one.
pub(super) fn lean(normal: &Vector3<f64>, given: [f64; 4]) -> PyResult<Option<Tilt>> {
    let tilt = Tilt::from_normal(normal);
    let names = ["alpha_rad", "beta_rad", "roll_rad", "pitch_rad"];
    for ((name, given), angle) in names.iter().zip(given).zip(angles(tilt.as_ref())) {
        if (given - angle).abs() > 1e-9 || given.is_nan() != angle.is_nan() {
            return Err(invalid(format!("values[\"{name}\"] = {given}, expected {angle}, as the normal has it")));
        }
    }
    Ok(tilt)
}
