//! The C interface: opaque handles, results as plain structs, a status from every call that may fail.
//!
//! `include/tiltvp.h` is made of these sources by cbindgen, and has the rules for the caller at its top. What a caller can check
//! no pointer by, it must keep to; all else is refused: NULL where it is not said to be allowed, wrong sizes, texts that are
//! not UTF-8. No panic crosses the border.

#![allow(clippy::missing_safety_doc, reason = "the header's first lines say it once for all functions")]
#![allow(unreachable_pub, reason = "C reaches functions by their names, whatever module they are in")]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::panic, reason = "in tests"))]

mod border;
mod calibrator;
mod camera;
mod lines;
mod pointers;
mod reader;
mod text;
mod tilt;

#[cfg(test)]
mod header;
#[cfg(test)]
mod testing;
