//! All vector code of tiltvp, and all of its `unsafe`: functions over slices, each tested equal to its scalar twin.
//!
//! Everything here is safe to call: a function looks for what the machine has, and checks lengths once for a whole slice. Nothing
//! depends on a camera, an image or a model; the crate knows numbers only.

pub mod aligned;
pub mod bilinear;
pub mod compaction;
pub mod gradient;
pub mod level;
pub mod marks;
pub mod normals;
pub mod prefetch;
pub mod quadratic;
pub mod ridge;
pub mod rows;
pub mod smoothing;
pub mod surface;
