//! Sums of gated rows by group, in one pass: what a covariance is made of when the rows of a group err together.

use super::lanes::{self, Terms};
use super::loss::Gate;
use super::rows::Rows;
use super::vectors::{LANES, TURNS};

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

/// Sums of groups in single precision; the last three numbers of each are not used.
pub(super) type Turns = [[[f32; 8]; GROUPS]; TURNS];

/// Sixteens that are worked on together.
const BLOCK: usize = 8;

impl Rows<f32> {
    /// Sums over every `stride`-th row, with soft gates about a model. Weights are one where none are given. Row `i` is of the
    /// group `group_of[members[i]]`, the last one where there is none.
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
        let stride = stride.max(1);
        let gains = [gate.coefficients().1 as f32, 0.0];
        let model = model.map(|h| h as f32);
        let mut turns = [[[0.0; 8]; GROUPS]; TURNS];
        let mut slopes = [[0.0; LANES]; 3];
        let mut terms = [Terms { fours: [[[0.0; 4]; TURNS]; TURNS], last: [0.0; LANES] }; BLOCK];
        let (zero, one) = ([0.0; LANES * BLOCK], [1.0; LANES * BLOCK]);
        let [mut x, mut y, mut z, mut own] = [zero; 4];
        for first in (0..self.len()).step_by(stride * LANES * BLOCK) {
            let n = (self.len() - first).div_ceil(stride).min(LANES * BLOCK);
            let count = n.div_ceil(LANES);
            let whole = first..first + LANES * count;
            let direct = stride == 1 && n == LANES * count;
            if direct {
                let rows = self.columns().map(|column| &column[whole.clone()]);
                let weights = weights.map_or(&one[..n], |weights| &weights[whole]);
                lanes::terms(rows, weights, model, gains, &mut terms[..count], &mut slopes);
            } else {
                let take = |from: &[f32], to: &mut [f32]| {
                    let every = from[first..].iter().step_by(stride);
                    to.iter_mut().zip(every).for_each(|(to, from)| *to = *from);
                };
                for (column, to) in self.columns().into_iter().zip([&mut x, &mut y, &mut z]) {
                    take(column, &mut to[..n]);
                }
                match weights {
                    Some(weights) => take(weights, &mut own[..n]),
                    None => own[..n].fill(1.0),
                }
                own[n..].fill(0.0);
                let end = LANES * count;
                lanes::terms(
                    [&x[..end], &y[..end], &z[..end]],
                    &own[..end],
                    model,
                    gains,
                    &mut terms[..count],
                    &mut slopes,
                );
            }
            for (k, terms) in terms[..count].iter().enumerate() {
                let members = members.get(first + k * LANES * stride..).unwrap_or(&[]);
                match members.first_chunk::<LANES>() {
                    Some(members) if stride == 1 => add(&mut turns, terms, |row| group(group_of, members[row])),
                    _ => {
                        // Rows beyond the last have no weight, whatever their group.
                        let of = |row: usize| members.get(row * stride).map_or(0, |member| group(group_of, *member));
                        add(&mut turns, terms, of);
                    }
                }
            }
        }
        let mut sums = GroupSums { groups: [[0.0; 5]; GROUPS], slopes: [0.0; 3] };
        for turn in &turns {
            for (sums, parts) in sums.groups.iter_mut().zip(turn) {
                sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += f64::from(*part));
            }
        }
        for (sum, lanes) in sums.slopes.iter_mut().zip(&slopes) {
            *sum = lanes.iter().map(|lane| f64::from(*lane)).sum();
        }
        sums
    }
}

/// The group of a member, that of the last one for those beyond, the first where there are none.
#[inline(always)]
fn group(group_of: &[u8], member: u32) -> usize {
    let last = group_of.len().wrapping_sub(1);
    group_of.get((member as usize).min(last)).map_or(0, |group| usize::from(*group) % GROUPS)
}

/// Adds the terms of sixteen rows to those of their groups.
#[inline(always)]
fn add(turns: &mut Turns, terms: &Terms, group: impl Fn(usize) -> usize) {
    for k in 0..LANES / TURNS {
        for (j, turn) in turns.iter_mut().enumerate() {
            let sums = &mut turn[group(TURNS * k + j)];
            let four = &terms.fours[j][k];
            let [a, b, c, d, e, ..] = *sums;
            let quad = [a + four[0], b + four[1], c + four[2], d + four[3]];
            sums[..4].copy_from_slice(&quad);
            sums[4] = e + terms.last[TURNS * k + j];
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
