//! `Shared`: the state of an object that several threads use.

use std::sync::{Arc, Mutex, TryLockError};

use pyo3::prelude::*;
use tiltvp_core::Error;

use crate::call::{call_by, call_long};
use crate::forks::{forks, guarded, lock};

/// State behind locks that nobody waits for, and nobody holds, with the interpreter in hand.
///
/// With one of them held no Python object is made: that may run a collector, which may let another thread run, which may wait for
/// the lock.
pub(crate) struct Shared<T> {
    /// Held by whoever changes the state, however long it takes; another one after a fork, when who held it is gone.
    turn: Mutex<(u32, Arc<Mutex<()>>)>,
    /// Held while the state is looked at, copied or set, or changed by something short.
    state: Mutex<T>,
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
            Err(TryLockError::WouldBlock) => py.detach(|| guarded(&self.state, |state| look(state))),
        }
    }

    fn turn(&self) -> Arc<Mutex<()>> {
        guarded(&self.turn, |turn| {
            if turn.0 != forks() {
                *turn = (forks(), Arc::default());
            }
            Arc::clone(&turn.1)
        })
    }

    /// Changes the state by something that takes no longer than a step. Whether an error leaves it as it was is for `change` to say.
    pub(crate) fn change<R: Send>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut T) -> Result<R, Error> + Send,
    ) -> PyResult<R> {
        self.change_by(py, false, change)
    }

    /// As [`change`](Self::change), by something that is long at times: a signal ends it then, and the state is what `change` leaves when
    /// it is unwound.
    pub(crate) fn change_by<R: Send>(
        &self,
        py: Python<'_>,
        is_long: bool,
        change: impl FnOnce(&mut T) -> Result<R, Error> + Send,
    ) -> PyResult<R> {
        call_by(py, is_long, || {
            let turn = self.turn();
            let _turn = lock(&turn);
            guarded(&self.state, change)
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
            let turn = self.turn();
            let _turn = lock(&turn);
            let mut next = guarded(&self.state, |state| state.clone());
            let answer = change(&mut next)?;
            tiltvp_core::interrupt::check();
            guarded(&self.state, |state| *state = next);
            Ok(answer)
        })
    }
}
