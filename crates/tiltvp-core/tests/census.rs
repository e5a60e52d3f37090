//! Sampling with a census of the observations ends as without one: the same trials, model, inliers and reason.

#![allow(clippy::unwrap_used)]

use nalgebra::Vector3;
use proptest::prelude::{ProptestConfig, prop_assert_eq, proptest};
use tiltvp_core::robust::{Direction, Gate, Moments, Problem, RansacOptions, RansacScratch, Rows, Score, ransac};

/// Directions counted one after the other, each over all rows.
struct Plain<'a>(Direction<'a, f32>);

impl Problem for Plain<'_> {
    type Model = Vector3<f64>;
    type Summary = Moments;
    const SAMPLE_SIZE: usize = 2;

    fn len(&self) -> usize {
        self.0.len()
    }
    fn fit_minimal(&self, sample: &[usize]) -> Option<Self::Model> {
        self.0.fit_minimal(sample)
    }
    fn consensus(&self, model: &Self::Model, threshold: f64, _: usize) -> usize {
        self.0.consensus(model, threshold, 0)
    }
    fn consensus_among(&self, observations: &[u32], model: &Self::Model, threshold: f64) -> usize {
        self.0.consensus_among(observations, model, threshold)
    }
    fn support(&self, model: &Self::Model, threshold: f64, score: Score, _: f64) -> f64 {
        self.0.support(model, threshold, score, 0.0)
    }
    fn quality(&self, index: usize) -> f32 {
        self.0.quality(index)
    }
    fn summarise(&self, model: &Self::Model, gate: Gate, weights: &mut [f32]) -> Moments {
        self.0.summarise(model, gate, weights)
    }
    fn fit(&self, summary: &Moments, near: &Self::Model) -> Option<Self::Model> {
        self.0.fit(summary, near)
    }
    fn rms(&self, summary: &Moments, model: &Self::Model) -> f64 {
        self.0.rms(summary, model)
    }
    fn count(summary: &Moments) -> usize {
        <Direction<'_, f32> as Problem>::count(summary)
    }
    fn distance(&self, a: &Self::Model, b: &Self::Model) -> f64 {
        self.0.distance(a, b)
    }
}

/// A number in (0, 1) for each argument.
fn dice(seed: u64, i: u64) -> f64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ i.wrapping_mul(0xd1b5_4a32_d192_ed03);
    for _ in 0..3 {
        x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    ((x >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}

/// Normals, of which a share is orthogonal to one direction but for noise.
fn normals(seed: u64, len: u64, inliers: f64, noise: f64) -> Rows<f32> {
    let (lean_x, lean_y) = (0.3 * dice(seed, 1) - 0.15, 0.3 * dice(seed, 2) - 0.15);
    let mut rows = Rows::with_capacity(len as usize);
    for i in 1..=len {
        let (turn, chance) = (std::f64::consts::TAU * dice(seed, 8 * i + 3), dice(seed, 8 * i + 4));
        let own = dice(seed, 8 * i + 5) - 0.5;
        let upright = -(lean_x * turn.cos() + lean_y * turn.sin());
        let z = if chance < inliers { upright + noise * own } else { 0.8 * own };
        let row = Vector3::new(turn.cos(), turn.sin(), z).normalize();
        rows.push(row.x as f32, row.y as f32, row.z as f32);
    }
    rows
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn a_census_changes_nothing(seed in 0..u64::MAX, len in 4000..25_000u64, inliers in 0.0..0.4f64, wide in 0.2..3.0f64) {
        let rows = normals(seed, len, inliers, 0.02);
        let options = RansacOptions { seed, ..RansacOptions::with_threshold(0.01 * wide) };
        let fit = |weights: &mut [f32]| {
            ransac(&Direction::new(&rows), &options, &Vector3::z(), weights, &mut RansacScratch::default())
        };
        let plain = |weights: &mut [f32]| {
            ransac(&Plain(Direction::new(&rows)), &options, &Vector3::z(), weights, &mut RansacScratch::default())
        };
        let (mut ours, mut theirs) = (vec![1.0; rows.len()], vec![1.0; rows.len()]);
        prop_assert_eq!(fit(&mut ours), plain(&mut theirs));
        prop_assert_eq!(ours, theirs);
    }
}
