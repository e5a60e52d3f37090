//! Attitude and position from corners: one vertex and three edges, one vertical and two horizontal.
//!
//! The problem is that of [Liu et al. 2018]; equation and section numbers are those of the paper. Everything is in unit
//! bearings, so that any central camera will do: what the paper calls the standard model (the vertex turned to the optical
//! axis) is the pencil of planes through the vertex's bearing here.
//!
//! [Liu et al. 2018]: https://arxiv.org/abs/1812.10952

mod attitude;
mod fusion;
mod gamma;
mod pose;
mod position;
mod prior;
mod properties;
mod rays;
mod resolve;

mod standard;
mod vertex;

pub use self::attitude::{CornerAttitude, CornerAttitudes, IncludedAngle, corner_attitudes};
pub use self::fusion::{FusedPose, fuse_rays};
pub use self::gamma::included_angle;
pub use self::pose::{CornerPose, PoseOptions, corner_poses};
pub use self::position::{Sighting, TriangulatedPoint, triangulate};
pub use self::prior::{AttitudePrior, VerticalSense};
pub use self::properties::Screening;
pub use self::rays::FittedRay;
pub use self::resolve::{Alignment, ResolvedAttitude, View, resolve};

pub use self::standard::{CornerCase, StandardType};
pub use self::vertex::{CornerFeature, Edge};
