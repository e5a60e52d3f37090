//! The image as the upright robot's camera would have seen it: where each of its pixels is found in the leaning one, and its levels.

mod grid;
mod leveller;
mod pixels;
mod surface;

pub use leveller::{Leveller, MAP_ERROR_PX};
