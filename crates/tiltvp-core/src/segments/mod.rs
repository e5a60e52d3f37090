//! Straight edges of any central image as arcs of great circles: one detector for tilt, lines and corners.
//!
//! Ridge pixels are linked to chains, chains are cut where a great circle no longer fits, and each piece is fitted by the places
//! of its pixels between pixel centres; pieces of one great circle are then joined.

mod bearings;
mod chains;
mod detector;
mod fit;
mod joining;
mod options;
mod pieces;
mod segment;

pub(crate) use detector::{FinderScratch, SegmentFinder};
pub use detector::{SegmentDetector, SegmentScratch};
pub use options::{SegmentDetectorOptions, SegmentOptions};
pub use segment::{EdgePoint, Segment, Segments};
