//! Corners in a sequence of images of one camera or a pair: hypotheses from pairs of corners, tracking, and transfer between views.

mod agreement;
mod believed;
pub(super) mod estimator;
pub(super) mod frame_knowledge;
mod height;
mod knowledge;
pub(super) mod names;
mod one_image;
mod pair_search;
mod pairs;
mod paper;
mod seen_pair;
mod shared_attitude;
mod size;
mod support;
pub(super) mod track;
mod transfer;
mod turned_apart;
