//! Training sets of corrections: shifts, and the true leans that made them.

use crate::error::{Error, Result};

/// Checks a training set: shifts and true leans, as many of each.
///
/// # Errors
/// [`Error::InvalidArgument`] that says where and what.
pub(super) fn check_training(shift: &[f64], alpha_rad: &[f64], least: usize) -> Result<()> {
    if shift.len() != alpha_rad.len() || shift.len() < least {
        let expected = format!("as many leans as shifts, at least {least}");
        return Err(Error::argument("alpha_rad", format!("{} for {} shifts", alpha_rad.len(), shift.len()), expected));
    }
    let wrong = |values: &[f64], most: f64| values.iter().position(|x| !(*x >= 0.0 && *x < most));
    if let Some(i) = wrong(shift, f64::INFINITY) {
        return Err(Error::argument("shift", format!("{} in place {i}", shift[i]), "finite numbers of zero or more"));
    }
    if let Some(i) = wrong(alpha_rad, std::f64::consts::FRAC_PI_2) {
        return Err(Error::argument("alpha_rad", format!("{} in place {i}", alpha_rad[i]), "angles in [0, pi/2)"));
    }
    Ok(())
}
