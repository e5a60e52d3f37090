//! `ScratchPool`: the scratch of as many threads as have called at once.

use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use tiltvp_core::Error;

use crate::call::call;

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
        let free = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        call(py, || {
            let taken = free().pop();
            let mut scratch = taken.unwrap_or_else(new);
            let outcome = work(&mut scratch);
            free().push(scratch);
            outcome
        })
    }
}
