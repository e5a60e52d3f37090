//! Sums of gated rows by group, in one pass: what a covariance is made of when the rows of a group err together.

use super::kernel::kernel;
use super::simd::{Simd, TURNS, WIDTH};
use super::single::residual;

/// Most groups: a power of two, so that a number of a group is found by a mask.
pub const GROUPS: usize = 64;

/// Sums over the rows `(x, y)` with residuals `d` and gated weights `w`.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupSums {
    /// Of each group the information `w (xx, xy, yy)` and the score `w d (x, y)`.
    pub groups: [[f64; 5]; GROUPS],
    /// Of all groups `s (xx, xy, yy)` with the derivative `s` of `d w` by `d`.
    pub slopes: [f64; 3],
}

/// Sums of groups in single precision; the last three numbers of each are not used.
type Turns = [[[f32; 8]; GROUPS]; TURNS];

/// Sixteens that are worked on together: their terms, 2.5 KB, stay in the nearest cache. Only time depends on it.
const BLOCK: usize = 8;

/// The terms of sixteen rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terms {
    /// Information and first score of rows 0, 4, 8, 12, then of rows 1, 5, 9, 13, and so on.
    fours: [[[f32; 4]; TURNS]; TURNS],
    /// The second score, row by row.
    last: [f32; WIDTH],
}

/// # Safety
/// The machine must have the vectors.
#[inline(always)]
unsafe fn terms_body<L: Simd>(
    [x, y, z]: [&[f32]; 3],
    weights: &[f32],
    model: [f32; 3],
    inverse: f32,
    terms: &mut [Terms],
    slopes: &mut [[f32; WIDTH]; 3],
) {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let model = [L::splat(model[0]), L::splat(model[1]), L::splat(model[2])];
        let (inverse, one) = (L::splat(inverse), L::splat(1.0));
        let [xx, xy, yy] = slopes;
        let (mut sum_xx, mut sum_xy, mut sum_yy) = (L::load(xx), L::load(xy), L::load(yy));
        let ((x, _), (y, _), (z, _)) = (x.as_chunks(), y.as_chunks(), z.as_chunks());
        let (weights, _) = weights.as_chunks();
        for ((((x, y), z), own), terms) in x.iter().zip(y).zip(z).zip(weights).zip(terms) {
            let (x, y, own) = (L::load(x), L::load(y), L::load(own));
            let d = residual::<L, false>([x, y, L::load(z)], &model);
            let t = L::positive(L::sub(one, L::mul(L::mul(d, d), inverse)));
            let t2 = L::mul(t, t);
            let t4 = L::mul(t2, t2);
            let w = L::mul(own, L::mul(t4, t4));
            let steep = L::sub(L::mul(L::splat(17.0), t), L::splat(16.0));
            let s = L::mul(L::mul(own, L::mul(L::mul(t4, t2), t)), steep);
            let (wx, wy, sx, sy) = (L::mul(w, x), L::mul(w, y), L::mul(s, x), L::mul(s, y));
            sum_xx = L::add(sum_xx, L::mul(sx, x));
            sum_xy = L::add(sum_xy, L::mul(sx, y));
            sum_yy = L::add(sum_yy, L::mul(sy, y));
            L::store_fours([L::mul(wx, x), L::mul(wx, y), L::mul(wy, y), L::mul(wx, d)], &mut terms.fours);
            L::mul(wy, d).store(&mut terms.last);
        }
        sum_xx.store(xx);
        sum_xy.store(xy);
        sum_yy.store(yy);
    }
}

kernel! {
    /// Writes the terms of whole sixteens of rows with a soft gate, and adds them up with its slope instead. Columns and weights must
    /// be of one length, with terms for each sixteen.
    terms_of = terms_body(
        rows: [&[f32]; 3],
        weights: &[f32],
        model: [f32; 3],
        inverse: f32,
        terms: &mut [Terms],
        slopes: &mut [[f32; WIDTH]; 3],
    )
}

/// Some rows with their weights, the last sixteen filled up with rows without weight.
struct Block {
    columns: [[f32; WIDTH * BLOCK]; 3],
    weights: [f32; WIDTH * BLOCK],
}

impl Block {
    /// Takes every `stride`-th of `n` rows from a first one on. Weights are one where none are given.
    fn take(&mut self, columns: [&[f32]; 3], weights: Option<&[f32]>, (first, stride, n): (usize, usize, usize)) {
        let take = |from: &[f32], to: &mut [f32]| {
            let every = from[first..].iter().step_by(stride);
            to[..n].iter_mut().zip(every).for_each(|(to, from)| *to = *from);
        };
        for (column, to) in columns.into_iter().zip(&mut self.columns) {
            take(column, to);
        }
        match weights {
            Some(weights) => take(weights, &mut self.weights),
            None => self.weights[..n].fill(1.0),
        }
        self.weights[n..].fill(0.0);
    }
}

/// Sums over every `stride`-th row, with soft gates about a model: weights are multiplied by `max(0, 1 - d^2 inverse)^8`. They are
/// one where none are given. Row `i` is of the group `group_of[members[i]]`, the last one where there is none. Columns must be of
/// one length.
///
/// Single precision, partial sums of at most a few thousand rows, the same on every machine.
pub fn sums_by_group(
    columns: [&[f32]; 3],
    (model, inverse): ([f32; 3], f32),
    weights: Option<&[f32]>,
    stride: usize,
    (members, group_of): (&[u32], &[u8]),
) -> GroupSums {
    let (stride, len) = (stride.max(1), columns[0].len());
    let mut turns = [[[0.0; 8]; GROUPS]; TURNS];
    let mut slopes = [[0.0; WIDTH]; 3];
    let mut terms = [Terms { fours: [[[0.0; 4]; TURNS]; TURNS], last: [0.0; WIDTH] }; BLOCK];
    let one = [1.0; WIDTH * BLOCK];
    let mut block = Block { columns: [[0.0; WIDTH * BLOCK]; 3], weights: [0.0; WIDTH * BLOCK] };
    for first in (0..len).step_by(stride * WIDTH * BLOCK) {
        let n = (len - first).div_ceil(stride).min(WIDTH * BLOCK);
        let count = n.div_ceil(WIDTH);
        let whole = first..first + WIDTH * count;
        let terms = &mut terms[..count];
        if stride == 1 && n == WIDTH * count {
            let rows = columns.map(|column| &column[whole.clone()]);
            let weights = weights.map_or(&one[..n], |weights| &weights[whole]);
            terms_of(rows, weights, model, inverse, terms, &mut slopes);
        } else {
            block.take(columns, weights, (first, stride, n));
            let rows = block.columns.each_ref().map(|column| &column[..WIDTH * count]);
            terms_of(rows, &block.weights[..WIDTH * count], model, inverse, terms, &mut slopes);
        }
        for (k, terms) in terms.iter().enumerate() {
            let members = members.get(first + k * WIDTH * stride..).unwrap_or(&[]);
            match members.first_chunk::<WIDTH>() {
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
    for (sum, partial) in sums.slopes.iter_mut().zip(&slopes) {
        *sum = partial.iter().map(|part| f64::from(*part)).sum();
    }
    sums
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
    for k in 0..WIDTH / TURNS {
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

    /// Weight of a residual by the soft gate, and the derivative of the weighted residual.
    fn gated(d: f64, inverse: f64) -> (f64, f64) {
        let t = (1.0 - d * d * inverse).max(0.0);
        (t.powi(8), t.powi(7) * (17.0 * t - 16.0))
    }

    #[test]
    fn sums_are_those_of_a_plain_loop() {
        let inverse = 25.0;
        for (len, stride) in [(0, 1), (1, 1), (63, 1), (64, 1), (65, 1), (1000, 1), (1000, 3), (130, 2)] {
            let t: Vec<f32> = (0..len).map(|i| 0.37 * i as f32).collect();
            let column = |of: fn(f32) -> f32| t.iter().map(|t| of(*t)).collect::<Vec<f32>>();
            let (x, y, z) = (column(f32::cos), column(f32::sin), column(|t| 0.1 * (3.1 * t).sin()));
            let own: Vec<f32> = (0..len).map(|i| (i % 5) as f32).collect();
            let members: Vec<u32> = (0..len as u32).rev().collect();
            let group_of: Vec<u8> = (0..len).map(|i| (i * 7 % 61) as u8).collect();
            let model = [0.02f32, -0.03, 0.9];
            for weights in [None, Some(&own[..])] {
                let found =
                    sums_by_group([&x, &y, &z], (model, inverse as f32), weights, stride, (&members, &group_of));
                let mut groups = [[0.0; 5]; GROUPS];
                let mut slopes = [0.0; 3];
                for i in (0..len).step_by(stride) {
                    let [x, y, z] = [x[i], y[i], z[i]].map(f64::from);
                    let [h0, h1, h2] = model.map(f64::from);
                    let d = x * h0 + y * h1 + z * h2;
                    let own = weights.map_or(1.0, |weights| f64::from(weights[i]));
                    let (w, s) = gated(d, inverse);
                    let squares = [x * x, x * y, y * y];
                    let terms = [squares[0], squares[1], squares[2], x * d, y * d].map(|term| own * w * term);
                    let group = usize::from(group_of[members[i] as usize]);
                    groups[group].iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                    slopes.iter_mut().zip(squares).for_each(|(sum, square)| *sum += own * s * square);
                }
                let close = |a: f64, b: f64| (a - b).abs() < 1e-5 * (1.0 + len as f64);
                assert!(found.slopes.iter().zip(&slopes).all(|(a, b)| close(*a, *b)), "{len} {stride}");
                assert!(found.groups.as_flattened().iter().zip(groups.as_flattened()).all(|(a, b)| close(*a, *b)));
            }
        }
    }

    #[test]
    fn vectors_give_the_same_terms_as_single_numbers() {
        type Kernel<'a> = &'a dyn Fn(&mut [Terms], &mut [[f32; WIDTH]; 3]);
        let column: Vec<f32> = (0..WIDTH * BLOCK).map(|i| (i as f32 * 0.7).sin()).collect();
        let rows = [&column[..], &column[..], &column[..]];
        let with = |kernel: Kernel<'_>| {
            let mut terms = [Terms { fours: [[[0.0; 4]; TURNS]; TURNS], last: [0.0; WIDTH] }; BLOCK];
            let mut slopes = [[0.5; WIDTH]; 3];
            kernel(&mut terms, &mut slopes);
            let bits = |terms: &Terms| {
                let fours = terms.fours.as_flattened().as_flattened();
                fours.iter().chain(&terms.last).map(|x| x.to_bits()).collect::<Vec<u32>>()
            };
            (terms.iter().map(bits).collect::<Vec<_>>(), slopes.map(|slope| slope.map(f32::to_bits)))
        };
        let model = [0.1, -0.3, 0.7];
        // SAFETY: every machine has single numbers.
        let scalar = with(&|terms, slopes| unsafe { terms_of::scalar(rows, &column, model, 3.0, terms, slopes) });
        assert_eq!(with(&|terms, slopes| terms_of(rows, &column, model, 3.0, terms, slopes)), scalar);
        #[cfg(target_arch = "x86_64")]
        {
            // SAFETY: every x86-64 has them.
            let sse2 = with(&|terms, slopes| unsafe { terms_of::sse2(rows, &column, model, 3.0, terms, slopes) });
            assert_eq!(sse2, scalar);
        }
        #[cfg(target_arch = "x86_64")]
        if crate::level::Level::available().any(|level| level == crate::level::Level::Avx2) {
            // SAFETY: the machine has them.
            let avx2 = with(&|terms, slopes| unsafe { terms_of::avx2(rows, &column, model, 3.0, terms, slopes) });
            assert_eq!(avx2, scalar);
        }
    }
}
