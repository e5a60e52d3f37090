//! Random samples without replacement from a portable, seeded generator: from all observations, or the best ones first.

use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;

use super::problem::Problem;

/// Draws distinct indices; the same seed gives the same samples on every machine.
pub(super) struct Sampler<'a> {
    rng: ChaCha8Rng,
    len: usize,
    progress: Option<Progress<'a>>,
}

/// Where progressive sampling has got to: the growth of PROSAC's pool (Chum and Matas 2005, algorithm 1).
struct Progress<'a> {
    /// The best observations, the best first.
    order: &'a [u32],
    /// Samples drawn, `t`.
    drawn: u32,
    /// Size of the pool, `n`.
    pool: usize,
    /// How many observations there are, `N`.
    len: usize,
    /// `T_n` and its rounded sum `T'_n`.
    expected: f64,
    due: u64,
}

impl<'a> Sampler<'a> {
    /// Draws from all `len` observations alike.
    pub(super) fn uniform(seed: u64, len: usize) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), len, progress: None }
    }

    /// Draws from a pool that grows along `order`, which holds the best of `len` observations.
    pub(super) fn progressive(seed: u64, len: usize, order: &'a [u32], size: usize, uniform_after: u32) -> Self {
        // T_m = T_N prod (m - i) / (N - i), eq. 3.
        let share: f64 = (0..size).map(|i| (size - i) as f64 / (len - i) as f64).product();
        let expected = f64::from(uniform_after) * share;
        let progress = Progress { order, drawn: 0, pool: size, len, expected, due: 1 };
        Self { progress: Some(progress), ..Self::uniform(seed, len) }
    }

    /// Fills `sample` with distinct indices; `len` must not be smaller than the sample.
    pub(super) fn draw(&mut self, sample: &mut [usize]) {
        let Some(progress) = &mut self.progress else {
            return draw_below(&mut self.rng, self.len, sample);
        };
        let newest = progress.step(sample.len());
        if progress.pool > progress.order.len() {
            return draw_below(&mut self.rng, self.len, sample);
        }
        if newest {
            let [others @ .., last] = &mut *sample else { return };
            draw_below(&mut self.rng, progress.pool - 1, others);
            *last = progress.pool - 1;
        } else {
            draw_below(&mut self.rng, progress.pool, sample);
        }
        for place in sample {
            *place = progress.order[*place] as usize;
        }
    }
}

impl Progress<'_> {
    /// Counts a sample of `size` and grows the pool; whether the sample must hold the pool's last observation.
    fn step(&mut self, size: usize) -> bool {
        self.drawn += 1;
        if u64::from(self.drawn) == self.due && self.pool < self.len {
            // T_(n+1) = T_n (n + 1) / (n + 1 - m), eq. 4; T'_(n+1) = T'_n + ceil(T_(n+1) - T_n), eq. 5.
            let next = (self.pool + 1) as f64;
            let expected = self.expected * next / (next - size as f64);
            self.due += (expected - self.expected).ceil().max(1.0) as u64;
            self.expected = expected;
            self.pool += 1;
        }
        u64::from(self.drawn) <= self.due
    }
}

/// Fills `sample` with distinct indices below `len`.
fn draw_below(rng: &mut ChaCha8Rng, len: usize, sample: &mut [usize]) {
    for i in 0..sample.len() {
        loop {
            let index = ((u64::from(rng.next_u32()) * len as u64) >> 32) as usize;
            if !sample[..i].contains(&index) {
                sample[i] = index;
                break;
            }
        }
    }
}

/// Writes the `most` best observations by quality, the best first and the earlier first among equals.
pub(super) fn best_first<P: Problem>(problem: &P, most: usize, keys: &mut Vec<u64>, order: &mut Vec<u32>) {
    keys.clear();
    // The bits of numbers that are not negative grow with them.
    let descending = |quality: f32| u64::from(!quality.max(0.0).to_bits());
    keys.extend((0..problem.rows().len()).map(|index| (descending(problem.quality(index)) << 32) | index as u64));
    let most = most.min(keys.len());
    if most < keys.len() {
        keys.select_nth_unstable(most);
    }
    keys[..most].sort_unstable();
    order.clear();
    order.extend(keys[..most].iter().map(|key| *key as u32));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_distinct_in_range_and_reproducible() {
        let (mut a, mut b) = (Sampler::uniform(7, 5), Sampler::uniform(7, 5));
        for _ in 0..1000 {
            let (mut x, mut y) = ([0; 3], [0; 3]);
            a.draw(&mut x);
            b.draw(&mut y);
            assert_eq!(x, y);
            assert!(x[0] != x[1] && x[1] != x[2] && x[0] != x[2] && x.iter().all(|&i| i < 5));
        }
    }

    /// The pool of sample `t` is the smallest `n` with `T'_n >= t`, and the sample holds its last observation.
    #[test]
    fn progressive_samples_follow_the_growth_function() {
        let (len, size, limit) = (50, 3, 2000);
        let order: Vec<u32> = (0..len as u32).rev().collect();
        let mut sampler = Sampler::progressive(3, len, &order, size, limit);
        let chosen = |n: usize| (0..size).map(|i| (n - i) as f64 / (len - i) as f64).product::<f64>();
        let mut due = 1u64;
        let mut pools = vec![(size, 1u64)];
        for n in size..len {
            due += (f64::from(limit) * (chosen(n + 1) - chosen(n))).ceil().max(1.0) as u64;
            pools.push((n + 1, due));
        }
        for t in 1..=2000u64 {
            let mut sample = [0; 3];
            sampler.draw(&mut sample);
            let rank = sample.map(|index| len - 1 - index);
            assert!(rank[0] != rank[1] && rank[1] != rank[2] && rank[0] != rank[2]);
            let last = rank.into_iter().max().unwrap();
            // A sample drawn at the moment of growth already uses the larger pool.
            let pool = pools.iter().find(|(n, due)| *due > t || *n == len).unwrap().0;
            assert!(last + 1 == pool || (pool == len && t >= due), "trial {t}: {rank:?}, pool {pool}");
        }
    }
}
