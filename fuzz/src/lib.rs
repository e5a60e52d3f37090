//! What attacks the core: each function takes any bytes, and panics where an answer is neither right nor refused.
//!
//! | target | what is attacked | what is checked |
//! |---|---|---|
//! | [`lens`] | parameters, sizes and limits of every lens; pixels and bearings of any numbers | refusals; unit rays; round trips; finite Jacobians; parameters are told as they were taken |
//! | [`image()`] | views of any size, stride and length; any picture before every method of tilt, lines, corners and levelling, by default options | nothing beyond rows is read; answers agree with themselves; strides do not tell |
//! | [`segments`] | any picture before detectors of straight edges of any options | arcs of unit bearings; memory that has served does not tell |
//! | [`corner`] | rays, angles, priors and pairs of cameras of any numbers | rotations, probabilities and covariances are such |
//! | [`point`] | bearings, covariances and cameras of any numbers | points are finite and have covariances |
//! | [`options`] | values and names of the options of every class, with tables made of some | refusals by name; options are told as they were taken |
//! | [`state`] | states of tilt filters and line trackers of any numbers; then steps | refusals; a state that was taken can be taken again |
//! | [`matching`] | lines, descriptors, profiles and motions of any numbers, matched and followed | no line is two; a refused frame changes nothing |
//! | [`sequence`] | pictures one after the other before estimators of corners' poses, with gravity and turns of any numbers | rotations and probabilities are such |
//! | [`log`] | logs of short drives of any numbers | refusals; what can be relied upon is finite |
//! | [`training`] | shifts and leans of any numbers | refusals; corrections are finite |
//! | [`calibrator`] | states of calibrators of any bytes; then steps | refusals; a refused step changes nothing |
//!
//! Cameras are small and what is costly is made once and kept, so that an execution takes a fraction of a millisecond: coverage guides by
//! numbers of executions. Checks that take as long as what they check are left to some of the executions, which a byte chooses.
//! What is kept has served other inputs: where an input alone does not show a finding again, the folder of all does.

#![allow(clippy::expect_used, clippy::missing_panics_doc, reason = "a panic is a finding")]
#![allow(clippy::large_enum_variant, clippy::type_complexity, reason = "what is kept is made once")]

mod bytes;
mod corner;
#[cfg(test)]
mod corpus;
mod image;
mod learning;
mod lens;
mod matching;
mod options;
mod picture;
mod segments;
mod sequence;
mod state;

pub use corner::{corner, point};
pub use image::image;
pub use learning::{log, training};
pub use lens::lens;
pub use matching::matching;
pub use options::options;
pub use segments::segments;
pub use sequence::sequence;
pub use state::{calibrator, state};
