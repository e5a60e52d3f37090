//! Attitude and position from corners: one vertex and three edges, one vertical and two horizontal.
//!
//! The problem is that of [Liu et al. 2018]; equation and section numbers here are theirs. Everything is in unit
//! bearings, so any central camera works: their standard model (the vertex turned to the optical axis) is the pencil of
//! planes through the vertex's bearing.
//!
//! `closed_form` solves for the attitude from three rays. `coloured` and `general` find corners in images. `sequence`
//! estimates poses in image sequences, with data association and tracking. Files beside these rooms are what they share.
//!
//! [Liu et al. 2018]: https://deepai.org/publication/trove-feature-detection-for-online-pose-recovery-by-binocular-cameras

mod closed_form;
mod coloured;
mod detector;
mod edge_place;
mod estimate;
mod estimator_options;
mod feature;
mod frame;
mod fusion;
mod general;
mod options;
mod pose;
mod ray;
mod sequence;
mod sized;
mod trace;
mod triangulation;

use self::closed_form::attitude;
use self::coloured::segmentation;

pub use self::closed_form::attitude::{CornerAttitude, CornerAttitudes, IncludedAngle, corner_attitudes};
pub use self::closed_form::included_angle::included_angle;
pub use self::closed_form::prior::{AttitudePrior, VerticalSense};
pub use self::closed_form::resolve::{Alignment, ResolvedAttitude, View, resolve};
pub use self::closed_form::screening::Screening;
pub use self::closed_form::standard_model::{CornerCase, StandardType};
pub use self::coloured::Window;
pub use self::coloured::segmentation::{ColorOptions, Primary};
pub use self::detector::{CornerDetector, CornerScratch};
pub use self::estimate::{BelievedCorner, CornerEstimate, CornerVerdict, EdgeAngle, Hypothesis, PlaceVerdict};
pub use self::estimator_options::{EstimatorOptions, KnownEdge};
pub use self::feature::{CornerFeature, Edge};
pub use self::frame::Frame;
pub use self::fusion::{FusedPose, fuse_rays};
pub use self::general::edge_ends::EdgeEnd;
pub use self::options::{
    ColouredOptions, CornerMethod, DetectorOptions, EdgeLineOptions, GeneralOptions, OrientationChoice, PaperOptions,
};
pub use self::pose::{CornerOptions, CornerPose, corner_poses};
pub use self::ray::FittedRay;
pub use self::sequence::estimator::CornerPoseEstimator;
pub use self::sequence::frame_knowledge::{CameraTurn, FrameKnowledge, GravityDirection};
pub use self::sequence::names::{CornerNames, KnownWorld, NamedPlace};
pub use self::sequence::track::{KnownCorner, Track};
pub use self::triangulation::{BearingObservation, TriangulatedPoint, triangulate};
