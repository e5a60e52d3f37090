//! `ScratchPool`: the scratch of as many threads as have called at once.

use std::sync::Mutex;

use pyo3::prelude::*;
use tiltvp_core::Error;

use crate::call::call;
use crate::forks::guarded;

/// Scratch that no thread is using.
pub(crate) struct ScratchPool<T>(Mutex<Vec<T>>);

impl<T> Default for ScratchPool<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Send> ScratchPool<T> {
    /// Runs `work` without the interpreter, with a scratch that no other thread has. After a panic the scratch is dropped.
    pub(crate) fn with<R: Send>(
        &self,
        py: Python<'_>,
        new: impl FnOnce() -> T + Send,
        work: impl FnOnce(&mut T) -> Result<R, Error> + Send,
    ) -> PyResult<R> {
        call(py, || {
            let taken = guarded(&self.0, Vec::pop);
            let mut scratch = taken.unwrap_or_else(new);
            let outcome = work(&mut scratch);
            guarded(&self.0, |free| free.push(scratch));
            outcome
        })
    }
}
