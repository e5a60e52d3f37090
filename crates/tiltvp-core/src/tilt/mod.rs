//! The tilt of one image, from the vanishing point of its vertical edges (paper 000).

mod common_direction;
mod confidence;
mod correction;
mod estimate;
mod estimator;
mod image_space;
mod level;
mod options;
mod refine;
mod vector_consensus;

pub use common_direction::{CommonDirection, CommonDirectionOptions, common_direction};
pub use correction::Correction;
pub use estimate::{EdgeElement, TiltEstimate};
pub use estimator::{Scratch, TiltEstimator};
pub use level::level_map;
pub use options::{METHODS, Method, TiltOptions};
pub use refine::RefineOptions;
