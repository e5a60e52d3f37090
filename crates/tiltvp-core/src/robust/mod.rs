//! Robust fits that know no vision: one random-sampling loop, one trimming loop, one reweighting loop.

mod direction;
mod loss;
mod problem;
mod ransac;
mod refit;
mod report;
mod rows;
mod sampler;

pub use direction::Direction;
pub use loss::Gate;
pub use problem::Problem;
pub use ransac::{RansacOptions, ransac};
pub use refit::{RejectRefitOptions, ReweightOptions, normal_quantile, reject_refit, reweight};
pub use report::{FitReport, Stop};
pub use rows::{Moments, Real, Rows};
