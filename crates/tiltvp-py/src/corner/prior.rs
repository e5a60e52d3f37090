//! What is known beforehand, from the dicts that the priors of `tiltvp.corner` make.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::corner::{AttitudePrior, VerticalSense};

use crate::call::invalid;
use crate::convert;
use crate::field::Field;

/// The priors of an iterable of dicts, or of values with `to_dict`.
pub(super) fn parse(values: &Bound<'_, PyAny>) -> PyResult<Vec<AttitudePrior>> {
    let mut priors = Vec::new();
    for value in values.try_iter().map_err(|_| invalid("priors: expected a sequence of priors".to_owned()))? {
        let dict = value?.call_method0("to_dict").ok().and_then(|dict| dict.cast_into::<PyDict>().ok());
        let dict = dict.ok_or_else(|| {
            invalid("priors: expected GravityPrior, ElevationPrior or KnownAttitude of tiltvp.corner".to_owned())
        })?;
        priors.push(one(&dict)?);
    }
    Ok(priors)
}

fn one(values: &Bound<'_, PyDict>) -> PyResult<AttitudePrior> {
    let number = |key: &str| convert::item::<f64>(values, key, "a number");
    Ok(if values.contains("down")? {
        let down = convert::vector3(&convert::raw_item(values, "down")?, "down")?;
        AttitudePrior::Gravity { down, sigma_rad: number("sigma_rad")?, sense: sense(values)? }
    } else if values.contains("elevation_rad")? {
        let elevation_rad = number("elevation_rad")?;
        AttitudePrior::Elevation { elevation_rad, sigma_rad: number("sigma_rad")?, sense: sense(values)? }
    } else {
        AttitudePrior::Attitude {
            camera_from_object: Field::take(values, "camera_from_object")?,
            covariance: Field::take(values, "covariance_rad2")?,
        }
    })
}

fn sense(values: &Bound<'_, PyDict>) -> PyResult<VerticalSense> {
    let names = VerticalSense::ALL.map(VerticalSense::name).join(", ");
    let given: String = convert::item(values, "sense", &names)?;
    VerticalSense::ALL
        .into_iter()
        .find(|sense| sense.name() == given)
        .ok_or_else(|| invalid(format!("sense = {given:?}, expected one of {names}")))
}
