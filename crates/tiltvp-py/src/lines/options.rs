//! Options by keyword: each name is set on the core's options of the method, and no default is written here.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::edges::Mask;
use tiltvp_core::lines::{DescriptorOptions, LineMethod, LineOptions, Normalisation};

use crate::call::{exception, invalid};
use crate::convert;

/// The core's options of a method with the user's values set.
pub(super) fn parse(method: &str, given: Option<&Bound<'_, PyDict>>) -> PyResult<LineOptions> {
    let mut options = LineOptions::for_method(method).map_err(|error| exception(&error))?;
    for (key, value) in given.into_iter().flat_map(PyDictMethods::iter) {
        let key: String = key.extract()?;
        if !set(&mut options, &key, &value)? {
            return Err(unknown(value.py(), &key, &options)?);
        }
    }
    Ok(options)
}

fn set(options: &mut LineOptions, key: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    let name = format!("option {key}");
    let number = || convert::whole::<f64>(value, &name, "a number");
    let count = || convert::whole::<usize>(value, &name, "a whole number");
    let pixels = || convert::whole::<u32>(value, &name, "a whole number of pixels");
    let maybe = || if value.is_none() { Ok(None) } else { number().map(Some) };
    match key {
        "gradient_min" => options.edges.gradient_min = number()?,
        "smoothing_px" => options.edges.smoothing_px = number()?,
        "elevation_min_rad" => options.edges.elevation_min_rad = number()?,
        "elevation_max_rad" => options.edges.elevation_max_rad = number()?,
        "margin_px" => options.edges.margin_px = number()?,
        "mask" => {
            options.mask = if value.is_none() {
                None
            } else {
                let (height, width, usable) = convert::mask(value, "mask")?;
                Some(Mask::new(width, height, usable).map_err(|error| exception(&error))?)
            };
        }
        "descriptor_areas" => options.descriptor.areas = count()?,
        "descriptor_overlapping" => options.descriptor.overlapping = value.extract::<bool>()?,
        "descriptor_bins" => options.descriptor.bins = count()?,
        "descriptor_clip" => options.descriptor.clip = number()?,
        "descriptor_window" => options.descriptor.window = number()?,
        "descriptor_smoothing" => options.descriptor.smoothing = number()?,
        "descriptor_normalisation" => {
            options.descriptor.normalisation = match value.extract::<String>().as_deref() {
                Ok("area") => Normalisation::Area,
                Ok("whole") => Normalisation::Whole,
                _ => return Err(invalid(format!("{name} = {value}, expected \"area\" or \"whole\""))),
            };
        }
        _ => match (key, &mut options.method) {
            ("plane_max_rad", LineMethod::GreatCircle(o)) => o.plane_max_rad = number()?,
            ("bins", LineMethod::GreatCircle(o)) => o.bins = count()?,
            ("separation_rad", LineMethod::GreatCircle(o)) => o.separation_rad = number()?,
            ("length_min_rad", LineMethod::GreatCircle(o)) => o.length_min_rad = number()?,
            ("support_min_px", LineMethod::GreatCircle(o)) => o.support_min_px = pixels()?,
            ("gap_max_rad", LineMethod::GreatCircle(o)) => o.gap_max_rad = number()?,
            ("run_min_px", LineMethod::GreatCircle(o)) => o.run_min_px = pixels()?,
            ("covered_min", LineMethod::GreatCircle(o)) => o.covered_min = number()?,
            ("scatter_max_px", LineMethod::GreatCircle(o)) => o.scatter_max_px = number()?,
            ("tilt_sigma_rad", LineMethod::GreatCircle(o)) => o.tilt_sigma_rad = number()?,
            ("lines_max", LineMethod::GreatCircle(o)) => {
                o.lines_max = if value.is_none() { None } else { Some(count()?) };
            }
            ("radial_max_rad", LineMethod::Radial(o)) => o.radial_max_rad = number()?,
            ("sectors", LineMethod::Radial(o)) => o.sectors = count()?,
            ("length_min", LineMethod::Radial(o)) => o.length_min = number()?,
            ("radius_min_px", LineMethod::Radial(o)) => o.radius_min_px = maybe()?,
            ("radius_max_px", LineMethod::Radial(o)) => o.radius_max_px = maybe()?,
            ("rim_radius_px", LineMethod::Radial(o)) => o.rim_radius_px = maybe()?,
            ("center_search_px", LineMethod::Radial(o)) => o.center_search_px = number()?,
            _ => return Ok(false),
        },
    }
    Ok(true)
}

/// The error for an option that the method does not have: the near ones, then all.
fn unknown(py: Python<'_>, key: &str, options: &LineOptions) -> PyResult<PyErr> {
    let names: Vec<String> = in_force(py, options)?.keys().extract()?;
    let near: Vec<String> = py.import("difflib")?.call_method1("get_close_matches", (key, names.clone()))?.extract()?;
    let hint = if near.is_empty() { String::new() } else { format!(" (did you mean {}?)", near.join(" or ")) };
    let (method, names) = (options.method.name(), names.join(", "));
    Ok(invalid(format!("option {key}: unknown to method \"{method}\"{hint}, expected one of {names}")))
}

/// All options in force, as keywords that would make them so.
pub(super) fn in_force<'py>(py: Python<'py>, options: &LineOptions) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("gradient_min", options.edges.gradient_min)?;
    dict.set_item("smoothing_px", options.edges.smoothing_px)?;
    dict.set_item("elevation_min_rad", options.edges.elevation_min_rad)?;
    dict.set_item("elevation_max_rad", options.edges.elevation_max_rad)?;
    dict.set_item("margin_px", options.edges.margin_px)?;
    let mask = options.mask.as_ref().map(|mask| convert::to_mask(py, mask));
    dict.set_item("mask", mask.transpose()?)?;
    match &options.method {
        LineMethod::GreatCircle(o) => {
            dict.set_item("plane_max_rad", o.plane_max_rad)?;
            dict.set_item("bins", o.bins)?;
            dict.set_item("separation_rad", o.separation_rad)?;
            dict.set_item("length_min_rad", o.length_min_rad)?;
            dict.set_item("support_min_px", o.support_min_px)?;
            dict.set_item("gap_max_rad", o.gap_max_rad)?;
            dict.set_item("run_min_px", o.run_min_px)?;
            dict.set_item("covered_min", o.covered_min)?;
            dict.set_item("scatter_max_px", o.scatter_max_px)?;
            dict.set_item("tilt_sigma_rad", o.tilt_sigma_rad)?;
            dict.set_item("lines_max", o.lines_max)?;
        }
        LineMethod::Radial(o) => {
            dict.set_item("radial_max_rad", o.radial_max_rad)?;
            dict.set_item("sectors", o.sectors)?;
            dict.set_item("length_min", o.length_min)?;
            dict.set_item("radius_min_px", o.radius_min_px)?;
            dict.set_item("radius_max_px", o.radius_max_px)?;
            dict.set_item("rim_radius_px", o.rim_radius_px)?;
            dict.set_item("center_search_px", o.center_search_px)?;
        }
    }
    let DescriptorOptions { areas, overlapping, bins, clip, window, smoothing, normalisation } = options.descriptor;
    dict.set_item("descriptor_areas", areas)?;
    dict.set_item("descriptor_overlapping", overlapping)?;
    dict.set_item("descriptor_bins", bins)?;
    dict.set_item("descriptor_clip", clip)?;
    dict.set_item("descriptor_window", window)?;
    dict.set_item("descriptor_smoothing", smoothing)?;
    let word = if normalisation == Normalisation::Area { "area" } else { "whole" };
    dict.set_item("descriptor_normalisation", word)?;
    Ok(dict)
}
