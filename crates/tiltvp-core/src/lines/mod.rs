//! Vertical lines of single images: found, described, matched and followed (paper 001, sections 2 to 4 and 9.1).

mod arctan;
mod assignment;
mod candidates;
mod center;
mod descriptor;
mod descriptor_options;
mod dissimilarity;
mod extractor;
mod fit;
mod great_circle;
mod histogram;
mod line;
mod matcher;
mod options;
mod order;
mod parallax;
mod patch;
mod radial;
mod sight;
mod tracker;
mod tracker_options;
mod tracker_state;

pub use descriptor_options::{DescriptorOptions, Normalisation};
pub use dissimilarity::{descriptor_distances, ssd_matrix, zncc_matrix};
pub use extractor::{LineExtractor, LineScratch};
pub use line::{Line, LineFrame, Lines};
pub use matcher::{BearingGate, MatchOptions, MatchScratch, match_descriptors};
pub use options::{GreatCircleOptions, LINE_METHODS, LineMethod, LineOptions, RadialOptions};
pub use order::Match;
pub use parallax::{Motion, Parallax};
pub use tracker::LineTracker;
pub use tracker_options::TrackerOptions;
pub use tracker_state::{Followed, FrameMemory, TrackedLine, TrackerState};
