//! Images as the core sees them: borrowed rows of grey levels, and smoothed rows made from them.

mod smooth;
mod view;

pub use smooth::Smoother;
pub use view::ImageView;
