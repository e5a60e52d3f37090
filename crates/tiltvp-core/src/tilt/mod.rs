//! The tilt of one image, from the vanishing point of its vertical edges (Fleer 2017), and of successive images fused.

mod common_direction;
mod confidence;
mod corrected;
mod correction;
mod estimate;
mod estimator;
mod filter;
mod fit;
mod image_circle;
mod image_edges;
mod level;
mod lightness;
mod methods;
mod options;
mod posterior;
mod scratch;
mod shift_model;
mod simplex;
mod tables;
mod trained;
mod training_set;
mod trust;

pub use common_direction::{CommonDirection, CommonDirectionOptions, common_direction};
pub use correction::Correction;
pub use estimate::{ALTERNATIVES, Alternative, EdgeElement, TiltEstimate};
pub use estimator::TiltEstimator;
pub use filter::{FilteredTilt, MountingOptions, TiltFilter, TiltFilterOptions, TiltFilterState, Verdict};
pub use image_edges::{EdgeOrigin, ImageEdges};
pub use level::{Leveller, MAP_ERROR_PX};
pub use methods::*;
pub use options::TiltOptions;
pub use posterior::{PosteriorCorrection, PriorOfTilt, train_posterior};
pub use scratch::Scratch;
pub use shift_model::ShiftModel;
pub use trained::{AffineCorrection, TrainedCorrection, train_affine, train_factor};
pub use trust::Doubt;
