//! Rows `(x, y, z)` in three columns and their residuals `d = h0 x + h1 y + h2 z`: counting, gains, and sums of gated products.

mod bound;
mod double;
mod gain;
mod grouped;
mod kernel;
mod real;
mod simd;
mod single;
#[cfg(target_arch = "x86_64")]
mod sse2;
mod sums;

pub use bound::ConsensusBound;
pub use grouped::{GROUPS, GroupSums, sums_by_group};
pub use real::{GAINS, Real};
pub use sums::Sums;

/// How the weight of a row follows from its residual `d`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gate<T> {
    /// Rows keep their weights.
    Open,
    /// Rows with `|d|` beyond the reach are rejected: their weights are set to zero.
    Hard {
        /// The largest `|d|` that is kept.
        reach: T,
    },
    /// As [`Hard`](Self::Hard), but what is added up are the rows that are newly rejected.
    Rejected {
        /// The largest `|d|` that is kept.
        reach: T,
    },
    /// Rows with `|d|` beyond the reach do not count, and keep their weights.
    Within {
        /// The largest `|d|` that counts.
        reach: T,
    },
    /// Weights are multiplied by `max(0, 1 - d^2 inverse)^8`.
    Soft {
        /// One over the square of the residual from which on nothing counts.
        inverse: T,
    },
}

/// What is known of the weights of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// Any numbers from zero on.
    Any,
    /// Ones and zeros: no row is multiplied by one, which takes less time.
    Unit,
}

/// Gates as the parameter of generic kernels.
const OPEN: u8 = 0;
const HARD: u8 = 1;
const REJECTED: u8 = 2;
const WITHIN: u8 = 3;
const SOFT: u8 = 4;
