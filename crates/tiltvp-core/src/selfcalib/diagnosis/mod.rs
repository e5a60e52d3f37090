//! How well a solution fits its log, and which assumption is most likely wrong where it does not.

mod bump;
mod contradictions;
mod deviations;
mod noise;
mod suspect;

pub use self::contradictions::Contradictions;
pub(super) use self::deviations::{Assumed, Deviation, doubted_of_camera};
pub(super) use self::noise::NoiseFactors;
pub(super) use self::suspect::DEVIATION_SIGMAS;
pub use self::suspect::{Cause, Suspect};
