//! Rows in single precision, sixteen at a time: counting, and sums of gated products, the same to the last bit with vectors of any
//! width.

use super::kernel::kernel;
use super::simd::{Simd, WIDTH};
use super::{Gate, HARD, OPEN, REJECTED, SOFT, Sums, WITHIN, Weights};

/// The last, partial sixteen of a column, filled up with `with`.
#[inline(always)]
fn rest(part: &[f32], with: f32) -> [f32; WIDTH] {
    let mut all = [with; WIDTH];
    all[..part.len()].copy_from_slice(part);
    all
}

/// `h . row`; `h2` is one where it is said to be.
///
/// # Safety
/// The machine must have the vectors.
#[inline(always)]
pub(super) unsafe fn residual<L: Simd, const ONE: bool>([x, y, z]: [L; 3], [h0, h1, h2]: &[L; 3]) -> L {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let upright = if ONE { z } else { L::mul(z, *h2) };
        L::add(L::add(L::mul(x, *h0), L::mul(y, *h1)), upright)
    }
}

/// How many of sixteen rows have a residual within reach.
#[inline(always)]
unsafe fn within<L: Simd, const ONE: bool>([x, y, z]: [&[f32; WIDTH]; 3], model: &[L; 3], reach: L) -> u32 {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let d = residual::<L, ONE>([L::load(x), L::load(y), L::load(z)], model);
        L::count(L::at_most(L::abs(d), reach))
    }
}

/// # Safety
/// The machine must have the vectors.
#[inline(always)]
unsafe fn count_with<L: Simd, const ONE: bool>([x, y, z]: [&[f32]; 3], model: [f32; 3], reach: f32) -> usize {
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

/// # Safety
/// The machine must have the vectors.
#[inline(always)]
unsafe fn count_body<L: Simd>(rows: [&[f32]; 3], model: [f32; 3], reach: f32) -> usize {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        if model[2] == 1.0 {
            count_with::<L, true>(rows, model, reach)
        } else {
            count_with::<L, false>(rows, model, reach)
        }
    }
}

kernel! {
    /// Counts rows with `|d| <= reach`; columns must be of one length.
    count = count_body(rows: [&[f32]; 3], model: [f32; 3], reach: f32) -> usize
}

/// The sums of a block, in partial sums.
struct Partial<L> {
    sums: [L; 7],
    count: u32,
}

impl<L: Simd> Partial<L> {
    /// Weighs sixteen rows by a gate.
    #[inline(always)]
    unsafe fn row<const GATE: u8>(
        &mut self,
        [x, y, z]: [&[f32; WIDTH]; 3],
        weights: &mut [f32; WIDTH],
        model: &[L; 3],
        limit: L,
    ) {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            let (x, y, z, own) = (L::load(x), L::load(y), L::load(z), L::load(weights));
            let d = residual::<L, false>([x, y, z], model);
            let w = if GATE == OPEN {
                own
            } else if GATE == SOFT {
                let t = L::positive(L::sub(L::splat(1.0), L::mul(L::mul(d, d), limit)));
                let t = L::mul(t, t);
                let t = L::mul(t, t);
                L::mul(own, L::mul(t, t))
            } else {
                L::keep(own, L::at_most(L::abs(d), limit))
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
        [x, y, z]: [&[f32; WIDTH]; 3],
        weights: &mut [f32; WIDTH],
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

/// Adds a block of rows to the sums and applies a gate to their weights; `limit` is the number of the gate.
///
/// # Safety
/// The machine must have the vectors.
#[inline(always)]
unsafe fn accumulate_with<L: Simd, const GATE: u8, const UNIT: bool, const ONE: bool>(
    [x, y, z]: [&[f32]; 3],
    weights: &mut [f32],
    model: [f32; 3],
    limit: f32,
    sums: &mut Sums,
) {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let model = [L::splat(model[0]), L::splat(model[1]), L::splat(model[2])];
        let limit = L::splat(limit);
        let mut block = Partial { sums: [L::splat(0.0); 7], count: 0 };
        let ((x, last_x), (y, last_y), (z, last_z)) = (x.as_chunks(), y.as_chunks(), z.as_chunks());
        let (own, last_own) = weights.as_chunks_mut();
        for (((x, y), z), own) in x.iter().zip(y).zip(z).zip(own) {
            if UNIT {
                block.ones::<GATE, ONE>([x, y, z], own, &model, limit);
            } else {
                block.row::<GATE>([x, y, z], own, &model, limit);
            }
        }
        if !last_own.is_empty() {
            let n = last_own.len();
            let mut own = rest(last_own, 0.0);
            let rows = [&rest(last_x, 0.0), &rest(last_y, 0.0), &rest(last_z, 0.0)];
            if UNIT {
                block.ones::<GATE, ONE>(rows, &mut own, &model, limit);
            } else {
                block.row::<GATE>(rows, &mut own, &model, limit);
            }
            last_own.copy_from_slice(&own[..n]);
        }
        let mut partial = [[0.0; WIDTH]; 7];
        for (partial, sum) in partial.iter_mut().zip(block.sums) {
            sum.store(partial);
        }
        if UNIT {
            partial[0][0] = block.count as f32;
        }
        sums.add(block.count as usize, &partial);
    }
}

/// # Safety
/// The machine must have the vectors.
#[inline(always)]
unsafe fn accumulate_body<L: Simd>(
    rows: [&[f32]; 3],
    (weights, kind): (&mut [f32], Weights),
    model: [f32; 3],
    gate: Gate<f32>,
    sums: &mut Sums,
) {
    let (unit, one) = (kind == Weights::Unit, model[2] == 1.0);
    // A macro, and no closure: that would be compiled for plain machines.
    macro_rules! with {
        ($gate:ident, $unit:literal, $one:literal, $limit:expr) => {
            // SAFETY: the caller vouches for the machine.
            unsafe { accumulate_with::<L, $gate, $unit, $one>(rows, weights, model, $limit, sums) }
        };
    }
    match (gate, unit, one) {
        (Gate::Open, true, true) => with!(OPEN, true, true, f32::INFINITY),
        (Gate::Open, true, false) => with!(OPEN, true, false, f32::INFINITY),
        (Gate::Open, false, _) => with!(OPEN, false, false, f32::INFINITY),
        (Gate::Hard { reach }, true, true) => with!(HARD, true, true, reach),
        (Gate::Hard { reach }, true, false) => with!(HARD, true, false, reach),
        (Gate::Hard { reach }, false, _) => with!(HARD, false, false, reach),
        (Gate::Rejected { reach }, true, true) => with!(REJECTED, true, true, reach),
        (Gate::Rejected { reach }, true, false) => with!(REJECTED, true, false, reach),
        (Gate::Rejected { reach }, false, _) => with!(REJECTED, false, false, reach),
        (Gate::Within { reach }, ..) => with!(WITHIN, false, false, reach),
        (Gate::Soft { inverse }, ..) => with!(SOFT, false, false, inverse),
    }
}

kernel! {
    /// Adds a block of rows to the sums and applies the gate to their weights; columns and weights must be of one length.
    accumulate = accumulate_body(
        rows: [&[f32]; 3],
        weights: (&mut [f32], Weights),
        model: [f32; 3],
        gate: Gate<f32>,
        sums: &mut Sums,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of a block as bits, its count, and the weights that it leaves.
    type Found = ([u64; 7], usize, Vec<u32>);

    fn found(kernel: impl FnOnce([&[f32]; 3], &mut [f32], &mut Sums), n: usize, weight: fn(usize) -> f32) -> Found {
        let column = |k: usize| -> Vec<f32> {
            (0..n).map(|i| ((i * (3 + k) + 7 * k) as f32 * 0.37).sin() * if k == 2 { 0.1 } else { 1.0 }).collect()
        };
        let mut weights: Vec<f32> = (0..n).map(weight).collect();
        let mut sums = Sums::default();
        kernel([&column(0), &column(1), &column(2)], &mut weights, &mut sums);
        (sums.sums.map(f64::to_bits), sums.count, weights.iter().map(|w| w.to_bits()).collect())
    }

    /// Every gate with vectors of any width, and of unit weights the kernel for any.
    #[test]
    fn vectors_give_the_same_bits_as_single_numbers() {
        let gates = [
            Gate::Open,
            Gate::Hard { reach: 0.1 },
            Gate::Rejected { reach: 0.1 },
            Gate::Within { reach: 0.1 },
            Gate::Soft { inverse: 90.0 },
        ];
        let any: fn(usize) -> f32 = |i| (i % 7) as f32 * 0.3;
        let ones: fn(usize) -> f32 = |i| (i % 3).min(1) as f32;
        for n in (0..70).chain([511, 512, 2048]) {
            for gate in gates {
                for model in [[0.02, -0.03, 0.9], [0.02, -0.03, 1.0]] {
                    for (kind, weight) in [(Weights::Any, any), (Weights::Any, ones), (Weights::Unit, ones)] {
                        // SAFETY: every machine has single numbers.
                        let with = |r: [&[f32]; 3], w: &mut [f32], s: &mut Sums| unsafe {
                            accumulate::scalar(r, (w, Weights::Any), model, gate, s);
                        };
                        let scalar = found(with, n, weight);
                        // SAFETY: every machine has single numbers.
                        let with = |r: [&[f32]; 3], w: &mut [f32], s: &mut Sums| unsafe {
                            accumulate::scalar(r, (w, kind), model, gate, s);
                        };
                        assert_eq!(found(with, n, weight), scalar, "{n} rows, {gate:?}, {kind:?}");
                        let with =
                            |r: [&[f32]; 3], w: &mut [f32], s: &mut Sums| accumulate(r, (w, kind), model, gate, s);
                        assert_eq!(found(with, n, weight), scalar, "{n} rows, {gate:?}, {kind:?}");
                        #[cfg(target_arch = "x86_64")]
                        {
                            // SAFETY: every x86-64 has them.
                            let with = |r: [&[f32]; 3], w: &mut [f32], s: &mut Sums| unsafe {
                                accumulate::sse2(r, (w, kind), model, gate, s);
                            };
                            assert_eq!(found(with, n, weight), scalar, "{n} rows, {gate:?}, {kind:?}");
                        }
                        #[cfg(target_arch = "x86_64")]
                        if crate::level::Level::available().any(|level| level == crate::level::Level::Avx2) {
                            // SAFETY: the machine has them.
                            let with = |r: [&[f32]; 3], w: &mut [f32], s: &mut Sums| unsafe {
                                accumulate::avx2(r, (w, kind), model, gate, s);
                            };
                            assert_eq!(found(with, n, weight), scalar, "{n} rows, {gate:?}, {kind:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn vectors_count_as_single_numbers_do() {
        for n in (0..70).chain([511, 512, 2048]) {
            let column: Vec<f32> = (0..n).map(|i| (i as f32 * 0.7).sin()).collect();
            let rows = [&column[..]; 3];
            for model in [[0.02, -0.03, 0.9], [0.02, -0.03, 1.0]] {
                let d = |x: &f32| x * model[0] + x * model[1] + x * model[2];
                let plain = column.iter().filter(|x| d(x).abs() <= 0.3).count();
                assert_eq!(count(rows, model, 0.3), plain);
                // SAFETY: every machine has single numbers.
                assert_eq!(unsafe { count::scalar(rows, model, 0.3) }, plain);
                #[cfg(target_arch = "x86_64")]
                // SAFETY: every x86-64 has them.
                assert_eq!(unsafe { count::sse2(rows, model, 0.3) }, plain);
                #[cfg(target_arch = "x86_64")]
                if crate::level::Level::available().any(|level| level == crate::level::Level::Avx2) {
                    // SAFETY: the machine has them.
                    assert_eq!(unsafe { count::avx2(rows, model, 0.3) }, plain);
                }
            }
        }
    }
}
