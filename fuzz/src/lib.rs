//! What attacks the core: each function takes any bytes, and panics where an answer is neither right nor refused.

mod bytes;
mod lens;

pub use lens::lens;
