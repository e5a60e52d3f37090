//! Robust fits that know no vision: one random-sampling loop, one trimming loop, one reweighting loop.

mod aligned;
mod census;
mod compaction;
mod direction;
mod grouped;
mod lanes;
mod local;
mod loss;
mod marginal;
mod problem;
mod prosac;
mod ransac;
mod real;
mod refit;
mod report;
mod rows;
mod sampler;
mod sampling;
mod score;
mod total;
mod vectors;
mod verification;

pub use census::Census;
pub(crate) use compaction::{Block, Kept, ROOM, compact};
pub use direction::Direction;
pub use grouped::{GROUPS, GroupSums};
pub use loss::Gate;
pub use problem::Problem;
pub use ransac::{RansacOptions, RansacScratch, ransac};
pub use real::Real;
pub use refit::{RejectRefitOptions, ReweightOptions, normal_quantile, reject_refit, reweight};
pub use report::{FitReport, Stop};
pub use rows::{Moments, Rows};
pub use sampling::{LocalOptimization, SampleOrder, Sampling, Score, Verification};
