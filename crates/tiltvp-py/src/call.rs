//! The one door into the core: releases the interpreter, catches panics, and maps errors to exceptions.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::import_exception;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use tiltvp_core::Error;
use tiltvp_core::interrupt::Interrupt;

import_exception!(tiltvp.errors, CalibrationError);
import_exception!(tiltvp.errors, InvalidInputError);
import_exception!(tiltvp.errors, InternalError);

/// How often a long call asks whether a signal has come.
const POLL: Duration = Duration::from_millis(50);

/// Memory of the stack of the thread of a long call: what the main thread has on Linux.
const STACK_BYTES: usize = 8 << 20;

thread_local! {
    static ENDED_BY: RefCell<Option<Interrupt>> = const { RefCell::new(None) };
}

/// Long calls of several threads, ended together: signals are heard on the main thread alone.
///
/// A thread's calls within a `with` block are among them. Those that are ended raise, and so does each that comes later.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct LongCalls {
    flag: Interrupt,
}

#[pymethods]
impl LongCalls {
    #[new]
    fn new() -> Self {
        Self { flag: Interrupt::default() }
    }

    /// Ends them.
    fn end(&self) {
        self.flag.ask();
    }

    fn __enter__(&self) {
        ENDED_BY.set(Some(self.flag.clone()));
    }

    #[expect(clippy::unused_self, reason = "Python calls it so")]
    #[pyo3(signature = (*_error: "Any"))]
    fn __exit__(&self, _error: &Bound<'_, PyTuple>) {
        ENDED_BY.set(None);
    }
}

/// Runs `work` without the interpreter.
pub(crate) fn call<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, Error> + Send) -> PyResult<T> {
    answer(py.detach(|| catch_unwind(AssertUnwindSafe(work))))
}

/// As [`call`], for work that may take longer than a person waits: a signal such as Ctrl-C ends it and is raised, as do the
/// [`LongCalls`] that it is among.
///
/// The work has a thread of its own, so that signals are heard on this one, and nobody waits for the interpreter with a lock in hand.
pub(crate) fn call_long<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, Error> + Send) -> PyResult<T> {
    let flag = ENDED_BY.with_borrow(Clone::clone).unwrap_or_default();
    let (done, ended) = channel::<()>();
    let outcome = py.detach(move || {
        thread::scope(|scope| {
            let own = flag.clone();
            let work = move || {
                let _until_the_end = done;
                own.run(work)
            };
            let worker = match thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, work) {
                Ok(worker) => worker,
                Err(error) => return Err(invalid(format!("no thread can be started ({error}), expected one"))),
            };
            let mut signal = None;
            while ended.recv_timeout(POLL) == Err(RecvTimeoutError::Timeout) {
                if signal.is_none() {
                    #[expect(
                        clippy::redundant_closure_for_method_calls,
                        reason = "the method alone is for one lifetime"
                    )]
                    let raised = Python::attach(|py| py.check_signals()).err();
                    signal = raised;
                    if signal.is_some() {
                        flag.ask();
                    }
                }
            }
            let outcome = worker.join();
            signal.map_or(Ok(outcome), Err)
        })
    })?;
    answer(
        outcome
            .map(|answer| answer.unwrap_or_else(|| Err(Error::argument("call", "interrupted", "to run to its end")))),
    )
}

/// As [`call_long`] for work that is long, as [`call`] for other work, a good part of which 50 us for a thread would be.
pub(crate) fn call_by<T: Send>(
    py: Python<'_>,
    is_long: bool,
    work: impl FnOnce() -> Result<T, Error> + Send,
) -> PyResult<T> {
    if is_long { call_long(py, work) } else { call(py, work) }
}

/// The answer, or the exception for an error or a panic.
fn answer<T>(outcome: thread::Result<Result<T, Error>>) -> PyResult<T> {
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
