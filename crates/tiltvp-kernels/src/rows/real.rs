//! The arithmetic that rows are stored in, with the kernels for it.

use super::double::{self, BLOCK};
use super::{Gate, Sums, Weights, gain, single};
use crate::aligned::Dense;

/// The arithmetic that rows are stored in: `f32` or `f64`.
pub trait Real: Dense + PartialOrd {
    /// Most rows that [`accumulate`](Self::accumulate) adds up in their own precision, and takes at once.
    const BLOCK: usize;
    /// Whether sums over what a gate rejects, [`Gate::Rejected`], are worth their rounding.
    const TRIMS: bool;
    /// Rounds from double precision.
    fn from_f64(value: f64) -> Self;
    /// Widens to double precision.
    fn to_f64(self) -> f64;
    /// Rounds to single precision.
    fn to_f32(self) -> f32;
    /// The largest number whose square, rounded, is at most the square of a threshold.
    fn reach(threshold: f64) -> Self;
    /// Counts rows with `|d| <= reach`; columns must be of one length.
    fn count(rows: [&[Self]; 3], model: [Self; 3], reach: Self) -> usize;
    /// Adds at most [`BLOCK`](Self::BLOCK) rows to the sums and applies the gate to their weights; columns and weights must be of
    /// one length.
    fn accumulate(
        rows: [&[Self]; 3],
        weights: (&mut [f32], Weights),
        model: [Self; 3],
        gate: Gate<Self>,
        sums: &mut Sums,
    );
    /// The sum of `max(0, 1 - (d inverse)^2)` over at most [`GAINS`] rows; columns must be of one length.
    fn gains(rows: [&[Self]; 3], model: [Self; 3], inverse: Self) -> f64;
}

/// Most rows that [`Real::gains`] takes at once.
pub const GAINS: usize = BLOCK;

/// What is the same for both, but for the type.
macro_rules! conversions {
    ($float:ty) => {
        fn from_f64(value: f64) -> Self {
            value as Self
        }
        fn to_f64(self) -> f64 {
            f64::from(self)
        }
        fn to_f32(self) -> f32 {
            self as f32
        }
        fn reach(threshold: f64) -> Self {
            let limit = (threshold * threshold) as Self;
            // Near the root of the number half-way to the next; a few steps mend what is rounded.
            let mut reach = (0.5 * (f64::from(limit) + f64::from(limit.next_up()))).sqrt() as Self;
            for _ in 0..4 {
                reach = if reach * reach > limit { reach.next_down() } else { reach };
            }
            for _ in 0..4 {
                let next = reach.next_up();
                reach = if next * next <= limit { next } else { reach };
            }
            reach
        }
    };
}

impl Real for f32 {
    // Each of sixteen partial sums adds 128 numbers, which loses less than 1e-5 of it.
    const BLOCK: usize = 2048;
    const TRIMS: bool = true;
    conversions!(f32);

    fn count(rows: [&[f32]; 3], model: [f32; 3], reach: f32) -> usize {
        single::count(rows, model, reach)
    }
    fn accumulate(
        rows: [&[f32]; 3],
        weights: (&mut [f32], Weights),
        model: [f32; 3],
        gate: Gate<f32>,
        sums: &mut Sums,
    ) {
        single::accumulate(rows, weights, model, gate, sums);
    }
    fn gains(rows: [&[f32]; 3], model: [f32; 3], inverse: f32) -> f64 {
        gain::single(rows, model, inverse)
    }
}

impl Real for f64 {
    const BLOCK: usize = BLOCK;
    const TRIMS: bool = false;
    conversions!(f64);

    fn count(rows: [&[f64]; 3], model: [f64; 3], reach: f64) -> usize {
        double::count(rows, model, reach)
    }
    fn accumulate(
        rows: [&[f64]; 3],
        (weights, _): (&mut [f32], Weights),
        model: [f64; 3],
        gate: Gate<f64>,
        sums: &mut Sums,
    ) {
        double::accumulate(rows, weights, model, gate, sums);
    }
    fn gains(rows: [&[f64]; 3], model: [f64; 3], inverse: f64) -> f64 {
        gain::double(rows, model, inverse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reach_is_the_last_number_whose_square_is_within() {
        for i in 1..2000 {
            let threshold = 1e-4 * f64::from(i) * f64::from(i);
            let (single, double) = (f32::reach(threshold), f64::reach(threshold));
            let limit = (threshold * threshold) as f32;
            assert!(single * single <= limit && single.next_up() * single.next_up() > limit);
            let limit = threshold * threshold;
            assert!(double * double <= limit && double.next_up() * double.next_up() > limit);
        }
    }
}
