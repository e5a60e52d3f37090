//! Vertical lines of single images: found, described, matched and tracked.
//!
//! Equation and section numbers are those of Scaramuzza, Siegwart and Martinelli 2009.

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
pub use self::line::{Line, LineFrame, Lines};
pub use self::matcher::{BearingGate, MatchOptions, MatchScratch, match_descriptors};
pub use self::options::{GreatCircleOptions, LineMethod, LineOptions, RadialOptions};
pub use self::order::Match;
pub use self::tracker_options::TrackerOptions;
pub use self::tracking::parallax::{Motion, Parallax};
pub use self::tracking::tracker::LineTracker;
pub use self::tracking::tracker_state::{Followed, FrameMemory, TrackedLine, TrackerState};
pub use self::wide::{Profiles, WideMatch, WideOptions, WideScratch, match_wide};
