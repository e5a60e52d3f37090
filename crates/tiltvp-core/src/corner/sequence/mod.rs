//! Corners in a sequence of images of one camera or a pair: hypotheses from pairs of corners, tracking, and transfer between views.

mod agreement;
pub(super) mod estimator;
mod height;
mod pairs;
mod paper;
mod shared_attitude;
mod support;
pub(super) mod track;
mod transfer;
