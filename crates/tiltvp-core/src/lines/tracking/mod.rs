//! Lines tracked through successive frames: predicted bearings, data association, identities.

mod assignment;
pub(super) mod parallax;
pub(super) mod tracker;
pub(super) mod tracker_state;
