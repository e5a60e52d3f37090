//! Processes that fork: none does while another thread holds a lock, which would be held for ever in the child.

use std::cell::RefCell;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, RwLockWriteGuard};

use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyDict};

/// Read by whoever holds a lock for a short time and not the interpreter; written by whoever forks.
static FORKING: RwLock<()> = RwLock::new(());

/// How often the process and those that it stems from have forked to become this one.
static FORKS: AtomicU32 = AtomicU32::new(0);

thread_local! {
    static HELD: RefCell<Option<RwLockWriteGuard<'static, ()>>> = const { RefCell::new(None) };
}

/// Does something with what a lock guards while the process does not fork. `work` waits neither for the interpreter nor for anything
/// long, and is not within another.
pub(crate) fn guarded<T, R>(mutex: &Mutex<T>, work: impl FnOnce(&mut T) -> R) -> R {
    let _no_fork = FORKING.read().unwrap_or_else(PoisonError::into_inner);
    work(&mut lock(mutex))
}

/// The lock, whatever happened to those who had it before.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Another number in a child than in its parent.
pub(crate) fn forks() -> u32 {
    FORKS.load(Ordering::Relaxed)
}

/// Has forks of Python wait for short locks.
pub(crate) fn watch(py: Python<'_>) -> PyResult<()> {
    // Windows cannot fork.
    let Ok(register) = py.import("os")?.getattr("register_at_fork") else { return Ok(()) };
    let hook = |run: fn()| PyCFunction::new_closure(py, None, None, move |_, _| run());
    let hooks = PyDict::new(py);
    hooks.set_item("before", hook(hold)?)?;
    hooks.set_item("after_in_parent", hook(release)?)?;
    hooks.set_item("after_in_child", hook(begin)?)?;
    register.call((), Some(&hooks)).map(drop)
}

fn hold() {
    HELD.set(Some(FORKING.write().unwrap_or_else(PoisonError::into_inner)));
}

fn release() {
    HELD.set(None);
}

fn begin() {
    FORKS.fetch_add(1, Ordering::Relaxed);
    release();
}
