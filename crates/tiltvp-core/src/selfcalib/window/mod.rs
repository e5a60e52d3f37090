//! The sliding-window estimator: an iterated Kalman filter whose last keyframes are kept, solved again and relinearised, and
//! marginalised when there are too many.

mod examination;
mod landmark_initialisation;
mod marginalise;
mod monitor;
mod motion;
mod relinearise;
mod state;
mod step;
mod tuning;
mod update;

pub(super) use self::monitor::InnovationMonitor;
pub(super) use self::state::SlidingWindow;
