//! Sixteen numbers at a time: the one-pass kernels over rows of single precision, the same to the last bit with vectors of any
//! width.

use super::total::Total;
#[cfg(target_arch = "x86_64")]
use super::vectors::x86;
use super::vectors::{LANES, Lanes, Plain, TURNS};

/// The terms of sixteen rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terms {
    /// Information and first score of rows 0, 4, 8, 12, then of rows 1, 5, 9, 13, and so on.
    pub fours: [[[f32; 4]; TURNS]; TURNS],
    /// The second score, row by row.
    pub last: [f32; LANES],
}

/// Gates by what they do to a weight.
pub(super) const HARD: u8 = 0;
pub(super) const WITHIN: u8 = 1;
pub(super) const SOFT: u8 = 3;
/// A hard gate whose moments are those of the rows that it newly rejects.
pub(super) const REJECTED: u8 = 4;
/// No gate.
pub(super) const OPEN: u8 = 5;
/// Added to hard gates, their rejections and no gate: where weights are ones and zeros, no row is multiplied by one.
pub(super) const ONES: u8 = 8;

/// The last, partial sixteen of a column, filled up with `with`.
#[inline(always)]
fn rest(part: &[f32], with: f32) -> [f32; LANES] {
    let mut all = [with; LANES];
    all[..part.len()].copy_from_slice(part);
    all
}

/// `h . row`; `h2` is one where it is said to be.
#[inline(always)]
unsafe fn residual<L: Lanes, const ONE: bool>([x, y, z]: [L; 3], [h0, h1, h2]: &[L; 3]) -> L {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let upright = if ONE { z } else { L::mul(z, *h2) };
        L::add(L::add(L::mul(x, *h0), L::mul(y, *h1)), upright)
    }
}

/// How many of sixteen rows have a residual within reach.
#[inline(always)]
unsafe fn within<L: Lanes, const ONE: bool>([x, y, z]: [&[f32; LANES]; 3], model: &[L; 3], reach: L) -> u32 {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let d = residual::<L, ONE>([L::load(x), L::load(y), L::load(z)], model);
        L::count(L::at_most(L::abs(d), reach))
    }
}

/// Counts rows `(x, y, z)` with `|h . row| <= reach`.
#[inline(always)]
unsafe fn count_body<L: Lanes, const ONE: bool>([x, y, z]: [&[f32]; 3], model: [f32; 3], reach: f32) -> usize {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let (model, reach) = ([L::splat(model[0]), L::splat(model[1]), L::splat(model[2])], L::splat(reach));
        let ((x, last_x), (y, last_y), (z, last_z)) = (x.as_chunks(), y.as_chunks(), z.as_chunks());
        let mut count = 0;
        for ((x, y), z) in x.iter().zip(y).zip(z) {
            count += within::<L, ONE>([x, y, z], &model, reach);
        }
        if !last_x.is_empty() {
            // No number is at most anything if it is none.
            let rows = [&rest(last_x, f32::NAN), &rest(last_y, 0.0), &rest(last_z, 0.0)];
            count += within::<L, ONE>(rows, &model, reach);
        }
        count as usize
    }
}

/// The sums of a block, lane by lane.
struct Sums<L> {
    sums: [L; 7],
    count: u32,
}

impl<L: Lanes> Sums<L> {
    /// Weighs sixteen rows by a gate.
    #[inline(always)]
    unsafe fn row<const GATE: u8>(
        &mut self,
        [x, y, z]: [&[f32; LANES]; 3],
        weights: &mut [f32; LANES],
        model: &[L; 3],
        gains: &[L; 2],
    ) {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            let (x, y, z, own) = (L::load(x), L::load(y), L::load(z), L::load(weights));
            let d = residual::<L, false>([x, y, z], model);
            let w = if GATE == OPEN {
                own
            } else if GATE == SOFT {
                let t = L::positive(L::sub(L::splat(1.0), L::mul(L::mul(d, d), gains[1])));
                let t = L::mul(t, t);
                let t = L::mul(t, t);
                L::mul(own, L::mul(t, t))
            } else {
                L::keep(own, L::at_most(L::abs(d), gains[0]))
            };
            if GATE == HARD || GATE == REJECTED {
                // No branch: most sixteens have one that is rejected, at first.
                w.store(weights);
            }
            let w = if GATE == REJECTED { L::sub(own, w) } else { w };
            self.add(w, [x, y, d]);
        }
    }

    /// The same where weights are ones and zeros, and `h2` is one if it is said to be.
    #[inline(always)]
    unsafe fn ones<const GATE: u8, const ONE: bool>(
        &mut self,
        [x, y, z]: [&[f32; LANES]; 3],
        weights: &mut [f32; LANES],
        model: &[L; 3],
        reach: L,
    ) {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            let (x, y, z, own) = (L::load(x), L::load(y), L::load(z), L::load(weights));
            let d = residual::<L, ONE>([x, y, z], model);
            let held = L::below(L::splat(0.0), own);
            let far = L::beyond_of(held, L::abs(d), reach);
            if GATE != OPEN {
                L::clear(weights, far);
            }
            let summed = match GATE {
                OPEN => held,
                REJECTED => far,
                _ => L::at_most_of(held, L::abs(d), reach),
            };
            self.count += L::count(summed);
            self.add_products(L::keep(x, summed), L::keep(y, summed), L::keep(d, summed), [x, y, d]);
        }
    }

    /// Adds weighted rows.
    #[inline(always)]
    unsafe fn add(&mut self, w: L, [x, y, d]: [L; 3]) {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            self.count += L::count(L::below(L::splat(0.0), w));
            self.sums[0] = L::add(self.sums[0], w);
            self.add_products(L::mul(w, x), L::mul(w, y), L::mul(w, d), [x, y, d]);
        }
    }

    #[inline(always)]
    unsafe fn add_products(&mut self, wx: L, wy: L, wd: L, [x, y, d]: [L; 3]) {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            let [_, xx, xy, yy, xd, yd, dd] = &mut self.sums;
            // Written out: a loop would keep the sums in memory.
            *xx = L::add(*xx, L::mul(wx, x));
            *xy = L::add(*xy, L::mul(wx, y));
            *yy = L::add(*yy, L::mul(wy, y));
            *xd = L::add(*xd, L::mul(wx, d));
            *yd = L::add(*yd, L::mul(wy, d));
            *dd = L::add(*dd, L::mul(wd, d));
        }
    }
}

/// Adds the moments of a block of rows to the total, and sets the weights that a hard gate rejects to zero.
#[inline(always)]
unsafe fn gather_body<L: Lanes, const GATE: u8, const ONLY_ONES: bool, const ONE: bool>(
    [x, y, z]: [&[f32]; 3],
    weights: &mut [f32],
    model: [f32; 3],
    gains: [f32; 2],
    total: &mut Total,
) {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let model = [L::splat(model[0]), L::splat(model[1]), L::splat(model[2])];
        let gains = [L::splat(gains[0]), L::splat(gains[1])];
        let mut sums = Sums { sums: [L::splat(0.0); 7], count: 0 };
        let ((x, last_x), (y, last_y), (z, last_z)) = (x.as_chunks(), y.as_chunks(), z.as_chunks());
        let (own, last_own) = weights.as_chunks_mut();
        for (((x, y), z), own) in x.iter().zip(y).zip(z).zip(own) {
            if ONLY_ONES {
                sums.ones::<GATE, ONE>([x, y, z], own, &model, gains[0]);
            } else {
                sums.row::<GATE>([x, y, z], own, &model, &gains);
            }
        }
        if !last_own.is_empty() {
            let n = last_own.len();
            let mut own = rest(last_own, 0.0);
            let rows = [&rest(last_x, 0.0), &rest(last_y, 0.0), &rest(last_z, 0.0)];
            if ONLY_ONES {
                sums.ones::<GATE, ONE>(rows, &mut own, &model, gains[0]);
            } else {
                sums.row::<GATE>(rows, &mut own, &model, &gains);
            }
            last_own.copy_from_slice(&own[..n]);
        }
        let mut lanes = [[0.0; LANES]; 7];
        for (lanes, sum) in lanes.iter_mut().zip(sums.sums) {
            sum.store(lanes);
        }
        if ONLY_ONES {
            lanes[0][0] = sums.count as f32;
        }
        total.add(sums.count as usize, &lanes);
    }
}

/// The terms of whole sixteens of rows with a soft gate, and their sums with its slope, lane by lane.
#[inline(always)]
unsafe fn terms_body<L: Lanes>(
    [x, y, z]: [&[f32]; 3],
    weights: &[f32],
    model: [f32; 3],
    gains: [f32; 2],
    terms: &mut [Terms],
    slopes: &mut [[f32; LANES]; 3],
) {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let model = [L::splat(model[0]), L::splat(model[1]), L::splat(model[2])];
        let (inverse, one) = (L::splat(gains[0]), L::splat(1.0));
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

/// The kernels of one implementation, compiled for the machines that have its vectors.
macro_rules! kernels {
    ($module:ident, $lanes:ty $(, $features:literal)?) => {
        pub(super) mod $module {
            use super::{
                HARD, LANES, ONES, OPEN, REJECTED, SOFT, Terms, Total, WITHIN, count_body, gather_body, terms_body,
            };

            /// # Safety
            /// The machine must have the vectors.
            $(#[target_feature(enable = $features)])?
            pub(in super::super) unsafe fn count(rows: [&[f32]; 3], model: [f32; 3], reach: f32) -> usize {
                // SAFETY: the caller vouches for the machine.
                unsafe {
                    if model[2] == 1.0 {
                        count_body::<$lanes, true>(rows, model, reach)
                    } else {
                        count_body::<$lanes, false>(rows, model, reach)
                    }
                }
            }

            /// # Safety
            /// The machine must have the vectors.
            $(#[target_feature(enable = $features)])?
            pub(in super::super) unsafe fn terms(
                rows: [&[f32]; 3],
                weights: &[f32],
                model: [f32; 3],
                gains: [f32; 2],
                terms: &mut [Terms],
                slopes: &mut [[f32; LANES]; 3],
            ) {
                // SAFETY: the caller vouches for the machine.
                unsafe { terms_body::<$lanes>(rows, weights, model, gains, terms, slopes) }
            }

            /// # Safety
            /// The machine must have the vectors.
            $(#[target_feature(enable = $features)])?
            pub(in super::super) unsafe fn gather(
                rows: [&[f32]; 3],
                weights: &mut [f32],
                model: [f32; 3],
                gains: [f32; 2],
                gate: u8,
                total: &mut Total,
            ) {
                // SAFETY: the caller vouches for the machine.
                unsafe {
                    const ONLY_HARD: u8 = ONES + HARD;
                    const ONLY_REJECTED: u8 = ONES + REJECTED;
                    const ONLY_OPEN: u8 = ONES + OPEN;
                    // Called by name, so that they are compiled for these vectors.
                    macro_rules! kernel {
                        ($gate:ident, $ones:literal, $one:literal) => {
                            gather_body::<$lanes, $gate, $ones, $one>(rows, weights, model, gains, total)
                        };
                    }
                    match (gate, model[2] == 1.0) {
                        (HARD, _) => kernel!(HARD, false, false),
                        (REJECTED, _) => kernel!(REJECTED, false, false),
                        (WITHIN, _) => kernel!(WITHIN, false, false),
                        (OPEN, _) => kernel!(OPEN, false, false),
                        (ONLY_HARD, true) => kernel!(HARD, true, true),
                        (ONLY_HARD, false) => kernel!(HARD, true, false),
                        (ONLY_REJECTED, true) => kernel!(REJECTED, true, true),
                        (ONLY_REJECTED, false) => kernel!(REJECTED, true, false),
                        (ONLY_OPEN, true) => kernel!(OPEN, true, true),
                        (ONLY_OPEN, false) => kernel!(OPEN, true, false),
                        _ => kernel!(SOFT, false, false),
                    }
                }
            }
        }
    };
}

kernels!(plain, super::Plain);
#[cfg(target_arch = "x86_64")]
kernels!(avx2, super::x86::Pair, "avx2,popcnt");
#[cfg(target_arch = "x86_64")]
kernels!(avx512, super::x86::Wide, "avx512f,popcnt");

/// Calls a kernel with the widest vectors of this machine.
macro_rules! dispatch {
    ($kernel:ident($($argument:expr),*)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("popcnt") {
                // SAFETY: the machine has them.
                return unsafe { avx512::$kernel($($argument),*) };
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt") {
                // SAFETY: the machine has them.
                return unsafe { avx2::$kernel($($argument),*) };
            }
        }
        // SAFETY: every machine has single numbers.
        unsafe { plain::$kernel($($argument),*) }
    }};
}

/// Counts rows `(x, y, z)` with `|h . row| <= reach`; columns must be of one length.
pub(super) fn count(rows: [&[f32]; 3], model: [f32; 3], reach: f32) -> usize {
    dispatch!(count(rows, model, reach))
}

/// Writes the terms of whole sixteens of rows with a soft gate, whose inverse squared reach is the first of the gains, and adds
/// them up with its slope instead. Columns and weights must be of one length, with terms for each sixteen.
pub(super) fn terms(
    rows: [&[f32]; 3],
    weights: &[f32],
    model: [f32; 3],
    gains: [f32; 2],
    terms: &mut [Terms],
    slopes: &mut [[f32; LANES]; 3],
) {
    dispatch!(terms(rows, weights, model, gains, terms, slopes));
}

/// Adds the moments of a block of rows to the total, weighted and gated: `gains` are the reach of a hard gate and the
/// inverse squared reach of a soft one. Columns and weights must be of one length.
pub(super) fn gather(
    rows: [&[f32]; 3],
    weights: &mut [f32],
    model: [f32; 3],
    gains: [f32; 2],
    gate: u8,
    total: &mut Total,
) {
    dispatch!(gather(rows, weights, model, gains, gate, total));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of a block as bits, its count, and the weights that it leaves.
    fn moments(
        kernel: impl Fn([&[f32]; 3], &mut [f32], &mut Total),
        n: usize,
        weight: fn(usize) -> f32,
    ) -> (Vec<u64>, usize, Vec<u32>) {
        let column = |k: usize| -> Vec<f32> {
            (0..n).map(|i| ((i * (3 + k) + 7 * k) as f32 * 0.37).sin() * if k == 2 { 0.1 } else { 1.0 }).collect()
        };
        let (x, y, z) = (column(0), column(1), column(2));
        let mut weights: Vec<f32> = (0..n).map(weight).collect();
        let mut total = Total::default();
        kernel([&x, &y, &z], &mut weights, &mut total);
        let bits = total.sums().iter().map(|sum| sum.to_bits()).collect();
        (bits, total.count(), weights.iter().map(|w| w.to_bits()).collect())
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn vectors_of_any_width_give_the_same_bits() {
        let (gates, gains) = ([HARD, WITHIN, SOFT, REJECTED, OPEN], [0.1, 90.0]);
        let each = |gate: &u8| [(*gate, [0.02, -0.03, 0.9]), (*gate, [0.02, -0.03, 1.0])];
        let any: fn(usize) -> f32 = |i| (i % 7) as f32 * 0.3;
        let ones: fn(usize) -> f32 = |i| (i % 3).min(1) as f32;
        for n in (0..70).chain([511, 512, 2048]) {
            for (gate, model) in gates.iter().flat_map(each) {
                for (gate, weight) in [(gate, any), (gate, ones), (ONES + gate, ones)] {
                    if gate > ONES && [WITHIN, SOFT].contains(&(gate - ONES)) {
                        continue;
                    }
                    // SAFETY: every machine has single numbers.
                    let plain = moments(|r, w, t| unsafe { plain::gather(r, w, model, gains, gate, t) }, n, weight);
                    if gate > ONES {
                        let gate = gate - ONES;
                        // SAFETY: every machine has single numbers.
                        let found = moments(|r, w, t| unsafe { plain::gather(r, w, model, gains, gate, t) }, n, weight);
                        assert_eq!(found, plain, "{n} rows, gate {gate}");
                    }
                    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt") {
                        // SAFETY: the machine has them.
                        let found = moments(|r, w, t| unsafe { avx2::gather(r, w, model, gains, gate, t) }, n, weight);
                        assert_eq!(found, plain, "{n} rows, gate {gate}");
                    }
                    if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("popcnt") {
                        // SAFETY: the machine has them.
                        let found =
                            moments(|r, w, t| unsafe { avx512::gather(r, w, model, gains, gate, t) }, n, weight);
                        assert_eq!(found, plain, "{n} rows, gate {gate}");
                    }
                }
            }
            let model = [0.02, -0.03, 0.9];
            let rows: Vec<f32> = (0..n).map(|i| (i as f32 * 0.7).sin()).collect();
            let rows = [&rows[..]; 3];
            // SAFETY: every machine has single numbers.
            let plain = unsafe { plain::count(rows, model, 0.3) };
            assert_eq!(count(rows, model, 0.3), plain);
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt") {
                // SAFETY: the machine has them.
                assert_eq!(unsafe { avx2::count(rows, model, 0.3) }, plain);
            }
        }
    }
}
