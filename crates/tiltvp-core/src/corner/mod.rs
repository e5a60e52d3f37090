//! Attitude and position from corners: one vertex and three edges, one vertical and two horizontal.
//!
//! The problem is that of [Liu et al. 2018]; equation and section numbers are those of the paper. Everything is in unit
//! bearings, so that any central camera will do: what the paper calls the standard model (the vertex turned to the optical
//! axis) is the pencil of planes through the vertex's bearing here.
//!
//! [Liu et al. 2018]: https://deepai.org/publication/trove-feature-detection-for-online-pose-recovery-by-binocular-cameras

mod attitude;
mod coloured;
mod coloured_edges;
mod completion;
mod consensus;
mod detector;
mod edge_place;
mod ends;
mod estimate;
mod estimator;
mod estimator_options;
mod fusion;
mod gamma;
mod general;
mod guided;
mod highlights;
mod junctions;
mod options;
mod parallels;
mod pose;
mod position;
mod prior;
mod rays;
mod resolve;
mod screening;
mod segmentation;
mod segments;
mod standard;
mod trace;
mod track;
mod vertex;
mod voices;

pub use self::attitude::{CornerAttitude, CornerAttitudes, IncludedAngle, corner_attitudes};
pub use self::coloured::Window;
pub use self::detector::{CornerDetector, CornerScratch};
pub use self::ends::EdgeEnd;
pub use self::estimate::{CornerEstimate, Hypothesis, Verdict};
pub use self::estimator::{CornerPoseEstimator, Frame};
pub use self::estimator_options::EstimatorOptions;
pub use self::fusion::{FusedPose, fuse_rays};
pub use self::gamma::included_angle;
pub use self::options::{
    CORNER_METHODS, ColouredOptions, CornerMethod, DetectorOptions, GeneralOptions, OrientationChoice,
};
pub use self::pose::{CornerOptions, CornerPose, corner_poses};
pub use self::position::{Sighting, TriangulatedPoint, triangulate};
pub use self::prior::{AttitudePrior, VerticalSense};
pub use self::rays::FittedRay;
pub use self::resolve::{Alignment, ResolvedAttitude, View, resolve};
pub use self::screening::Screening;
pub use self::segmentation::{ColorOptions, Primary};
pub use self::segments::Segment;
pub use self::standard::{CornerCase, StandardType};
pub use self::track::{Landmark, Track};
pub use self::vertex::{CornerFeature, Edge};
