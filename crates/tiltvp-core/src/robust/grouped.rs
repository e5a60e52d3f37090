//! Sums of gated rows by group, in one pass: what a covariance is made of when the rows of a group err together.

use multiversion::multiversion;

use super::loss::Gate;
use super::rows::Rows;

/// Most groups.
pub const GROUPS: usize = 64;

/// Sums over the rows `(x, y)` with residuals `d` and gated weights `w`.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupSums {
    /// Of each group the information `w (xx, xy, yy)` and the score `w d (x, y)`.
    pub groups: [[f64; 5]; GROUPS],
    /// Of all groups the information `(xx, xy, yy)` with [`Gate::slope`] instead of the gate.
    pub slopes: [f64; 3],
}

/// Groups are summed in so many turns, so that the rows of one need not wait for each other.
const TURNS: usize = 4;

/// Rows that are worked on together.
const BLOCK: usize = 64;

/// Lanes of the sums over all groups.
const LANES: usize = 16;

/// Partial sums.
struct Partial {
    /// Information and the first score, the second score.
    groups: [[([f32; 4], f32); GROUPS]; TURNS],
    slopes: [[f32; LANES]; 3],
}

impl Default for Partial {
    fn default() -> Self {
        Self { groups: [[([0.0; 4], 0.0); GROUPS]; TURNS], slopes: [[0.0; LANES]; 3] }
    }
}

impl Rows<f32> {
    /// Sums over every `stride`-th row, with soft gates about a model. Weights are one where none are given. Row `i` is of the
    /// group `group_of[members[i]]`, the first one where there is none.
    ///
    /// Single precision, partial sums of at most a few thousand rows, the same on every machine.
    pub fn sums_by_group(
        &self,
        model: [f64; 3],
        gate: Gate,
        weights: Option<&[f32]>,
        stride: usize,
        (members, group_of): (&[u32], &[u8]),
    ) -> GroupSums {
        let (stride, inverse) = (stride.max(1), gate.coefficients().1 as f32);
        let model = model.map(|h| h as f32);
        let columns = self.columns();
        let mut partial = Partial::default();
        let mut rows = Sample::default();
        for first in (0..self.len()).step_by(stride * BLOCK) {
            let n = (self.len() - first).div_ceil(stride).min(BLOCK);
            rows.take(columns, weights, first, stride, n);
            for i in 0..n {
                let member = members.get(first + i * stride).copied().unwrap_or(0);
                rows.groups[i] = group_of.get(member as usize).copied().unwrap_or(0) % GROUPS as u8;
            }
            add(&rows, model, inverse, &mut partial);
        }
        let mut sums = GroupSums { groups: [[0.0; 5]; GROUPS], slopes: [0.0; 3] };
        for turn in &partial.groups {
            for (sums, (quad, last)) in sums.groups.iter_mut().zip(turn) {
                for (sum, part) in sums.iter_mut().zip(quad.iter().chain([last])) {
                    *sum += f64::from(*part);
                }
            }
        }
        for (sum, lanes) in sums.slopes.iter_mut().zip(&partial.slopes) {
            *sum = lanes.iter().map(|lane| f64::from(*lane)).sum();
        }
        sums
    }
}

/// Some rows with their own weights, and their groups; weights beyond the last are zero.
struct Sample {
    x: [f32; BLOCK],
    y: [f32; BLOCK],
    z: [f32; BLOCK],
    own: [f32; BLOCK],
    groups: [u8; BLOCK],
}

impl Default for Sample {
    fn default() -> Self {
        let zero = [0.0; BLOCK];
        Self { x: zero, y: zero, z: zero, own: zero, groups: [0; BLOCK] }
    }
}

impl Sample {
    fn take(&mut self, [x, y, z]: [&[f32]; 3], weights: Option<&[f32]>, first: usize, stride: usize, n: usize) {
        let copy = |from: &[f32], to: &mut [f32; BLOCK]| {
            if stride == 1 {
                to[..n].copy_from_slice(&from[first..first + n]);
            } else {
                to.iter_mut().zip(from[first..].iter().step_by(stride)).for_each(|(to, from)| *to = *from);
            }
        };
        copy(x, &mut self.x);
        copy(y, &mut self.y);
        copy(z, &mut self.z);
        match weights {
            Some(weights) => copy(weights, &mut self.own),
            None => self.own = [1.0; BLOCK],
        }
        self.own[n..].fill(0.0);
    }
}

/// Adds a block.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn add(rows: &Sample, [h0, h1, h2]: [f32; 3], inverse: f32, partial: &mut Partial) {
    let Sample { x, y, z, own, groups } = rows;
    let mut terms = [[0.0f32; 4]; BLOCK];
    let mut last = [0.0f32; BLOCK];
    let [mut sx, mut sy, mut sxy] = [[0.0f32; BLOCK]; 3];
    for i in 0..BLOCK {
        let d = x[i] * h0 + y[i] * h1 + z[i] * h2;
        let t = 1.0 - d * d * inverse;
        let t = if t > 0.0 { t } else { 0.0 };
        let t2 = t * t;
        let t4 = t2 * t2;
        let w = own[i] * (t4 * t4);
        let s = own[i] * (t4 * t2 * t) * (17.0 * t - 16.0);
        let (wx, wy) = (w * x[i], w * y[i]);
        terms[i] = [wx * x[i], wx * y[i], wy * y[i], wx * d];
        last[i] = wy * d;
        (sx[i], sxy[i], sy[i]) = (s * x[i] * x[i], s * x[i] * y[i], s * y[i] * y[i]);
    }
    for (lanes, terms) in partial.slopes.iter_mut().zip([&sx, &sxy, &sy]) {
        for terms in terms.as_chunks::<LANES>().0 {
            for (lane, term) in lanes.iter_mut().zip(terms) {
                *lane += term;
            }
        }
    }
    for ((fours, last), groups) in
        terms.as_chunks::<TURNS>().0.iter().zip(last.as_chunks::<TURNS>().0).zip(groups.as_chunks::<TURNS>().0)
    {
        for i in 0..TURNS {
            let (quad, second) = &mut partial.groups[i][usize::from(groups[i]) % GROUPS];
            *quad = std::array::from_fn(|k| quad[k] + fours[i][k]);
            *second += last[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_a_plain_loop() {
        let gate = Gate::Soft { scale: 0.05 };
        for (len, stride) in [(0, 1), (1, 1), (63, 1), (64, 1), (65, 1), (1000, 1), (1000, 3), (130, 2)] {
            let mut rows = Rows::<f32>::default();
            for i in 0..len {
                let t = 0.37 * i as f32;
                rows.push(t.cos(), t.sin(), 0.1 * (3.1 * t).sin());
            }
            let own: Vec<f32> = (0..len).map(|i| (i % 5) as f32).collect();
            let members: Vec<u32> = (0..len as u32).rev().collect();
            let group_of: Vec<u8> = (0..len).map(|i| (i * 7 % 61) as u8).collect();
            let model = [0.02, -0.03, 0.9];
            for weights in [None, Some(&own[..])] {
                let found = rows.sums_by_group(model, gate, weights, stride, (&members, &group_of));
                let mut groups = [[0.0; 5]; GROUPS];
                let mut slopes = [0.0; 3];
                for i in (0..len).step_by(stride) {
                    let row = rows.get(i).unwrap();
                    let d = row.x * model[0] + row.y * model[1] + row.z * model[2];
                    let own = weights.map_or(1.0, |weights| f64::from(weights[i]));
                    let (w, s) = (own * gate.weight(d), own * gate.slope(d));
                    let squares = [row.x * row.x, row.x * row.y, row.y * row.y];
                    let terms = [w * squares[0], w * squares[1], w * squares[2], w * row.x * d, w * row.y * d];
                    let group = usize::from(group_of[members[i] as usize]);
                    groups[group].iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                    slopes.iter_mut().zip(squares).for_each(|(sum, square)| *sum += s * square);
                }
                let close = |a: f64, b: f64| (a - b).abs() < 1e-5 * (1.0 + len as f64);
                assert!(found.slopes.iter().zip(&slopes).all(|(a, b)| close(*a, *b)), "{len} {stride}");
                assert!(found.groups.as_flattened().iter().zip(groups.as_flattened()).all(|(a, b)| close(*a, *b)));
            }
        }
    }
}
