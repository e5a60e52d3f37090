//! Sampling with upper bounds of the consensus ends as without them: the same trials, model, inliers and reason.

#![allow(clippy::unwrap_used)]

use nalgebra::Vector3;
use proptest::prelude::{ProptestConfig, prop_assert_eq, proptest};
use tiltvp_core::robust::{Direction, Moments, Problem, RansacOptions, RansacScratch, Rows, ransac};

/// Directions whose consensus is never bounded: none is as upright as it would have to be.
struct Unbounded<'a>(Direction<'a, f32>);

impl Problem for Unbounded<'_> {
    type Model = Vector3<f64>;
    type Number = f32;
    const SAMPLE_SIZE: usize = 2;
    const BOUNDED_H2_MIN: f64 = 2.0;

    fn rows(&self) -> &Rows<f32> {
        self.0.rows()
    }
    fn fit_minimal(&self, sample: &[usize]) -> Option<Self::Model> {
        self.0.fit_minimal(sample)
    }
    fn fit_weighted(&self, moments: &Moments) -> Option<Self::Model> {
        self.0.fit_weighted(moments)
    }
    fn coefficients(&self, model: &Self::Model) -> [f64; 3] {
        self.0.coefficients(model)
    }
    fn distance(&self, a: &Self::Model, b: &Self::Model) -> f64 {
        self.0.distance(a, b)
    }
}

/// A number in (0, 1) for each argument.
fn random(seed: u64, i: u64) -> f64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ i.wrapping_mul(0xd1b5_4a32_d192_ed03);
    for _ in 0..3 {
        x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    ((x >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}

/// Normals, of which a share is orthogonal to one direction but for noise.
fn normals(seed: u64, len: u64, inliers: f64, noise: f64) -> Rows<f32> {
    let (lean_x, lean_y) = (0.3 * random(seed, 1) - 0.15, 0.3 * random(seed, 2) - 0.15);
    let mut rows = Rows::with_capacity(len as usize);
    for i in 1..=len {
        let (turn, chance) = (std::f64::consts::TAU * random(seed, 8 * i + 3), random(seed, 8 * i + 4));
        let own = random(seed, 8 * i + 5) - 0.5;
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
    fn bounds_change_nothing(seed in 0..u64::MAX, len in 4000..25_000u64, inliers in 0.0..0.4f64, wide in 0.2..3.0f64) {
        let rows = normals(seed, len, inliers, 0.02);
        let options = RansacOptions { seed, ..RansacOptions::with_threshold(0.01 * wide) };
        let fit = |weights: &mut [f32]| {
            ransac(&Direction::new(&rows), &options, weights, &mut RansacScratch::default())
        };
        let unbounded = |weights: &mut [f32]| {
            ransac(&Unbounded(Direction::new(&rows)), &options, weights, &mut RansacScratch::default())
        };
        let (mut ours, mut theirs) = (vec![1.0; rows.len()], vec![1.0; rows.len()]);
        prop_assert_eq!(fit(&mut ours), unbounded(&mut theirs));
        prop_assert_eq!(ours, theirs);
    }
}
