//! The one door into the core: releases the interpreter, catches panics, and maps errors to exceptions.

use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::import_exception;
use pyo3::prelude::*;
use tiltvp_core::Error;

import_exception!(tiltvp.errors, CalibrationError);
import_exception!(tiltvp.errors, InvalidInputError);
import_exception!(tiltvp.errors, InternalError);

/// Runs `work` without the interpreter.
pub(crate) fn call<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, Error> + Send) -> PyResult<T> {
    let outcome = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
    match outcome {
        Ok(result) => result.map_err(|error| exception(&error)),
        Err(panic) => {
            let text = panic
                .downcast_ref::<&str>()
                .map(ToString::to_string)
                .or_else(|| panic.downcast_ref::<String>().cloned())
                .unwrap_or_default();
            Err(InternalError::new_err(format!("a fault of tiltvp itself, please report it: {text}")))
        }
    }
}

/// The Python exception of a core error.
pub(crate) fn exception(error: &Error) -> PyErr {
    match error {
        Error::InvalidCamera { .. } => CalibrationError::new_err(error.to_string()),
        _ => invalid(error.to_string()),
    }
}

/// An exception for an argument that is wrong before the core sees it.
pub(crate) fn invalid(message: String) -> PyErr {
    InvalidInputError::new_err(message)
}
