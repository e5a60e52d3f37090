//! What a pass over rows adds up.

use super::vectors::LANES;

/// Totals in double precision: weight, then the six moments.
#[derive(Default)]
pub struct Total {
    pub(super) count: usize,
    pub(super) sums: [f64; 7],
}

impl Total {
    /// Adds a block's count, and its sums lane by lane.
    pub(super) fn add(&mut self, count: usize, lanes: &[[f32; LANES]; 7]) {
        self.count += count;
        for (sum, lanes) in self.sums.iter_mut().zip(lanes) {
            let mut fours = [0.0; 4];
            for four in lanes.as_chunks::<4>().0 {
                fours.iter_mut().zip(four).for_each(|(sum, lane)| *sum += f64::from(*lane));
            }
            *sum += (fours[0] + fours[1]) + (fours[2] + fours[3]);
        }
    }

    #[cfg(test)]
    pub(super) fn sums(&self) -> &[f64; 7] {
        &self.sums
    }

    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        self.count
    }
}
