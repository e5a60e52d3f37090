//! A corner as both images of a frame show it.

use crate::corner::estimate::Hypothesis;

/// A feature of each image that may be one corner, and the poses that both admit, the likeliest first.
#[derive(Clone)]
pub(crate) struct SeenPair {
    pub(crate) left: usize,
    pub(crate) right: usize,
    pub(crate) poses: Vec<Hypothesis>,
}
