//! `ScratchPool`: the scratch of as many threads as have called at once.

use std::sync::Mutex;

use pyo3::prelude::*;
use tiltvp_core::Error;
use tiltvp_core::camera::Camera;

use crate::call::call_by;
use crate::forks::guarded;

/// Pixels above which an image is large: 12 million of noise take seconds.
const LARGE_PX: u64 = 1 << 21;

/// Whether an image of a camera may take longer than a person waits.
pub(crate) fn is_large(camera: &Camera) -> bool {
    u64::from(camera.width()) * u64::from(camera.height()) > LARGE_PX
}

/// Scratch that no thread is using.
pub(crate) struct ScratchPool<T>(Mutex<Vec<T>>);

impl<T> Default for ScratchPool<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Send> ScratchPool<T> {
    /// Runs `work` on an image of a camera without the interpreter, with a scratch that no other thread has. After a panic, and after
    /// a signal, which ends work on large images, the scratch is dropped.
    pub(crate) fn with<R: Send>(
        &self,
        py: Python<'_>,
        camera: &Camera,
        new: impl FnOnce() -> T + Send,
        work: impl FnOnce(&mut T) -> Result<R, Error> + Send,
    ) -> PyResult<R> {
        call_by(py, is_large(camera), || {
            let taken = guarded(&self.0, Vec::pop);
            let mut scratch = taken.unwrap_or_else(new);
            let outcome = work(&mut scratch);
            guarded(&self.0, |free| free.push(scratch));
            outcome
        })
    }
}
