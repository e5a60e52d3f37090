//! Orientation and calibration from the straight lines of man-made places.
//!
//! The floors of the house, from the ground up; a module imports only from floors below its own, and any of them from
//! [`tiltvp_kernels`], which holds all vector code and its `unsafe`:
//!
//! 1. [`error`], [`geometry`], [`interrupt`], [`options`](mod@options)
//! 2. [`camera`], [`image`], [`robust`], [`filter`]
//! 3. [`edges`]
//! 4. [`segments`]
//! 5. [`tilt`], [`corner`], [`lines`]
//! 6. [`selfcalib`]
//!
//! Angles are radians, lengths metres, pixel centres integers, rays unit bearings. The camera frame has `z` along the
//! optical axis, `x` to the right (columns) and `y` down (rows); the robot frame has `x` forward, `y` left, `z` up.

#![forbid(unsafe_code)]

pub mod camera;
pub mod corner;
pub mod edges;
pub mod error;
pub mod filter;
pub mod geometry;
pub mod image;
pub mod interrupt;
pub mod lines;
pub mod options;
mod parallel;
pub mod robust;
pub mod segments;
pub mod selfcalib;
mod simd;
#[cfg(feature = "testing")]
pub mod testing;
pub mod tilt;

pub use error::{Error, Result};
pub use simd::{cap_simd_level, simd_level, simd_levels};

/// The README's program is run with those of the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
