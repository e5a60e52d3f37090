//! How a caller ends a long computation: a flag that long loops look at.
//!
//! A computation knows of the flag by the thread that it runs on, so that it has no part in signatures and answers. Without a flag
//! nothing ever happens.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

thread_local! {
    static ASKED: RefCell<Option<Interrupt>> = const { RefCell::new(None) };
}

/// What is unwound with; it never leaves [`Interrupt::run`].
struct Ended;

/// A wish to end, which any thread may utter.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Ends the computations that run with this flag, at the next [`check`] of each.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether anybody has asked.
    #[cfg(test)]
    pub(crate) fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Runs `work` with this flag; `None` if it was ended. What it had borrowed mutably is then in no known state.
    pub fn run<T>(&self, work: impl FnOnce() -> T) -> Option<T> {
        let before = ASKED.replace(Some(self.clone()));
        let outcome = catch_unwind(AssertUnwindSafe(work));
        ASKED.set(before);
        match outcome {
            Ok(answer) => Some(answer),
            Err(payload) if payload.is::<Ended>() => None,
            Err(payload) => resume_unwind(payload),
        }
    }

    /// The flag of the computation that this thread is in.
    pub fn current() -> Option<Self> {
        ASKED.with_borrow(Clone::clone)
    }

    /// Makes a thread that works for another one, till it ends, look at that one's flag.
    pub fn adopt(flag: Option<&Self>) {
        ASKED.set(flag.cloned());
    }
}

/// Ends the computation here if its caller has asked for it. Long loops call it some ten times a second or more.
///
/// It unwinds to [`Interrupt::run`], through rayon's threads too, without a message.
#[inline]
pub fn check() {
    let asked = ASKED.with_borrow(|flag| flag.as_ref().is_some_and(|flag| flag.0.load(Ordering::Relaxed)));
    if asked {
        resume_unwind(Box::new(Ended));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_computation_ends_at_its_next_check_and_only_if_asked() {
        check();
        let flag = Interrupt::default();
        assert_eq!(flag.run(|| (0..3).inspect(|_| check()).sum::<i32>()), Some(3));
        let mut steps = 0;
        let ended = flag.run(|| {
            loop {
                steps += 1;
                if steps == 5 {
                    flag.ask();
                }
                check();
            }
        });
        assert_eq!((ended, steps), (None::<()>, 5));
        check();
        assert!(Interrupt::current().is_none());
    }

    #[test]
    fn other_unwinding_goes_on() {
        let caught = catch_unwind(|| Interrupt::default().run(|| resume_unwind(Box::new("a fault"))));
        assert_eq!(caught.unwrap_err().downcast_ref::<&str>(), Some(&"a fault"));
    }
}
