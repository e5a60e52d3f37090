//! Lines tracked through successive frames: predicted bearings, data association, identities.

mod assignment;
mod jump;
pub(super) mod parallax;
pub(super) mod tracker;
pub(super) mod tracker_state;
