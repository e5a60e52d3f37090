//! The image as the upright robot's camera would have seen it: where each of its pixels is found in the leaning one.

mod grid;
mod leveller;
mod parts;
mod places;
mod shown;
mod strip;
mod surface;

pub use leveller::{LevelMap, Leveller, MAP_ERROR_PX};
