//! What attacks the core: each function takes any bytes, and panics where an answer is neither right nor refused.

mod bytes;
mod image;
mod lens;
mod picture;
mod segments;

pub use image::image;
pub use lens::lens;
pub use segments::segments;
