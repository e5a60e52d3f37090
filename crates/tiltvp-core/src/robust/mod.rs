//! Robust fits that know no vision: one random-sampling loop, one trimming loop, one reweighting loop.

mod direction;
mod hypotheses;
mod local;
mod loss;
mod moments;
mod problem;
mod ransac;
mod ransac_options;
mod refit;
mod report;
mod rows;
mod sampler;
mod sampling;

pub use direction::Direction;
pub use loss::Gate;
pub use moments::Moments;
pub use problem::Problem;
pub use ransac::{RansacScratch, ransac};
pub use ransac_options::RansacOptions;
pub use refit::{RejectRefitOptions, ReweightOptions, normal_quantile, reject_refit, reweight};
pub use report::{FitReport, Stop};
pub use rows::Rows;
pub use sampling::{LocalOptimization, SampleOrder, Sampling, Score};
pub use tiltvp_kernels::rows::{GROUPS, GroupSums, Real, Weights};
