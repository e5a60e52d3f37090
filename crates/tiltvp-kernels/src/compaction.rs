//! Keeping some rows of a block: those whose weight is above zero, with the machine's own instruction where there is one.

use std::ops::Range;

#[cfg(target_arch = "x86_64")]
use fearless_simd::{Simd as _, SimdBase as _, f32x8, u32x8};

#[cfg(target_arch = "x86_64")]
use crate::level::{Level, level, loops};

/// Rows of columns in single precision, the last of which are weights, and their numbers.
#[derive(Debug, Clone, Copy)]
pub struct RowBlock<'a> {
    /// `x`, `y`, `z` and weight, of one length.
    pub columns: [&'a [f32]; 4],
    /// A number for each row.
    pub numbers: &'a [u32],
    /// What the first row's place is counted from.
    pub first: usize,
}

/// Columns with room for at least [`ROOM`] rows more than are kept.
#[derive(Debug)]
pub struct KeptRows<'a> {
    /// `x`, `y`, `z` and weight.
    pub columns: [&'a mut [f32]; 4],
    /// The rows' numbers.
    pub numbers: &'a mut [u32],
    /// Their places before.
    pub places: &'a mut [u32],
    /// How many there are.
    pub len: usize,
}

/// How far beyond the last row that is kept the columns may be written: a vector of 512 bits.
pub const ROOM: usize = 16;

/// Appends the rows of a block whose weight is above zero.
///
/// # Panics
/// Unless the columns, numbers and places have room for all rows of the block and [`ROOM`] more.
pub fn compact_rows(block: &RowBlock<'_>, kept: &mut KeptRows<'_>) {
    let n = block.columns.iter().map(|column| column.len()).min().unwrap_or(0).min(block.numbers.len());
    let lengths = kept.columns.each_ref().map(|column| column.len());
    let room = lengths.into_iter().min().unwrap_or(0).min(kept.numbers.len()).min(kept.places.len());
    assert!(room >= kept.len + n + ROOM);
    #[cfg(target_arch = "x86_64")]
    if level() == Level::Avx512 {
        // SAFETY: the machine has the level, there are n rows, and there is room for n and 16 more.
        unsafe { avx512::compact_rows(block, n, kept) };
        return;
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(token) = loops().as_avx2() {
        let done = n / EIGHT * EIGHT;
        eights(token, block, done, kept);
        scalar(block, done..n, kept);
        return;
    }
    scalar(block, 0..n, kept);
}

/// Rows that vectors of 256 bits hold.
#[cfg(target_arch = "x86_64")]
const EIGHT: usize = 8;

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel! {
    /// Whole eights of rows.
    fn eights(token: Avx2, block: &RowBlock<'_>, n: usize, kept: &mut KeptRows<'_>) {
        let [x, y, z, w] = block.columns;
        let from = [&x[..n], &y[..n], &z[..n], &w[..n]];
        let numbers = &block.numbers[..n];
        let [to_x, to_y, to_z, to_w] = &mut kept.columns;
        let (to_numbers, to_places) = (&mut *kept.numbers, &mut *kept.places);
        let mut place = u32x8::from_slice(token, &[0, 1, 2, 3, 4, 5, 6, 7]) + block.first as u32;
        let mut len = kept.len;
        for start in (0..n).step_by(EIGHT) {
            let (own, to) = (start..start + EIGHT, len..len + EIGHT);
            let passing = f32x8::from_slice(token, &from[3][own.clone()]).simd_gt(0.0);
            for (from, to_column) in from.iter().zip([&mut *to_x, to_y, to_z, to_w]) {
                let values = f32x8::from_slice(token, &from[own.clone()]);
                token.compress_f32x8(values, passing).store_slice(&mut to_column[to.clone()]);
            }
            let values = u32x8::from_slice(token, &numbers[own]);
            token.compress_u32x8(values, passing).store_slice(&mut to_numbers[to.clone()]);
            token.compress_u32x8(place, passing).store_slice(&mut to_places[to]);
            place += EIGHT as u32;
            len += token.to_bitmask_mask32x8(passing).count_ones() as usize;
        }
        kept.len = len;
    }
}

fn scalar(block: &RowBlock<'_>, rows: Range<usize>, kept: &mut KeptRows<'_>) {
    let [x, y, z, w] = block.columns;
    let [to_x, to_y, to_z, to_w] = &mut kept.columns;
    let mut len = kept.len;
    for i in rows {
        // Written always and kept if it passes: a branch here would be guessed wrong too often.
        (to_x[len], to_y[len], to_z[len], to_w[len]) = (x[i], y[i], z[i], w[i]);
        (kept.numbers[len], kept.places[len]) = (block.numbers[i], (block.first + i) as u32);
        len += usize::from(w[i] > 0.0);
    }
    kept.len = len;
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::{
        _CMP_LT_OQ, _mm512_add_epi32, _mm512_castsi512_ps, _mm512_mask_cmp_ps_mask, _mm512_maskz_compress_epi32,
        _mm512_maskz_loadu_epi32, _mm512_set1_epi32, _mm512_setr_epi32, _mm512_setzero_ps, _mm512_storeu_si512,
    };

    use super::{KeptRows, ROOM, RowBlock};

    /// # Safety
    /// The machine must have the features, the block must hold `n` rows, and there must be room for `n` and [`ROOM`] more.
    #[target_feature(enable = "avx512f,popcnt")]
    pub(super) unsafe fn compact_rows(block: &RowBlock<'_>, n: usize, kept: &mut KeptRows<'_>) {
        let [x, y, z, w] = block.columns;
        let [to_x, to_y, to_z, to_w] = &mut kept.columns;
        let from = [x.as_ptr().cast(), y.as_ptr().cast(), z.as_ptr().cast(), block.numbers.as_ptr().cast::<i32>()];
        let to =
            [to_x.as_mut_ptr().cast(), to_y.as_mut_ptr().cast(), to_z.as_mut_ptr().cast(), kept.numbers.as_mut_ptr()];
        let (weights, places) = (to_w.as_mut_ptr(), kept.places.as_mut_ptr());
        let mut len = kept.len;
        // SAFETY: as the caller vouches; what a mask leaves out is not read.
        unsafe {
            let count = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let mut place = _mm512_add_epi32(count, _mm512_set1_epi32(block.first as i32));
            for start in (0..n).step_by(ROOM) {
                let own = u16::MAX >> (start + ROOM).saturating_sub(n);
                let weight = _mm512_maskz_loadu_epi32(own, w.as_ptr().add(start).cast());
                let passing =
                    _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(own, _mm512_setzero_ps(), _mm512_castsi512_ps(weight));
                let mut column = 0;
                while column < from.len() {
                    let values = _mm512_maskz_loadu_epi32(own, from[column].add(start));
                    let values = _mm512_maskz_compress_epi32(passing, values);
                    _mm512_storeu_si512(to[column].add(len).cast(), values);
                    column += 1;
                }
                _mm512_storeu_si512(weights.add(len).cast(), _mm512_maskz_compress_epi32(passing, weight));
                _mm512_storeu_si512(places.add(len).cast(), _mm512_maskz_compress_epi32(passing, place));
                place = _mm512_add_epi32(place, _mm512_set1_epi32(ROOM as i32));
                len += passing.count_ones() as usize;
            }
        }
        kept.len = len;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Found = ([Vec<u32>; 4], Vec<u32>, Vec<u32>);

    fn found(kernel: fn(&RowBlock<'_>, &mut KeptRows<'_>), n: usize) -> Found {
        let column = |k: usize| -> Vec<f32> { (0..n).map(|i| (i * (k + 3)) as f32 * 0.7 - 3.0).collect() };
        let weights: Vec<f32> = (0..n).map(|i| if i % 7 < 3 { (i % 5) as f32 } else { -((i % 2) as f32) }).collect();
        let (x, y, z) = (column(0), column(1), column(2));
        let numbers: Vec<u32> = (0..n as u32).map(|i| 3 * i + 1).collect();
        let block = RowBlock { columns: [&x, &y, &z, &weights], numbers: &numbers, first: 40 };
        let mut out = [(); 4].map(|()| vec![0.0f32; 2 * n + ROOM]);
        let (mut kept_numbers, mut places) = (vec![0; 2 * n + ROOM], vec![0; 2 * n + ROOM]);
        let [x, y, z, w] = &mut out;
        let columns: [&mut [f32]; 4] = [x, y, z, w];
        let mut kept = KeptRows { columns, numbers: &mut kept_numbers, places: &mut places, len: 0 };
        kernel(&block, &mut kept);
        kernel(&block, &mut kept);
        let len = kept.len;
        let bits = out.map(|column| column[..len].iter().map(|value| value.to_bits()).collect());
        (bits, kept_numbers[..len].to_vec(), places[..len].to_vec())
    }

    #[test]
    fn the_machine_keeps_the_same_rows_as_a_loop() {
        for n in (0..70).chain([128, 1000]) {
            let plainly = |block: &RowBlock<'_>, kept: &mut KeptRows<'_>| scalar(block, 0..block.numbers.len(), kept);
            assert_eq!(found(compact_rows, n), found(plainly, n), "{n} rows");
            #[cfg(target_arch = "x86_64")]
            if loops().as_avx2().is_some() {
                let by_eights = |block: &RowBlock<'_>, kept: &mut KeptRows<'_>| {
                    let (n, token) = (block.numbers.len(), loops().as_avx2().unwrap());
                    eights(token, block, n / EIGHT * EIGHT, kept);
                    scalar(block, n / EIGHT * EIGHT..n, kept);
                };
                assert_eq!(found(by_eights, n), found(plainly, n), "{n} rows");
            }
        }
        assert!(found(compact_rows, 1000).1.len() > 300);
    }
}
