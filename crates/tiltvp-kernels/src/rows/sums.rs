//! What a pass over rows adds up.

use super::simd::WIDTH;

/// Sums in double precision.
#[derive(Debug, Default)]
pub struct Sums {
    /// Rows with a weight above zero.
    pub count: usize,
    /// Weight `w`, then `w (xx, xy, yy, xd, yd, dd)`.
    pub sums: [f64; 7],
}

impl Sums {
    /// Adds a block's count, and its partial sums.
    pub(super) fn add(&mut self, count: usize, partial: &[[f32; WIDTH]; 7]) {
        self.count += count;
        for (sum, partial) in self.sums.iter_mut().zip(partial) {
            let mut fours = [0.0; 4];
            for four in partial.as_chunks::<4>().0 {
                fours.iter_mut().zip(four).for_each(|(sum, part)| *sum += f64::from(*part));
            }
            *sum += (fours[0] + fours[1]) + (fours[2] + fours[3]);
        }
    }
}
