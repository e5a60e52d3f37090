//! Descriptors of lines: image patches along a line, histograms of gradient orientation, and distances between descriptors.

pub(super) mod descriptor;
pub(super) mod dissimilarity;
mod histogram;
pub(super) mod patch;
pub(super) mod profile;
pub(super) mod profile_rows;
