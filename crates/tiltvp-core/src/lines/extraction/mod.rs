//! Vertical lines found in an image: as great circles through the vertical, or as radial lines about the mirror's centre.

pub(super) mod great_circle;
mod line_fit;
pub(super) mod radial;
mod rim_center;
