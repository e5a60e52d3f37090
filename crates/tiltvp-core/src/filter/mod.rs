//! Recursive estimation that knows no vision: Kalman corrections, complementary filters, chi-square gates, and whether a
//! filter is consistent.

mod chi_square;
mod complementary;
mod consistency;
mod ekf;
mod gate;

pub use chi_square::{chi_square_cdf, chi_square_quantile};
pub use complementary::{ComplementaryFilter, ComplementaryOptions, ComplementaryState};
pub use consistency::{ConsistencyBand, squared_mahalanobis};
pub use ekf::{Innovation, positive_semidefinite, restored, symmetric};
pub use gate::{ChiSquareGate, probability_within};
