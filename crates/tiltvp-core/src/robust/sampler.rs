//! Random samples without replacement from a portable, seeded generator.

use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;

/// Draws distinct indices below `len`; the same seed gives the same samples on every machine.
pub(super) struct Sampler {
    generator: ChaCha8Rng,
    len: u64,
}

impl Sampler {
    pub(super) fn new(seed: u64, len: usize) -> Self {
        Self { generator: ChaCha8Rng::seed_from_u64(seed), len: len as u64 }
    }

    /// Fills `sample` with distinct indices; `len` must not be smaller than the sample.
    pub(super) fn draw(&mut self, sample: &mut [usize]) {
        for i in 0..sample.len() {
            loop {
                let index = ((u64::from(self.generator.next_u32()) * self.len) >> 32) as usize;
                if !sample[..i].contains(&index) {
                    sample[i] = index;
                    break;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_distinct_in_range_and_reproducible() {
        let (mut a, mut b) = (Sampler::new(7, 5), Sampler::new(7, 5));
        for _ in 0..1000 {
            let (mut x, mut y) = ([0; 3], [0; 3]);
            a.draw(&mut x);
            b.draw(&mut y);
            assert_eq!(x, y);
            assert!(x[0] != x[1] && x[1] != x[2] && x[0] != x[2] && x.iter().all(|&i| i < 5));
        }
    }
}
