//! Options by keyword: each name is set on the core's options of the front end, and no default is written here.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::corner::{CornerMethod, DetectorOptions, OrientationChoice, Primary};

use crate::call::{exception, invalid};
use crate::convert;

/// The words for which way the camera is held.
const ORIENTATIONS: [(&str, OrientationChoice); 3] = [
    ("either", OrientationChoice::Either),
    ("upright", OrientationChoice::Upright),
    ("upside-down", OrientationChoice::UpsideDown),
];

/// The core's options of a front end with the user's values set.
pub(super) fn parse(method: &str, given: Option<&Bound<'_, PyDict>>) -> PyResult<DetectorOptions> {
    let mut options = DetectorOptions::for_method(method).map_err(|error| exception(&error))?;
    for (key, value) in given.into_iter().flat_map(PyDictMethods::iter) {
        let key: String = key.extract()?;
        if !set(&mut options, &key, &value)? {
            return Err(unknown(value.py(), &key, &options)?);
        }
    }
    Ok(options)
}

fn set(options: &mut DetectorOptions, key: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    let name = format!("option {key}");
    let number = || convert::whole::<f64>(value, &name, "a number");
    let pixels = || convert::whole::<u32>(value, &name, "a whole number of pixels");
    match (key, &mut options.method) {
        ("display_gamma", _) => options.display_gamma = number()?,
        ("search_px", CornerMethod::Coloured(o)) => o.search_px = number()?,
        ("search_px", CornerMethod::General(o)) => o.search_px = number()?,
        ("step_min", CornerMethod::Coloured(o)) => o.step_min = number()?,
        ("step_min", CornerMethod::General(o)) => o.step_min = number()?,
        ("threshold_px", CornerMethod::Coloured(o)) => o.threshold_px = number()?,
        ("threshold_px", CornerMethod::General(o)) => o.threshold_px = number()?,
        ("ray_sigma_px", CornerMethod::Coloured(o)) => o.ray_sigma_px = number()?,
        ("ray_sigma_px", CornerMethod::General(o)) => o.ray_sigma_px = number()?,
        ("support_min_px", CornerMethod::Coloured(o)) => o.support_min_px = pixels()?,
        ("support_min_px", CornerMethod::General(o)) => o.support_min_px = pixels()?,
        ("residual_max_px", CornerMethod::Coloured(o)) => o.residual_max_px = number()?,
        ("residual_max_px", CornerMethod::General(o)) => o.residual_max_px = number()?,
        ("chromaticity_min", CornerMethod::Coloured(o)) => o.color.chromaticity_min = number()?,
        ("intensity_min", CornerMethod::Coloured(o)) => {
            o.color.intensity_min = convert::whole(value, &name, "a level from 0 to 255")?;
        }
        ("faces", CornerMethod::Coloured(o)) => o.color.faces = faces(value)?,
        ("orientation", CornerMethod::Coloured(o)) => o.orientation = orientation(value)?,
        ("label_step_px", CornerMethod::Coloured(o)) => o.label_step_px = pixels()?,
        ("search_width_px", CornerMethod::Coloured(o)) => o.search_width_px = pixels()?,
        ("candidates_min", CornerMethod::Coloured(o)) => o.candidates_min = pixels()?,
        ("line_threshold_px", CornerMethod::Coloured(o)) => o.line_threshold_px = number()?,
        ("seed", CornerMethod::Coloured(o)) => o.seed = convert::whole(value, &name, "a whole number")?,
        ("refine_px", CornerMethod::Coloured(o)) => o.refine_px = number()?,
        ("gradient_min", CornerMethod::General(o)) => o.gradient_min = number()?,
        ("smoothing_px", CornerMethod::General(o)) => o.smoothing_px = number()?,
        ("margin_px", CornerMethod::General(o)) => o.margin_px = number()?,
        ("segment_min_px", CornerMethod::General(o)) => o.segment_min_px = number()?,
        ("segment_threshold_px", CornerMethod::General(o)) => o.segment_threshold_px = number()?,
        ("gap_max_px", CornerMethod::General(o)) => o.gap_max_px = number()?,
        ("gap_max_share", CornerMethod::General(o)) => o.gap_max_share = number()?,
        ("overshoot_max_px", CornerMethod::General(o)) => o.overshoot_max_px = number()?,
        ("ray_angle_min_rad", CornerMethod::General(o)) => o.ray_angle_min_rad = number()?,
        ("gamma_rad", CornerMethod::General(o)) => o.gamma_rad = number()?,
        ("vertical_max_rad", CornerMethod::General(o)) => o.vertical_max_rad = number()?,
        ("support_min_share", CornerMethod::General(o)) => o.support_min_share = number()?,
        ("follow_px", CornerMethod::General(o)) => o.follow_px = number()?,
        ("guided_min_share", CornerMethod::General(o)) => o.guided_min_share = number()?,
        ("corners_max", CornerMethod::General(o)) => o.corners_max = pixels()?,
        _ => return Ok(false),
    }
    Ok(true)
}

fn faces(value: &Bound<'_, PyAny>) -> PyResult<[Primary; 3]> {
    let word: String = value.extract().unwrap_or_default();
    let letters: Option<Vec<Primary>> = word.chars().map(Primary::from_letter).collect();
    letters.and_then(|letters| letters.try_into().ok()).ok_or_else(|| {
        invalid(format!("option faces = {value}, expected the letters r, g and b of the top, left and right face"))
    })
}

fn orientation(value: &Bound<'_, PyAny>) -> PyResult<OrientationChoice> {
    let word: String = value.extract().unwrap_or_default();
    let found = ORIENTATIONS.into_iter().find(|(name, _)| *name == word);
    found.map(|(_, choice)| choice).ok_or_else(|| {
        let names = ORIENTATIONS.map(|(name, _)| format!("{name:?}")).join(", ");
        invalid(format!("option orientation = {value}, expected one of {names}"))
    })
}

/// The error for an option that the front end does not have: the near ones, then all.
fn unknown(py: Python<'_>, key: &str, options: &DetectorOptions) -> PyResult<PyErr> {
    let names: Vec<String> = in_force(py, options)?.keys().extract()?;
    let near: Vec<String> = py.import("difflib")?.call_method1("get_close_matches", (key, names.clone()))?.extract()?;
    let hint = if near.is_empty() { String::new() } else { format!(" (did you mean {}?)", near.join(" or ")) };
    let (method, names) = (options.method.name(), names.join(", "));
    Ok(invalid(format!("option {key}: unknown to method \"{method}\"{hint}, expected one of {names}")))
}

/// All options in force, as keywords that would make them so.
pub(super) fn in_force<'py>(py: Python<'py>, options: &DetectorOptions) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("display_gamma", options.display_gamma)?;
    match &options.method {
        CornerMethod::Coloured(o) => {
            dict.set_item("chromaticity_min", o.color.chromaticity_min)?;
            dict.set_item("intensity_min", o.color.intensity_min)?;
            dict.set_item("faces", o.color.faces.map(Primary::letter).into_iter().collect::<String>())?;
            let word = ORIENTATIONS.into_iter().find(|(_, choice)| *choice == o.orientation);
            dict.set_item("orientation", word.map(|(name, _)| name))?;
            dict.set_item("label_step_px", o.label_step_px)?;
            dict.set_item("search_width_px", o.search_width_px)?;
            dict.set_item("candidates_min", o.candidates_min)?;
            dict.set_item("line_threshold_px", o.line_threshold_px)?;
            dict.set_item("seed", o.seed)?;
            dict.set_item("search_px", o.search_px)?;
            dict.set_item("refine_px", o.refine_px)?;
            dict.set_item("step_min", o.step_min)?;
            dict.set_item("threshold_px", o.threshold_px)?;
            dict.set_item("ray_sigma_px", o.ray_sigma_px)?;
            dict.set_item("support_min_px", o.support_min_px)?;
            dict.set_item("residual_max_px", o.residual_max_px)?;
        }
        CornerMethod::General(o) => {
            dict.set_item("gradient_min", o.gradient_min)?;
            dict.set_item("smoothing_px", o.smoothing_px)?;
            dict.set_item("margin_px", o.margin_px)?;
            dict.set_item("segment_min_px", o.segment_min_px)?;
            dict.set_item("segment_threshold_px", o.segment_threshold_px)?;
            dict.set_item("gap_max_px", o.gap_max_px)?;
            dict.set_item("gap_max_share", o.gap_max_share)?;
            dict.set_item("overshoot_max_px", o.overshoot_max_px)?;
            dict.set_item("ray_angle_min_rad", o.ray_angle_min_rad)?;
            dict.set_item("gamma_rad", o.gamma_rad)?;
            dict.set_item("vertical_max_rad", o.vertical_max_rad)?;
            dict.set_item("search_px", o.search_px)?;
            dict.set_item("step_min", o.step_min)?;
            dict.set_item("threshold_px", o.threshold_px)?;
            dict.set_item("ray_sigma_px", o.ray_sigma_px)?;
            dict.set_item("support_min_px", o.support_min_px)?;
            dict.set_item("support_min_share", o.support_min_share)?;
            dict.set_item("residual_max_px", o.residual_max_px)?;
            dict.set_item("follow_px", o.follow_px)?;
            dict.set_item("guided_min_share", o.guided_min_share)?;
            dict.set_item("corners_max", o.corners_max)?;
        }
    }
    Ok(dict)
}
