//! `Shared`: the state of an object that several threads use.

use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use pyo3::prelude::*;
use tiltvp_core::Error;

use crate::call::{call, call_long};

/// State behind locks that nobody waits for, and nobody holds, with the interpreter in hand.
///
/// With one of them held no Python object is made: that may run a collector, which may let another thread run, which may wait for
/// the lock.
pub(crate) struct Shared<T> {
    /// Held by whoever changes the state, however long it takes.
    turn: Mutex<()>,
    /// Held while the state is looked at, copied or set, or changed by something short.
    state: Mutex<T>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<T: Send> Shared<T> {
    pub(crate) fn new(state: T) -> Self {
        Self { turn: Mutex::default(), state: Mutex::new(state) }
    }

    /// What `look`, which is short and knows no Python, sees.
    pub(crate) fn look<R: Send>(&self, py: Python<'_>, look: impl FnOnce(&T) -> R + Send) -> R {
        match self.state.try_lock() {
            Ok(state) => look(&state),
            Err(TryLockError::Poisoned(state)) => look(&state.into_inner()),
            Err(TryLockError::WouldBlock) => py.detach(|| look(&lock(&self.state))),
        }
    }

    /// Changes the state by something that takes no longer than a step. Whether an error leaves it as it was is for `change` to say.
    pub(crate) fn change<R: Send>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut T) -> Result<R, Error> + Send,
    ) -> PyResult<R> {
        call(py, || {
            let _turn = lock(&self.turn);
            change(&mut lock(&self.state))
        })
    }
}

impl<T: Clone + Send> Shared<T> {
    pub(crate) fn copied(&self, py: Python<'_>) -> T {
        self.look(py, Clone::clone)
    }

    /// Changes the state by something that may take long, on a copy that takes its place at the end: meanwhile others see the state as
    /// it was, and so it stays after an error or a signal.
    pub(crate) fn change_long<R: Send>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut T) -> Result<R, Error> + Send,
    ) -> PyResult<R> {
        call_long(py, || {
            let _turn = lock(&self.turn);
            let mut next = lock(&self.state).clone();
            let answer = change(&mut next)?;
            tiltvp_core::interrupt::check();
            *lock(&self.state) = next;
            Ok(answer)
        })
    }
}
