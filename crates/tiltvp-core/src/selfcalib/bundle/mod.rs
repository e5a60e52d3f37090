//! Bundle adjustment: keyframes, landmarks and mounting as one sparse least-squares problem. The sliding window and the whole
//! log both solve it.

mod cholesky;
mod cluster_robust;
mod descent;
mod free_parameters;
mod jackknife;
mod keyframe;
mod landmark_distance;
mod linearisation;
mod link;
mod motion_residual;
mod observation_pose;
mod pose_elimination;
mod problem;
mod random_signs;
mod scatter;
mod schur;

pub(super) use self::cholesky::{CholeskyFactor, combine, subtract_square};
pub(super) use self::cluster_robust::{largest_ratio, widened};
pub(super) use self::descent::{DescentReport, FIRST_DAMPING, Solution};
pub(super) use self::free_parameters::FreeParameters;
pub(super) use self::jackknife::DoubtedParts;
pub(super) use self::keyframe::{Keyframe, Observation};
pub(super) use self::landmark_distance::{DISTANCE_STEP, DISTANCE_STEPS, UNKNOWN_LOG_SIGMA};
pub(super) use self::problem::BundleProblem;
pub(super) use self::random_signs::RandomSigns;
pub(super) use self::schur::ReducedSystem;
