//! Options by keyword: each name is set on the core's options of the method, and no default is written here.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::edges::{Mask, NormalKind};
use tiltvp_core::tilt::{Correction, Method, TiltOptions, TrainedCorrection};

use super::{correction, sampling};
use crate::call::{exception, invalid};
use crate::convert;

/// Options of every method.
const COMMON: [&str; 9] = [
    "gradient_min",
    "smoothing_px",
    "elevation_min_rad",
    "elevation_max_rad",
    "margin_px",
    "tilt_max_rad",
    "mask",
    "row_stride",
    "seed",
];

/// Options of one method alone.
fn own(method: &Method) -> &'static [&'static str] {
    match method {
        Method::ImageSpaceRansac { .. } => {
            &["threshold_px", "offset_max_px", "correction", "sampling", "local_optimization", "score", "verification"]
        }
        Method::ImageSpaceRejectRefit { .. } => &["keep_fraction", "max_iterations", "offset_max_px", "correction"],
        Method::VectorConsensus { .. } => {
            &["threshold_rad", "normal", "correction", "sampling", "local_optimization", "score", "verification"]
        }
        Method::Refined(_) => &["keep_fraction", "scale_rad", "tolerance_rad", "max_iterations"],
    }
}

/// The core's options of a method with the user's values set.
pub(super) fn parse(method: &str, given: Option<&Bound<'_, PyDict>>) -> PyResult<TiltOptions> {
    let mut options = TiltOptions::for_method(method).map_err(|error| exception(&error))?;
    change(&mut options, given)?;
    Ok(options)
}

/// Sets the user's values.
pub(super) fn change(options: &mut TiltOptions, given: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
    for (key, value) in given.into_iter().flat_map(PyDictMethods::iter) {
        let key: String = key.extract()?;
        set(options, &key, &value)?;
    }
    Ok(())
}

fn set(options: &mut TiltOptions, key: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let number = || {
        value.extract::<f64>().map_err(|_| {
            invalid(format!(
                "option {key} = {}, expected a number",
                value.repr().map_or_else(|_| String::new(), |r| r.to_string())
            ))
        })
    };
    match (key, &mut options.method) {
        ("gradient_min", _) => options.edges.gradient_min = number()?,
        ("smoothing_px", _) => options.edges.smoothing_px = number()?,
        ("elevation_min_rad", _) => options.edges.elevation_min_rad = number()?,
        ("elevation_max_rad", _) => options.edges.elevation_max_rad = number()?,
        ("margin_px", _) => options.edges.margin_px = number()?,
        ("tilt_max_rad", _) => options.tilt_max_rad = if value.is_none() { None } else { Some(number()?) },
        ("mask", _) => {
            options.mask = if value.is_none() {
                None
            } else {
                let (height, width, usable) = convert::mask(value, "mask")?;
                Some(Mask::new(width, height, usable).map_err(|error| exception(&error))?)
            };
        }
        ("row_stride", _) => options.row_stride = whole(key, value, 1)?,
        ("seed", _) => {
            options.seed = value
                .extract()
                .map_err(|_| invalid(format!("option seed = {value}, expected a whole number from 0 to 2^64 - 1")))?;
        }
        ("threshold_px", Method::ImageSpaceRansac { threshold_px, .. }) => *threshold_px = number()?,
        (
            "offset_max_px",
            Method::ImageSpaceRansac { offset_max_px, .. } | Method::ImageSpaceRejectRefit { offset_max_px, .. },
        ) => *offset_max_px = if value.is_none() { None } else { Some(number()?) },
        (
            "correction",
            Method::ImageSpaceRansac { correction, .. } | Method::ImageSpaceRejectRefit { correction, .. },
        ) => {
            *correction = match value.extract::<String>() {
                _ if value.is_none() => Correction::None,
                Ok(word) if word == "closed-form" => Correction::ClosedForm,
                _ => Correction::Trained(correction::parse(value, "option correction", "\"closed-form\", None, ")?),
            };
        }
        ("correction", Method::VectorConsensus { correction, .. }) => {
            *correction = if value.is_none() {
                TrainedCorrection::Factor(1.0)
            } else {
                correction::parse(value, "option correction", "None, ")?
            };
        }
        ("keep_fraction", Method::ImageSpaceRejectRefit { keep_fraction, .. }) => *keep_fraction = number()?,
        ("keep_fraction", Method::Refined(refine)) => refine.keep_fraction = number()?,
        ("threshold_rad", Method::VectorConsensus { threshold_rad, .. }) => *threshold_rad = number()?,
        ("normal", Method::VectorConsensus { normal, .. }) => {
            *normal = match value.extract::<String>().as_deref() {
                Ok("gradient") => NormalKind::Gradient,
                Ok("tangent") => NormalKind::Tangent,
                _ => return Err(invalid(format!("option normal = {value}, expected \"gradient\" or \"tangent\""))),
            };
        }
        ("scale_rad", Method::Refined(refine)) => refine.scale_rad = number()?,
        ("tolerance_rad", Method::Refined(refine)) => refine.tolerance_rad = number()?,
        ("max_iterations", Method::Refined(refine)) => refine.max_iterations = whole(key, value, 1)?,
        ("max_iterations", Method::ImageSpaceRejectRefit { max_iterations, .. }) => {
            *max_iterations = whole(key, value, 0)?;
        }
        (
            key @ ("sampling" | "local_optimization" | "score" | "verification"),
            Method::ImageSpaceRansac { sampling, .. } | Method::VectorConsensus { sampling, .. },
        ) => sampling::set(sampling, key, value)?,
        (_, method) => return Err(unknown(value.py(), key, method)),
    }
    Ok(())
}

fn whole(key: &str, value: &Bound<'_, PyAny>, from: u32) -> PyResult<u32> {
    value.extract().map_err(|_| invalid(format!("option {key} = {value}, expected a whole number from {from}")))
}

/// The error for an option that the method does not have: the near ones, then all.
fn unknown(py: Python<'_>, key: &str, method: &Method) -> PyErr {
    let names: Vec<&str> = own(method).iter().chain(&COMMON).copied().collect();
    let near = || -> PyResult<Vec<String>> {
        py.import("difflib")?.call_method1("get_close_matches", (key, names.clone()))?.extract()
    };
    let hint = match near() {
        Ok(near) if !near.is_empty() => format!(" (did you mean {}?)", near.join(" or ")),
        _ => String::new(),
    };
    invalid(format!(
        "option {key}: unknown to method \"{}\"{hint}, expected one of {}",
        method.name(),
        names.join(", ")
    ))
}

/// All options in force, as keywords that would make them so.
pub(super) fn in_force<'py>(py: Python<'py>, options: &TiltOptions) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("gradient_min", options.edges.gradient_min)?;
    dict.set_item("smoothing_px", options.edges.smoothing_px)?;
    dict.set_item("elevation_min_rad", options.edges.elevation_min_rad)?;
    dict.set_item("elevation_max_rad", options.edges.elevation_max_rad)?;
    dict.set_item("margin_px", options.edges.margin_px)?;
    dict.set_item("tilt_max_rad", options.tilt_max_rad)?;
    let mask = options.mask.as_ref().map(|mask| convert::to_mask(py, mask));
    dict.set_item("mask", mask.transpose()?)?;
    dict.set_item("row_stride", options.row_stride)?;
    dict.set_item("seed", options.seed)?;
    let word = |correction: &Correction| -> PyResult<Py<PyAny>> {
        Ok(match correction {
            Correction::None => py.None(),
            Correction::Trained(trained) => correction::show(py, trained)?,
            Correction::ClosedForm => "closed-form".into_pyobject(py)?.into_any().unbind(),
        })
    };
    match &options.method {
        Method::ImageSpaceRansac { threshold_px, offset_max_px, correction, sampling } => {
            sampling::in_force(&dict, sampling)?;
            dict.set_item("threshold_px", threshold_px)?;
            dict.set_item("offset_max_px", offset_max_px)?;
            dict.set_item("correction", word(correction)?)?;
        }
        Method::ImageSpaceRejectRefit { keep_fraction, max_iterations, offset_max_px, correction } => {
            dict.set_item("keep_fraction", keep_fraction)?;
            dict.set_item("max_iterations", max_iterations)?;
            dict.set_item("offset_max_px", offset_max_px)?;
            dict.set_item("correction", word(correction)?)?;
        }
        Method::VectorConsensus { threshold_rad, normal, correction, sampling } => {
            sampling::in_force(&dict, sampling)?;
            dict.set_item("threshold_rad", threshold_rad)?;
            dict.set_item("normal", if *normal == NormalKind::Gradient { "gradient" } else { "tangent" })?;
            dict.set_item("correction", correction::show(py, correction)?)?;
        }
        Method::Refined(refine) => {
            dict.set_item("keep_fraction", refine.keep_fraction)?;
            dict.set_item("scale_rad", refine.scale_rad)?;
            dict.set_item("tolerance_rad", refine.tolerance_rad)?;
            dict.set_item("max_iterations", refine.max_iterations)?;
        }
    }
    Ok(dict)
}
