//! What the method of straight edges works in.

use nalgebra::Vector3;

use super::anywhere::Search;
use super::frame::Edge;
use super::near::{Columns, NearWork};
use crate::edges::EdgePixels;
use crate::segments::{FinderScratch, Segments};

/// The memory of one thread.
#[derive(Debug, Clone)]
pub(in crate::tilt) struct SegmentWork {
    pub(super) finder: FinderScratch,
    pub(super) segments: Segments,
    /// The pixels that vote.
    pub(super) strong: EdgePixels,
    /// The segments that are weighed, in the robot frame.
    pub(super) edges: Vec<Edge>,
    /// Of those that may be vertical: their numbers, and the probability of being vertical by the last fit.
    pub(super) weighed: Vec<(u32, f64)>,
    /// The same by the fit to all edges, where steps of the pixel grid are then left out.
    pub(super) weighed_with_grid: Vec<(u32, f64)>,
    pub(super) search: Search,
    /// Levels of the sample.
    pub(super) levels: Vec<f32>,
    pub(super) near: NearWork,
    pub(super) columns: Columns,
}

impl SegmentWork {
    pub(super) fn new(finder: FinderScratch) -> Self {
        Self {
            finder,
            segments: Segments::default(),
            strong: EdgePixels::default(),
            edges: Vec::new(),
            weighed: Vec::new(),
            weighed_with_grid: Vec::new(),
            search: Search::default(),
            levels: Vec::new(),
            near: NearWork::default(),
            columns: Columns::default(),
        }
    }

    /// The directions that may be up in the last image, and what tells which one is.
    pub(in crate::tilt) fn hypotheses(&self) -> Vec<(Vector3<f64>, Vec<f64>)> {
        self.search.hypotheses.iter().map(|h| (h.up, h.features.to_vec())).collect()
    }
}
