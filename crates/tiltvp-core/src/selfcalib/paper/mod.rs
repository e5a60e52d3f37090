//! The method of Scaramuzza, Siegwart and Martinelli (2009), exactly, as a baseline.

mod filter;
mod model;

pub(super) use self::filter::PaperFilter;
pub use self::model::{Feature, dynamics, dynamics_jacobians, observation, observation_jacobians};
