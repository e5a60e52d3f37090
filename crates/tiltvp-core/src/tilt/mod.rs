//! The tilt of one image, from the vanishing point of its vertical edges (paper 000), and of successive images fused.

mod common_direction;
mod confidence;
mod correction;
mod estimate;
mod estimator;
mod filter;
mod image_space;
mod level;
mod options;
mod refine;
mod vector_consensus;

pub use common_direction::{CommonDirection, CommonDirectionOptions, common_direction};
pub use correction::Correction;
pub use estimate::{EdgeElement, TiltEstimate};
pub use estimator::{Scratch, TiltEstimator};
pub use filter::{FilteredTilt, MountingOptions, TiltFilter, TiltFilterOptions, TiltFilterState, Verdict};
pub use level::level_map;
pub use options::{METHODS, Method, TiltOptions};
pub use refine::RefineOptions;
