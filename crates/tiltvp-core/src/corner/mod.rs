//! Attitude and position from corners: one vertex and three edges, one vertical and two horizontal.
//!
//! The problem is that of [Liu et al. 2018]; equation and section numbers here are theirs. Everything is in unit
//! bearings, so any central camera works: their standard model (the vertex turned to the optical axis) is the pencil of
//! planes through the vertex's bearing.
//!
//! `closed_form` solves for the attitude from three rays. `coloured` and `general` find corners in images. `sequence`
//! estimates poses in image sequences, with data association and tracking. Files beside these rooms are what they share.
//!
//! ```
//! use nalgebra::{Matrix3, Vector3};
//! use tiltvp_core::camera::{Camera, Model, Pinhole};
//! use tiltvp_core::corner::{CornerDetector, CornerPoseEstimator, DetectorOptions, EstimatorOptions, Frame, FrameKnowledge};
//! use tiltvp_core::geometry::RigidMotion;
//! use tiltvp_core::image::ImageView;
//!
//! # fn main() -> tiltvp_core::Result<()> {
//! let camera = Camera::new(320, 240, Model::Pinhole(Pinhole::new([250.0; 2], [159.5, 119.5], &[])?))?;
//! let detector = CornerDetector::new(camera, DetectorOptions::for_method("general")?, None)?;
//! let left_from_right = RigidMotion::new("left_from_right", Matrix3::identity(), Vector3::new(0.12, 0.0, 0.0))?;
//! let right = Some((detector.clone(), left_from_right));
//! let mut estimator = CornerPoseEstimator::new(detector, right, EstimatorOptions::default())?;
//!
//! let pixels = vec![128u8; 320 * 240];
//! let image = Frame::Gray(ImageView::new(&pixels, 320, 240, 320)?);
//! let found = estimator.observe(&image, Some(&image), &FrameKnowledge::default())?;
//! match found.pose() {
//!     Some(pose) => println!("{:?} from the camera, {}", pose.vertex_m, pose.camera_from_object),
//!     None => assert_eq!(found.verdict.reason(), "no corner in the left image"), // A grey wall has none.
//! }
//! # Ok(())
//! # }
//! ```
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
pub use self::estimate::{BelievedCorner, CornerEstimate, CornerVerdict, EdgeAngle, EdgeEnd, Hypothesis, PlaceVerdict};
pub use self::estimator_options::{EstimatorOptions, KnownEdge};
pub use self::feature::{CornerFeature, Edge};
pub use self::frame::Frame;
pub use self::fusion::{FusedPose, fuse_rays};
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
