//! Options by keyword: Python's values to the core's options and back, and what there is to choose. No option is named here.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyTuple};
use tiltvp_core::filter::ComplementaryOptions;
use tiltvp_core::lines::{LineMethod, LineOptions, MatchOptions, TrackerOptions, WideOptions};
use tiltvp_core::options::{Kind, Options, Value};
use tiltvp_core::segments::SegmentDetectorOptions;
use tiltvp_core::selfcalib::{CalibrationMethod, LogOptions, SelfCalibratorOptions};
use tiltvp_core::tilt::{CommonDirectionOptions, Method, TiltFilterOptions, TiltOptions};
use tiltvp_core::{Error, corner};
use tiltvp_synth::{BearingDriveOptions, DriveOptions, ImuOptions, LaboratoryOptions, RoomOptions, StereoOptions};

use crate::call::{exception, invalid};
use crate::convert;
use crate::tilt::correction;

/// Sets the user's values.
pub(crate) fn set(options: &mut dyn Options, given: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
    let pairs = given.into_iter().flat_map(PyDictMethods::iter);
    let values = pairs.map(|(key, value)| Ok((key.extract()?, to_value(&value)?))).collect::<PyResult<_>>()?;
    options.set_all(values).map_err(|error| exception(&error))
}

/// Options with the user's values, of which `None` stands for the default.
pub(crate) fn given<T: Options>(mut options: T, given: Option<&Bound<'_, PyDict>>) -> PyResult<T> {
    let pairs = given.into_iter().flat_map(PyDictMethods::iter).filter(|(_, value)| !value.is_none());
    let values = pairs.map(|(key, value)| Ok((key.extract()?, to_value(&value)?))).collect::<PyResult<_>>()?;
    options.set_all(values).map_err(|error| exception(&error))?;
    Ok(options)
}

/// The options in force by name, in a fresh dict that is good as keywords.
pub(crate) fn in_force<'py>(py: Python<'py>, options: &dyn Options) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for field in options.fields() {
        dict.set_item(&*field.name, from_value(py, &field.value)?)?;
    }
    Ok(dict)
}

/// The same without some names, which stand elsewhere in the call.
pub(crate) fn in_force_without<'py>(
    py: Python<'py>,
    options: &dyn Options,
    names: &[&str],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = in_force(py, options)?;
    for name in names {
        dict.del_item(name)?;
    }
    Ok(dict)
}

/// The options in force as a call has them, `name=value, name=value`.
pub(crate) fn shown(py: Python<'_>, options: &dyn Options) -> PyResult<String> {
    let shown = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| Ok(format!("{key}={}", value.repr()?));
    Ok(in_force(py, options)?.iter().map(shown).collect::<PyResult<Vec<String>>>()?.join(", "))
}

/// The options that differ from others of the same kind, as a call has them, each after a comma.
pub(crate) fn shown_beside(py: Python<'_>, options: &dyn Options, usual: &dyn Options) -> PyResult<String> {
    let mut text = String::new();
    for field in options.fields() {
        if usual.get(&field.name).as_ref() != Some(&field.value) {
            let value = match &field.value {
                Value::Mask(..) => "<mask>".to_owned(),
                value => from_value(py, value)?.repr()?.to_string(),
            };
            text.extend([", ", &field.name, "=", &value]);
        }
    }
    Ok(text)
}

/// A value of Python as plain data; what no option can be keeps only its look.
fn to_value(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_none() {
        return Ok(Value::None);
    }
    if let Ok(truth) = value.extract::<bool>() {
        return Ok(Value::Bool(truth));
    }
    if let Ok(word) = value.extract::<String>() {
        return Ok(Value::Text(word));
    }
    if let Some(correction) = correction::object(value) {
        return Ok(Value::Object(Arc::new(correction)));
    }
    let look = || Ok(Value::Other(convert::shown(value)));
    let is_sequence = value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>();
    if is_sequence || value.cast::<PyUntypedArray>().is_ok_and(|array| array.ndim() > 0) {
        return array(value, is_sequence)?.map_or_else(look, Ok);
    }
    if convert::is_no_real(value) {
        return look();
    }
    if let Ok(whole) = value.call_method0("__index__").and_then(|whole| whole.extract()) {
        return Ok(Value::Int(whole));
    }
    value.extract::<f64>().map_or_else(|_| look(), |number| Ok(Value::Float(number)))
}

/// An array of numbers or of truth values; nothing if it holds anything else. A mask must be an array, not a list.
fn array(value: &Bound<'_, PyAny>, is_sequence: bool) -> PyResult<Option<Value>> {
    if convert::is_masked(value)? {
        return Ok(None);
    }
    let Ok(made) = value.py().import("numpy")?.call_method1("asarray", (value,)) else { return Ok(None) };
    let made = made.cast_into::<PyUntypedArray>()?;
    let (shape, kind) = (made.shape().to_vec(), made.dtype().getattr("kind")?.extract::<String>()?);
    let flat = |dtype: &str| made.call_method1("astype", (dtype,))?.call_method0("ravel");
    Ok(match kind.as_str() {
        "f" | "i" | "u" => Some(Value::Array(shape, flat("float64")?.cast_into::<PyArray1<f64>>()?.to_vec()?)),
        "b" if !is_sequence => Some(Value::Mask(shape, flat("bool")?.cast_into::<PyArray1<bool>>()?.to_vec()?.into())),
        _ => None,
    })
}

/// Plain data as a value of Python: rows of numbers as tuples, matrices and masks as fresh arrays.
fn from_value<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::None | Value::Other(_) => py.None().into_bound(py),
        Value::Bool(truth) => PyBool::new(py, *truth).to_owned().into_any(),
        Value::Int(whole) => whole.into_pyobject(py)?.into_any(),
        Value::Float(number) => number.into_pyobject(py)?.into_any(),
        Value::Text(word) => word.into_pyobject(py)?.into_any(),
        Value::Array(shape, values) if shape.len() == 1 => PyTuple::new(py, values)?.into_any(),
        Value::Array(shape, values) => {
            let array: Bound<'_, PyArrayDyn<f64>> = PyArray1::from_slice(py, values).reshape(shape.clone())?;
            array.into_any()
        }
        Value::Mask(shape, values) => {
            let array: Bound<'_, PyArrayDyn<bool>> = PyArray1::from_slice(py, values).reshape(shape.clone())?;
            array.into_any()
        }
        Value::Object(object) => match object.downcast_ref() {
            Some(trained) => correction::show(py, trained)?.into_bound(py),
            None => return Err(invalid("an object without a class in Python".to_owned())),
        },
    })
}

/// What Python's type checkers call a kind of value.
fn annotation(kind: Kind) -> String {
    match kind {
        Kind::Bool => "bool".to_owned(),
        Kind::Int(_) => "int".to_owned(),
        Kind::Float => "float".to_owned(),
        Kind::Text(_) => "str".to_owned(),
        Kind::Word(words) => {
            let words: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
            format!("Literal[{}]", words.join(", "))
        }
        Kind::Array([n]) if *n > 0 => format!("tuple[{}]", vec!["float"; *n].join(", ")),
        Kind::Array(_) => "npt.ArrayLike".to_owned(),
        Kind::Mask => "npt.NDArray[np.bool_]".to_owned(),
        Kind::Object(_) => "float | str | AffineCorrection | PosteriorCorrection | None".to_owned(),
        Kind::Maybe(kind) => format!("{} | None", annotation(*kind)),
    }
}

/// The default options of what takes them, by its name in Python and its method.
fn defaults(owner: &str, method: Option<&str>) -> Result<Box<dyn Options>, Error> {
    Ok(match owner {
        "TiltEstimator" => Box::new(TiltOptions::for_method(method.unwrap_or(Method::NAMES[0]))?),
        "LineExtractor" => Box::new(LineOptions::for_method(method.unwrap_or(LineMethod::NAMES[0]))?),
        "SegmentDetector" => Box::new(SegmentDetectorOptions::default()),
        "CornerDetector" => {
            Box::new(corner::DetectorOptions::for_method(method.unwrap_or(corner::CornerMethod::NAMES[0]))?)
        }
        "CornerPoseEstimator" => Box::new(corner::EstimatorOptions::default()),
        "SelfCalibrator" => {
            let mut options = SelfCalibratorOptions::default();
            options.set("method", &Value::Text(method.unwrap_or(CalibrationMethod::NAMES[0]).to_owned()))?;
            Box::new(options)
        }
        "calibrate" => Box::new(LogOptions::default()),
        "simulate_drive" => Box::new(BearingDriveOptions::default()),
        "LineTracker" => Box::new(TrackerOptions::default()),
        "match_descriptors" => Box::new(MatchOptions::default()),
        "match_wide" => Box::new(WideOptions::default()),
        "TiltFilter" => Box::new(TiltFilterOptions::default()),
        "common_direction" => Box::new(CommonDirectionOptions::default()),
        "ComplementaryFilter" => Box::new(ComplementaryOptions::default()),
        "Room" => Box::new(RoomOptions::default()),
        "Laboratory" => Box::new(LaboratoryOptions::default()),
        "Drive" => {
            let mut options = DriveOptions::default();
            if method == Some("legs") {
                options.set("legs", &Value::Array(vec![0, 2], Vec::new()))?;
            }
            Box::new(options)
        }
        "StereoSequence" => Box::new(StereoOptions::default()),
        "read_imu" => Box::new(ImuOptions::default()),
        _ => return Err(Error::argument("owner", owner, "the name of a class or function that takes options")),
    })
}

/// The options of a class or function, and of one of its methods; a `Drive` has "legs" as a method.
///
/// A dict with `name`, `type` (an annotation), `default`, `doc` and `expected` for each, in the order of declaration.
#[pyfunction]
#[pyo3(signature = (owner, method=None))]
pub(crate) fn option_fields<'py>(
    py: Python<'py>,
    owner: &str,
    method: Option<&str>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let options = defaults(owner, method).map_err(|error| exception(&error))?;
    let row = |field: tiltvp_core::options::Field| {
        let dict = PyDict::new(py);
        dict.set_item("name", &*field.name)?;
        dict.set_item("type", annotation(field.kind))?;
        dict.set_item("default", from_value(py, &field.value)?)?;
        dict.set_item("doc", &*field.doc)?;
        dict.set_item("expected", &*field.expected)?;
        Ok(dict)
    };
    let mut fields = options.fields();
    for switch in options.fields().into_iter().filter(|field| field.value == Value::Bool(false)) {
        // What a switch turns on is to be chosen too.
        let mut on = defaults(owner, method).map_err(|error| exception(&error))?;
        on.set(&switch.name, &Value::Bool(true)).map_err(|error| exception(&error))?;
        let more = on.fields().into_iter().filter(|field| options.get(&field.name).is_none());
        fields.extend(more.collect::<Vec<_>>());
    }
    fields.into_iter().map(row).collect()
}
