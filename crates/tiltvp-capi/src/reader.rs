//! What reads the images of one camera is made of: its mounting, its mask, and memory for as many threads as call at once.

use std::ffi::c_char;
use std::sync::{Mutex, PoisonError};

use nalgebra::Matrix3;
use tiltvp_core::options::{Options, Value};

use crate::border::{Outcome, given, refused};
use crate::camera::Camera;
use crate::pointers::{Image, maybe_text, rotation};
use crate::text::options;

/// From which grey level on a pixel of a mask shows the world: what the Python package's robot files have.
const BRIGHT: u8 = 128;

/// The camera's part and the options of a reader of images.
///
/// # Safety
/// `robot_from_camera` is NULL or nine numbers, `text` is NULL or a text that ends in a zero, the pointer of `mask` NULL or its rows.
pub(crate) unsafe fn setting<T: Options>(
    camera: Option<&Camera>,
    robot_from_camera: *const f64,
    mask: Option<&Image>,
    text: *const c_char,
    of_method: impl FnOnce(Option<&str>) -> tiltvp_core::Result<T>,
) -> Outcome<(tiltvp_core::camera::Camera, Matrix3<f64>, T)> {
    let camera = given(camera, "camera")?;
    // SAFETY: the caller's promise.
    let (told, text) = unsafe { (rotation(robot_from_camera)?, maybe_text(text, "options")?) };
    let mut options = options(text, of_method)?;
    if let Some(mask) = mask {
        // SAFETY: the caller's promise.
        let view = unsafe { mask.view("mask") }?;
        let shows = (0..view.height()).flat_map(|v| view.row(v)).map(|level| *level >= BRIGHT).collect();
        options.set("mask", &Value::Mask(vec![view.height(), view.width()], shows))?;
    } else if let Some(file) = &camera.mask {
        return refused("mask", "NULL", &format!("the pixels of {file:?}, which the camera's file names"));
    }
    let rotation = told.or(camera.robot_from_camera).unwrap_or_else(Matrix3::identity);
    Ok((camera.inner.clone(), rotation, options))
}

/// Scratch that no thread is using.
pub(crate) struct ScratchPool<T>(Mutex<Vec<T>>);

impl<T> Default for ScratchPool<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> ScratchPool<T> {
    /// Runs `work` with a scratch that no other thread has. After a panic the scratch is dropped.
    pub(crate) fn with<R>(&self, new: impl FnOnce() -> T, work: impl FnOnce(&mut T) -> R) -> R {
        let free = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = free().pop();
        let mut scratch = taken.unwrap_or_else(new);
        let outcome = work(&mut scratch);
        free().push(scratch);
        outcome
    }
}
