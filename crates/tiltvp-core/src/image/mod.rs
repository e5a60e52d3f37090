//! Images as the core sees them: borrowed rows of grey levels or colours, and rows and places made from them.

mod color;
mod linear;
mod smooth;
mod view;

pub use color::ColorView;
pub use linear::LightTable;
pub use smooth::Smoother;
pub use view::ImageView;
pub(crate) use view::check_size;
