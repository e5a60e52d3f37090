//! What attacks the core: each function takes any bytes, and panics where an answer is neither right nor refused.

mod bytes;
mod corner;
mod image;
mod lens;
mod options;
mod picture;
mod segments;
mod state;

pub use corner::{corner, point};
pub use image::image;
pub use lens::lens;
pub use options::options;
pub use segments::segments;
pub use state::state;
