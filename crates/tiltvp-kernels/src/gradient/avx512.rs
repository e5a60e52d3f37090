//! The kernel with vectors of 512 bits: 64 pixels are tested at a time, and blocks in which some pass wait to be compacted
//! together.
//!
//! There are no closures in the kernels: they would be compiled for plain machines.

use std::arch::x86_64::{
    __m512, __m512i, _CMP_LE_OQ, _MM_HINT_T0, _mm_prefetch, _mm256_storeu_si256, _mm512_add_epi16, _mm512_add_epi32,
    _mm512_castsi512_si128, _mm512_castsi512_si256, _mm512_cmpge_epi32_mask, _mm512_cvtepi32_ps, _mm512_cvtepu8_epi32,
    _mm512_extracti32x4_epi32, _mm512_loadu_si512, _mm512_madd_epi16, _mm512_mask_cmp_ps_mask,
    _mm512_maskz_compress_epi8, _mm512_maskz_compress_epi16, _mm512_maskz_loadu_epi32, _mm512_mul_ps,
    _mm512_mullo_epi16, _mm512_permutex2var_epi64, _mm512_set1_epi32, _mm512_set1_ps, _mm512_setr_epi64,
    _mm512_storeu_si512, _mm512_unpackhi_epi16, _mm512_unpacklo_epi16,
};

use super::avx512_scharr::{Gradients, VectorLevel, is_available};
use super::block::{BLOCK, Directions, KeptPixels, Level, Levels, PixelBlock, REACH, Threshold};

/// Rows that are asked for before they are needed. Only time depends on it.
const AHEAD: usize = 6;

/// Blocks that wait to be compacted: their gradients, 12 KB, stay in the nearest cache. Only time depends on it.
const ENOUGH: usize = 48;

/// Blocks with pixels that pass.
#[derive(Debug, Clone)]
pub(super) struct Pending {
    gradients: [[[i16; BLOCK]; 2]; ENOUGH],
    /// The pixels that pass instead of the block's own.
    blocks: [PixelBlock; ENOUGH],
    len: usize,
}

impl Default for Pending {
    fn default() -> Self {
        let none = PixelBlock { own: 0, slot: 0, place: 0 };
        Self { gradients: [[[0; BLOCK]; 2]; ENOUGH], blocks: [none; ENOUGH], len: 0 }
    }
}

/// The ways to look at directions as the kernels' parameter.
const NONE: u8 = 0;
const EACH: u8 = 1;
const FROM: u8 = 2;

/// Applies the threshold to blocks, of which those with pixels that pass wait.
pub(super) fn threshold_blocks<L: Level + VectorLevel>(
    levels: &Levels<'_, L>,
    blocks: &[PixelBlock],
    threshold: &Threshold<'_>,
    pending: &mut Pending,
    kept: &mut KeptPixels<'_>,
) {
    assert!(is_available());
    // SAFETY: the machine has the features.
    unsafe {
        match threshold.directions {
            Directions::None => threshold_body::<L, NONE>(levels, blocks, threshold, pending, kept),
            Directions::Each(_) => threshold_body::<L, EACH>(levels, blocks, threshold, pending, kept),
            Directions::From { .. } => threshold_body::<L, FROM>(levels, blocks, threshold, pending, kept),
        }
    }
}

/// Compacts what waits.
pub(super) fn flush<L: Level + VectorLevel>(pending: &mut Pending, kept: &mut KeptPixels<'_>) {
    assert!(is_available());
    // SAFETY: the machine has the features.
    unsafe { compact::<L>(pending, kept) };
}

/// # Safety
/// The machine must be as [`is_available`] asks.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vbmi2,bmi2,popcnt")]
unsafe fn threshold_body<L: Level + VectorLevel, const DIRECTED: u8>(
    levels: &Levels<'_, L>,
    blocks: &[PixelBlock],
    threshold: &Threshold<'_>,
    pending: &mut Pending,
    kept: &mut KeptPixels<'_>,
) {
    // SAFETY: as the caller vouches.
    unsafe {
        let (at_least, limit) = (_mm512_set1_epi32(threshold.at_least), _mm512_set1_ps(threshold.limit));
        // How far the direction vectors of each sixteen of the kernels' order are from the first.
        let mut along = [_mm512_set1_epi32(0); 4];
        let (mut centre, mut parts, mut each): ([i32; 2], i32, &[[i16; 2]]) = ([0; 2], 0, &[]);
        match threshold.directions {
            Directions::From { centre: point, parts: many } => {
                (centre, parts) = (point, i32::from(many));
                let mut k = 0;
                while k < 4 {
                    along[k] = _mm512_mullo_epi16(pixels(L::SIXTEENS[k]), _mm512_set1_epi32(parts & 0xffff));
                    k += 1;
                }
            }
            Directions::Each(vectors) => each = vectors,
            Directions::None => {}
        }
        let mut strong = 0;
        let mut rest = [[L::default(); REACH]; 3];
        for block in blocks {
            if levels.places == usize::MAX {
                // An image is rarely in the nearest cache.
                let place = (block.v() + AHEAD) * levels.stride + (block.place & 0xffff) as usize;
                _mm_prefetch::<_MM_HINT_T0>(levels.data.as_ptr().wrapping_add(place).cast());
            }
            let gradients = L::gradients(levels.around(block, &mut rest));
            let g = [
                _mm512_unpacklo_epi16(gradients[0][0], gradients[1][0]),
                _mm512_unpackhi_epi16(gradients[0][0], gradients[1][0]),
                _mm512_unpacklo_epi16(gradients[0][1], gradients[1][1]),
                _mm512_unpackhi_epi16(gradients[0][1], gradients[1][1]),
            ];
            let (mut squared, mut all) = ([at_least; 4], [0; 4]);
            let mut k = 0;
            while k < 4 {
                squared[k] = _mm512_madd_epi16(g[k], g[k]);
                all[k] = _mm512_cmpge_epi32_mask(squared[k], at_least);
                k += 1;
            }
            let found = word(all) & block.own;
            strong += found.count_ones() as usize;
            let mut passing = found;
            if DIRECTED != NONE {
                let mut q = along;
                if DIRECTED == FROM {
                    let x = (block.place & 0xffff) as i32 * parts - centre[0];
                    let y = (block.place >> 16) as i32 * parts - centre[1];
                    let first = _mm512_set1_epi32((y << 16) | (x & 0xffff));
                    let mut k = 0;
                    while k < 4 {
                        q[k] = _mm512_add_epi16(first, along[k]);
                        k += 1;
                    }
                } else {
                    q = vectors_of::<L>(each, block);
                }
                passing = directed(q, g, squared, limit, all) & block.own;
            }
            if passing != 0 {
                if pending.len == ENOUGH {
                    compact::<L>(pending, kept);
                }
                pending.push(PixelBlock { own: passing, ..*block }, gradients);
            }
        }
        kept.strong += strong;
    }
}

impl Pending {
    /// Adds a block, for which there must be a place.
    ///
    /// # Safety
    /// The machine must be as [`is_available`] asks.
    #[inline(always)]
    unsafe fn push(&mut self, block: PixelBlock, gradients: Gradients) {
        let at = self.len;
        let [x, y] = &mut self.gradients[at];
        // SAFETY: the caller vouches for the machine; a block has 64 gradients along each axis.
        unsafe {
            _mm512_storeu_si512(x.as_mut_ptr().cast(), gradients[0][0]);
            _mm512_storeu_si512(x.as_mut_ptr().add(32).cast(), gradients[0][1]);
            _mm512_storeu_si512(y.as_mut_ptr().cast(), gradients[1][0]);
            _mm512_storeu_si512(y.as_mut_ptr().add(32).cast(), gradients[1][1]);
        }
        self.blocks[at] = block;
        self.len = at + 1;
    }
}

/// Which of 64 gradients `g`, of those in the masks, have `(q . g)^2 <= limit |g|^2`.
///
/// # Safety
/// The machine must be as [`is_available`] asks.
#[inline(always)]
unsafe fn directed(q: [__m512i; 4], g: [__m512i; 4], squared: [__m512i; 4], limit: __m512, mut all: [u16; 4]) -> u64 {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let mut k = 0;
        while k < 4 {
            let across = _mm512_cvtepi32_ps(_mm512_madd_epi16(q[k], g[k]));
            let most = _mm512_mul_ps(limit, _mm512_cvtepi32_ps(squared[k]));
            all[k] = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(all[k], _mm512_mul_ps(across, across), most);
            k += 1;
        }
    }
    word(all)
}

/// Four masks of 16 as one.
#[inline(always)]
fn word([a, b, c, d]: [u16; 4]) -> u64 {
    u64::from(u32::from(a) | (u32::from(b) << 16)) | (u64::from(u32::from(c) | (u32::from(d) << 16)) << 32)
}

/// The numbers of 16 pixels, one for each bit.
///
/// # Safety
/// The machine must be as [`is_available`] asks.
#[inline(always)]
unsafe fn pixels(mut bits: u64) -> __m512i {
    let mut numbers = [0i32; 16];
    for number in &mut numbers {
        *number = bits.trailing_zeros() as i32;
        bits &= bits.wrapping_sub(1);
    }
    // SAFETY: the caller vouches for the machine; there are 16 numbers.
    unsafe { _mm512_loadu_si512(numbers.as_ptr().cast()) }
}

/// The direction vectors of a block in the order of the kernels; those beyond the last are zeros.
///
/// # Safety
/// The machine must be as [`is_available`] asks.
#[inline(always)]
unsafe fn vectors_of<L: Level + VectorLevel>(each: &[[i16; 2]], block: &PixelBlock) -> [__m512i; 4] {
    let each = each.get(block.slot as usize..).unwrap_or(&[]);
    let there = u64::MAX.checked_shr(BLOCK.saturating_sub(each.len()) as u32).unwrap_or(0);
    let from: *const i32 = each.as_ptr().cast();
    // SAFETY: the caller vouches for the machine; what the masks leave out is not read.
    unsafe {
        let a = _mm512_maskz_loadu_epi32(there as u16, from);
        let b = _mm512_maskz_loadu_epi32((there >> 16) as u16, from.wrapping_add(16));
        let c = _mm512_maskz_loadu_epi32((there >> 32) as u16, from.wrapping_add(32));
        let d = _mm512_maskz_loadu_epi32((there >> 48) as u16, from.wrapping_add(48));
        L::scatter([a, b, c, d])
    }
}

/// Appends what waits.
///
/// # Safety
/// The machine must be as [`is_available`] asks.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vbmi2,bmi2,popcnt")]
unsafe fn compact<L: Level + VectorLevel>(pending: &mut Pending, kept: &mut KeptPixels<'_>) {
    let blocks = &pending.blocks[..pending.len];
    let count = blocks.iter().map(|block| block.own.count_ones() as usize).sum::<usize>();
    let room = kept.slots.len().min(kept.places.len()).min(kept.gx.len()).min(kept.gy.len());
    assert!(room >= kept.len + count + BLOCK);
    let numbers: [u8; BLOCK] = std::array::from_fn(|i| i as u8);
    // SAFETY: the caller vouches for the machine, and there is room for all and a block more.
    unsafe {
        let numbers = _mm512_loadu_si512(numbers.as_ptr().cast());
        let [a, b, c, d, e, f, g, h] = L::WORDS;
        let low = _mm512_setr_epi64(a, b, c, d, e, f, g, h);
        let more = if L::WORDS[2] == 8 { 4 } else { 8 };
        let high = _mm512_setr_epi64(a + more, b + more, c + more, d + more, e + more, f + more, g + more, h + more);
        let (slots, places) = (kept.slots.as_mut_ptr(), kept.places.as_mut_ptr());
        let mut len = kept.len;
        for (block, [x, y]) in blocks.iter().zip(&pending.gradients) {
            let passing = L::in_order(block.own);
            let (first, second) = (passing as u32, (passing >> 32) as u32);
            let after = len + first.count_ones() as usize;
            let x = [_mm512_loadu_si512(x.as_ptr().cast()), _mm512_loadu_si512(x.as_ptr().add(32).cast())];
            let y = [_mm512_loadu_si512(y.as_ptr().cast()), _mm512_loadu_si512(y.as_ptr().add(32).cast())];
            let x0 = _mm512_maskz_compress_epi16(first, _mm512_permutex2var_epi64(x[0], low, x[1]));
            let y0 = _mm512_maskz_compress_epi16(first, _mm512_permutex2var_epi64(y[0], low, y[1]));
            let x1 = _mm512_maskz_compress_epi16(second, _mm512_permutex2var_epi64(x[0], high, x[1]));
            let y1 = _mm512_maskz_compress_epi16(second, _mm512_permutex2var_epi64(y[0], high, y[1]));
            let numbers = _mm512_maskz_compress_epi8(passing, numbers);
            let (slot, place) = (_mm512_set1_epi32(block.slot as i32), _mm512_set1_epi32(block.place as i32));
            let lowest = _mm512_cvtepu8_epi32(_mm512_castsi512_si128(numbers));
            _mm512_storeu_si512(slots.add(len).cast(), _mm512_add_epi32(lowest, slot));
            _mm512_storeu_si512(places.add(len).cast(), _mm512_add_epi32(lowest, place));
            let count = passing.count_ones() as usize;
            // Most blocks hold a few.
            if count <= 16 {
                _mm256_storeu_si256(kept.gx.as_mut_ptr().add(len).cast(), _mm512_castsi512_si256(x0));
                _mm256_storeu_si256(kept.gy.as_mut_ptr().add(len).cast(), _mm512_castsi512_si256(y0));
                _mm256_storeu_si256(kept.gx.as_mut_ptr().add(after).cast(), _mm512_castsi512_si256(x1));
                _mm256_storeu_si256(kept.gy.as_mut_ptr().add(after).cast(), _mm512_castsi512_si256(y1));
            } else {
                _mm512_storeu_si512(kept.gx.as_mut_ptr().add(len).cast(), x0);
                _mm512_storeu_si512(kept.gy.as_mut_ptr().add(len).cast(), y0);
                _mm512_storeu_si512(kept.gx.as_mut_ptr().add(after).cast(), x1);
                _mm512_storeu_si512(kept.gy.as_mut_ptr().add(after).cast(), y1);
                let others = [
                    _mm512_extracti32x4_epi32::<1>(numbers),
                    _mm512_extracti32x4_epi32::<2>(numbers),
                    _mm512_extracti32x4_epi32::<3>(numbers),
                ];
                for (at, numbers) in (len + 16..).step_by(16).zip(others) {
                    let numbers = _mm512_cvtepu8_epi32(numbers);
                    _mm512_storeu_si512(slots.add(at).cast(), _mm512_add_epi32(numbers, slot));
                    _mm512_storeu_si512(places.add(at).cast(), _mm512_add_epi32(numbers, place));
                }
            }
            len += count;
        }
        kept.len = len;
    }
    pending.len = 0;
}
