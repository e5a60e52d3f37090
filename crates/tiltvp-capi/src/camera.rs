//! Cameras from our own TOML, in a file or in memory. Files of other programs become such a file by `tiltvp camera convert`.

use std::ffi::c_char;
use std::fs::File;
use std::io::Read;
use std::mem::MaybeUninit;

use nalgebra::Matrix3;
use tiltvp_core::camera::{self as core, Model, Parameter};
use toml::{Table, Value};

use crate::border::{Failure, Outcome, Status, end, given, make, run};
use crate::pointers::{maybe_text, text};
use crate::text::{LARGEST_TOML_BYTES, number, table};

/// A calibrated camera, with the mounting that its file tells. Any number of threads may use it at once.
#[expect(clippy::struct_field_names, reason = "the mounting's name everywhere")]
pub struct Camera {
    pub(crate) inner: core::Camera,
    pub(crate) robot_from_camera: Option<Matrix3<f64>>,
    /// The image of the mask that a robot's file names.
    pub(crate) mask: Option<String>,
}

/// The camera of a file in TOML: what `tiltvp camera convert` makes of twenty formats, or a robot's file by `tiltvp setup`.
///
/// `name` picks one by its name; NULL takes the first. What is made of the camera of a robot's file is mounted as that says, and asks
/// for the pixels of its mask.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tiltvp_camera_load(
    path: *const c_char,
    name: *const c_char,
    camera: Option<&mut MaybeUninit<*mut Camera>>,
) -> Status {
    make(camera, "camera", || {
        // SAFETY: texts of the caller's, or NULL.
        let (path, name) = unsafe { (text(path, "path")?, maybe_text(name, "name")?) };
        read(path).and_then(|content| parse(&content, name)).map_err(|Failure(status, why)| {
            // The path has no say in how much of the sentence is left.
            Failure(status, format!("{path}: {why}"))
        })
    })
}

/// The same from a text in memory, for programs without files.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tiltvp_camera_parse(
    toml: *const c_char,
    name: *const c_char,
    camera: Option<&mut MaybeUninit<*mut Camera>>,
) -> Status {
    make(camera, "camera", || {
        // SAFETY: texts of the caller's, or NULL.
        let (toml, name) = unsafe { (text(toml, "toml")?, maybe_text(name, "name")?) };
        parse(toml, name)
    })
}

/// Columns and rows of the camera's images.
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_camera_size(
    camera: Option<&Camera>,
    width: Option<&mut MaybeUninit<usize>>,
    height: Option<&mut MaybeUninit<usize>>,
) -> Status {
    run(|| {
        let camera = given(camera, "camera")?;
        let (width, height) = (given(width, "width")?, given(height, "height")?);
        width.write(camera.inner.width() as usize);
        height.write(camera.inner.height() as usize);
        Ok(())
    })
}

/// Ends a camera; what was made of it stays. NULL is nothing to end.
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_camera_free(camera: Option<Box<Camera>>) {
    end(camera);
}

/// What a file holds, if it is a regular one and not too large.
fn read(path: &str) -> Outcome<String> {
    let unreadable = |error: std::io::Error| Failure(Status::UnreadableFile, error.to_string());
    let refused =
        |what: String, expected: &str| Failure(Status::UnreadableFile, format!("{what}, expected {expected}"));
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        return Err(refused("a folder, pipe or device".to_owned(), "a file"));
    }
    let (limit, mut content) = (LARGEST_TOML_BYTES as u64, Vec::new());
    // A file may grow while it is read.
    File::open(path).and_then(|file| file.take(limit + 1).read_to_end(&mut content)).map_err(unreadable)?;
    if content.len() as u64 > limit {
        return Err(refused(format!("more than {limit} bytes"), "a calibration in TOML"));
    }
    String::from_utf8(content).map_err(|_| refused("no text in UTF-8".to_owned(), "a calibration in TOML"))
}

fn wrong(place: &str, got: impl std::fmt::Display, expected: impl std::fmt::Display) -> Failure {
    Failure(Status::InvalidCamera, format!("{place}: {got}, expected {expected}"))
}

/// What a robot's file may have beside its camera.
const ROBOT_KEYS: [&str; 4] = ["mask", "mounting", "wheels", "topics"];

/// The camera of a text: the one of that name, or the first.
pub(crate) fn parse(text: &str, name: Option<&str>) -> Outcome<Camera> {
    let root = table(text, Status::InvalidCamera)?;
    let robot = match root.get("format").and_then(Value::as_str) {
        Some("tiltvp-camera") => false,
        Some("tiltvp-robot") => true,
        _ => {
            let expected = "\"tiltvp-camera\" or \"tiltvp-robot\": `tiltvp camera convert` makes such a file of others";
            return Err(wrong("format", shown(root.get("format")), expected));
        }
    };
    only(&root, "the top", |key| {
        ["format", "version", "camera"].contains(&key) || (robot && ROBOT_KEYS.contains(&key))
    })?;
    if root.get("version").and_then(Value::as_integer) != Some(1) {
        return Err(wrong("version", shown(root.get("version")), 1));
    }
    let cameras: Vec<&Table> = root
        .get("camera")
        .and_then(Value::as_array)
        .and_then(|cameras| cameras.iter().map(Value::as_table).collect())
        .ok_or_else(|| wrong("camera", shown(root.get("camera")), "one or more [[camera]]"))?;
    let name_of = |camera: &Table| camera.get("name").map_or(Some("cam0"), Value::as_str).map(str::to_owned);
    let chosen = match name {
        None => cameras.first(),
        Some(name) => cameras.iter().find(|camera| name_of(camera).as_deref() == Some(name)),
    };
    let chosen = chosen.ok_or_else(|| {
        let names: Vec<String> = cameras.iter().filter_map(|camera| name_of(camera)).collect();
        wrong("camera", format!("none named {:?}", name.unwrap_or_default()), format!("one of {}", names.join(", ")))
    })?;
    let mask = root.get("mask").map(|mask| {
        mask.as_str().map(str::to_owned).ok_or_else(|| wrong("mask", shown(Some(mask)), "the name of an image"))
    });
    Ok(Camera { inner: built(chosen)?, robot_from_camera: mounting(&root)?, mask: mask.transpose()? })
}

/// The camera of its table.
fn built(camera: &Table) -> Outcome<core::Camera> {
    const KEYS: [&str; 8] = ["name", "model", "width", "height", "mirror", "max_theta_rad", "notes", "parameters"];
    only(camera, "camera", |key| KEYS.contains(&key))?;
    let model = camera.get("model").and_then(Value::as_str);
    let model = model.ok_or_else(|| wrong("model", shown(camera.get("model")), "the name of a model"))?;
    let pixels = |key: &str| {
        let side = camera.get(key).and_then(Value::as_integer).and_then(|side| u32::try_from(side).ok());
        side.ok_or_else(|| wrong(key, shown(camera.get(key)), "a number of pixels"))
    };
    let (width, height) = (pixels("width")?, pixels("height")?);
    let mirror = match camera.get("mirror") {
        None => false,
        Some(mirror) => mirror.as_bool().ok_or_else(|| wrong("mirror", shown(Some(mirror)), "true or false"))?,
    };
    let limit = camera
        .get("max_theta_rad")
        .map(|limit| number(limit).ok_or_else(|| wrong("max_theta_rad", shown(Some(limit)), "an angle in radians")));
    let parameters = camera.get("parameters").and_then(Value::as_table);
    let parameters = parameters.ok_or_else(|| wrong("parameters", shown(camera.get("parameters")), "a table"))?;
    let parameters = parameters.iter().map(|(key, value)| Ok((key.clone(), parameter(key, value)?)));
    let lens = Model::from_parameters(model, width, height, &parameters.collect::<Outcome<Vec<_>>>()?)?;
    let mut made = core::Camera::new(width, height, lens)?;
    if let Some(limit) = limit.transpose()? {
        made = made.with_max_theta_rad(limit)?;
    }
    Ok(if mirror { made.mirrored() } else { made })
}

fn parameter(key: &str, value: &Value) -> Outcome<Parameter> {
    let list = |values: &Vec<Value>| values.iter().map(number).collect::<Option<_>>().map(Parameter::List);
    let found = number(value).map(Parameter::Scalar).or_else(|| value.as_array().and_then(list));
    found.ok_or_else(|| wrong(key, shown(Some(value)), "a number, or a list of numbers"))
}

/// The rotation of a robot's file, in three rows.
fn mounting(root: &Table) -> Outcome<Option<Matrix3<f64>>> {
    let Some(mounting) = root.get("mounting") else { return Ok(None) };
    let rotation = mounting.get("robot_from_camera");
    let rows = rotation.and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let flat = rows.iter().flat_map(|row| row.as_array().map_or(std::slice::from_ref(row), Vec::as_slice));
    match flat.map(number).collect::<Option<Vec<f64>>>().as_deref() {
        Some(numbers) if numbers.len() == 9 => Ok(Some(Matrix3::from_row_slice(numbers))),
        _ => Err(wrong("mounting.robot_from_camera", shown(rotation), "three rows of three numbers")),
    }
}

/// Refuses keys that nobody reads.
fn only(table: &Table, place: &str, known: impl Fn(&str) -> bool) -> Outcome<()> {
    match table.keys().find(|key| !known(key)) {
        Some(key) => Err(wrong(place, format!("unknown key {key:?}"), "what tiltvp writes")),
        None => Ok(()),
    }
}

/// A value as a refusal shows it: the begin, if it is long.
fn shown(value: Option<&Value>) -> String {
    const LETTERS: usize = 80;
    let text = value.map_or_else(|| "missing".to_owned(), Value::to_string);
    let begin: String = text.chars().take(LETTERS).collect();
    if begin.len() < text.len() { format!("{begin}...") } else { begin }
}

#[cfg(test)]
mod tests;
