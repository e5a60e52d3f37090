//! What every call passes on its way: panics become a status, and what went wrong is kept for the thread that asked.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

use tiltvp_core::Error;

/// How a call ended.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub enum Status {
    /// As it should.
    Ok = 0,
    /// A pointer that is NULL, a size or a number that makes no sense.
    InvalidArgument = 1,
    /// Options that there are not, or of which one is out of its domain.
    InvalidOption = 2,
    /// A calibration that no camera has, or that is not understood.
    InvalidCamera = 3,
    /// A file that cannot be read.
    UnreadableFile = 4,
    /// A fault of this library.
    InternalError = 5,
}

/// Why a call failed: its status, and a sentence.
#[derive(Debug)]
pub(crate) struct Failure(pub Status, pub String);

pub(crate) type Outcome<T> = Result<T, Failure>;

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let status = match &error {
            Error::InvalidArgument { .. } => Status::InvalidArgument,
            Error::InvalidOption { .. } | Error::UnknownOption { .. } => Status::InvalidOption,
            Error::InvalidCamera { .. } => Status::InvalidCamera,
            _ => Status::InternalError,
        };
        Self(status, error.to_string())
    }
}

/// The refusal of an argument.
pub(crate) fn refused<T>(name: &str, got: &str, expected: &str) -> Outcome<T> {
    Err(Failure(Status::InvalidArgument, format!("{name}: got {got}, expected {expected}")))
}

/// What a pointer points to, or the refusal of NULL.
pub(crate) fn given<T>(pointed: Option<T>, name: &str) -> Outcome<T> {
    pointed.map_or_else(|| refused(name, "NULL", "a pointer"), Ok)
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Does the work of a call; panics end here.
pub(crate) fn run(work: impl FnOnce() -> Outcome<()>) -> Status {
    let outcome = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let told = payload
            .downcast::<String>()
            .map(|text| *text)
            .or_else(|other| other.downcast().map(|text: Box<&str>| text.to_string()));
        let told = told.unwrap_or_else(|other| {
            // A payload that panics when it is dropped would cross the border.
            std::mem::forget(other);
            "a panic".to_owned()
        });
        let why = format!("a fault of tiltvp, please report it: {told}");
        Err(Failure(Status::InternalError, why))
    });
    let Err(Failure(status, why)) = outcome else { return Status::Ok };
    let why = CString::new(why.replace('\0', "\\0")).unwrap_or_default();
    LAST_ERROR.set(why);
    status
}

/// Makes what a handle points to; the handle is NULL if that fails.
pub(crate) fn make<T>(
    handle: Option<&mut MaybeUninit<*mut T>>,
    name: &str,
    work: impl FnOnce() -> Outcome<T>,
) -> Status {
    run(|| {
        let handle = given(handle, name)?;
        handle.write(ptr::null_mut());
        handle.write(Box::into_raw(Box::new(work()?)));
        Ok(())
    })
}

/// Ends what a handle points to.
pub(crate) fn end<T>(handle: Option<Box<T>>) {
    let _ = run(|| {
        drop(handle);
        Ok(())
    });
}

/// Writes an answer.
pub(crate) fn answer<T>(place: Option<&mut MaybeUninit<T>>, name: &str, work: impl FnOnce() -> Outcome<T>) -> Status {
    run(|| {
        let place = given(place, name)?;
        place.write(work()?);
        Ok(())
    })
}

/// What was wrong with the last call of this thread that failed: a sentence with what was given and what expected, empty if none has
/// failed. It stays till a call of this thread fails again.
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_last_error() -> *const c_char {
    LAST_ERROR.with_borrow(|error| error.as_ptr())
}

/// The version of the library, such as "0.2.0".
#[unsafe(no_mangle)]
pub extern "C" fn tiltvp_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::last_error;

    #[test]
    fn a_panic_is_a_status_with_its_message_and_calls_go_on() {
        assert_eq!(run(|| panic!("number {}", 7)), Status::InternalError);
        assert_eq!(last_error(), "a fault of tiltvp, please report it: number 7");
        assert_eq!(run(|| Ok(())), Status::Ok);
        assert_eq!(run(|| refused("image", "NULL", "a \0 pointer")), Status::InvalidArgument);
        assert_eq!(last_error(), "image: got NULL, expected a \\0 pointer");
    }

    #[test]
    fn a_thread_has_errors_of_its_own() {
        let _ = run(|| refused("a", "b", "c"));
        std::thread::spawn(|| assert_eq!(last_error(), "")).join().unwrap();
        assert_eq!(last_error(), "a: got b, expected c");
    }

    #[test]
    fn a_handle_whose_making_fails_is_null() {
        let mut handle = MaybeUninit::new(ptr::dangling_mut::<u8>());
        assert_eq!(make(Some(&mut handle), "it", || refused("a", "b", "c")), Status::InvalidArgument);
        // SAFETY: it was initialised, and `make` writes it.
        assert!(unsafe { handle.assume_init() }.is_null());
    }
}
