//! Vertical lines of single images: found, described, matched and tracked.
//!
//! Equation and section numbers are those of Scaramuzza, Siegwart and Martinelli 2009.
//!
//! ```
//! use nalgebra::Matrix3;
//! use tiltvp_core::camera::{Camera, Equidistant, Model};
//! use tiltvp_core::image::ImageView;
//! use tiltvp_core::lines::{LineExtractor, LineOptions, LineTracker, Lines, Motion, TrackerOptions};
//!
//! # fn main() -> tiltvp_core::Result<()> {
//! let camera = Camera::new(320, 240, Model::Equidistant(Equidistant::new(69.8, 159.5, 119.5)?))?;
//! let extractor = LineExtractor::new(camera, Matrix3::identity(), LineOptions::for_method("great-circle")?)?;
//! let mut tracker = LineTracker::new(TrackerOptions::default())?;
//! let (mut scratch, mut lines) = (extractor.scratch(), Lines::default());
//! let (mut descriptors, mut tracked) = (Vec::new(), Vec::new());
//!
//! // A picture of a light door to the left of the robot, and another after a turn by 0.1 radians to the left.
//! for turn_rad in [0.0, 0.1f64] {
//!     let door = |u: f64, v: f64| (0.4..1.2).contains(&((v - 119.5).atan2(u - 159.5) + turn_rad));
//!     let level = |i: u32| if door(f64::from(i % 320), f64::from(i / 320)) { 200 } else { 60 };
//!     let pixels: Vec<u8> = (0..320 * 240).map(level).collect();
//!     let image = ImageView::new(&pixels, 320, 240, 320)?;
//!     extractor.extract(&image, None, None, &mut scratch, &mut lines)?; // `None`: the robot does not lean.
//!     extractor.describe(&image, &lines, &mut scratch, &mut descriptors)?;
//!     tracker.update(&lines, &descriptors, Some(&Motion { turn_rad, distance_m: Some(0.0) }), &mut tracked)?;
//!     for (found, bearing_rad) in tracked.iter().zip([0.4, 1.2]) {
//!         println!("line {} at {:.3} radians", found.track, found.line.bearing_rad);
//!         assert!((found.line.bearing_rad - (bearing_rad - turn_rad)).abs() < 0.01);
//!     }
//!     assert_eq!([tracked[0].track, tracked[1].track], [0, 1]);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Tracks and bearings are the landmarks of [`selfcalib`](crate::selfcalib), where `robot_from_camera` has no turn about
//! the vertical: that is what is sought there.

mod angles;
mod description;
mod descriptor_options;
mod extraction;
mod extractor;
mod line;
mod matcher;
mod options;
mod order;
mod tables;
mod tracker_options;
mod tracking;
mod wide;

pub use self::description::dissimilarity::{descriptor_distances, ssd_matrix, zncc_matrix};
pub use self::descriptor_options::{DescriptorKind, DescriptorOptions, Normalisation};
pub use self::extractor::{LineExtractor, LineScratch};
pub use self::line::{Line, LineFrame, Lines, fingerprint};
pub use self::matcher::{BearingGate, MatchOptions, MatchScratch, match_descriptors};
pub use self::options::{GreatCircleOptions, LineMethod, LineOptions, RadialOptions};
pub use self::order::Match;
pub use self::tracker_options::TrackerOptions;
pub use self::tracking::parallax::{Motion, Parallax};
pub use self::tracking::tracker::LineTracker;
pub use self::tracking::tracker_state::{Followed, FrameMemory, TrackedLine, TrackerState};
pub use self::wide::{Profiles, WideMatch, WideOptions, WideScratch, match_wide};
