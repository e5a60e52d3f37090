//! The attitude of a corner from one image in closed form, and what chooses among its solutions.

pub(super) mod attitude;
pub(super) mod included_angle;
pub(super) mod prior;
pub(super) mod resolve;
pub(super) mod screening;
pub(super) mod standard_model;
