//! Gradients of 64 pixels at a time, by vectors of 512 bits, and the order that they come in.
//!
//! Gradients, and masks of pixels, are in the order in which the machine unpacks levels; they are put in the order of the pixels
//! where they are compacted. There are no closures in the kernels: they would be compiled for plain machines.

use std::arch::x86_64::{
    __m512i, _mm512_add_epi16, _mm512_loadu_si512, _mm512_maddubs_epi16, _mm512_mullo_epi16, _mm512_permutex2var_epi64,
    _mm512_set1_epi16, _mm512_setr_epi64, _mm512_shuffle_i32x4, _mm512_sub_epi16, _mm512_unpackhi_epi8,
    _mm512_unpacklo_epi8, _pdep_u64, _pext_u64,
};

use super::block::REACH;
use crate::level::{Level, level};

/// Whether the level has them, and the machine compacts 8- and 16-bit numbers. (Every machine of 512 bits has BMI2.)
pub(super) fn is_available() -> bool {
    level() == Level::Avx512 && is_x86_feature_detected!("avx512vbmi2")
}

/// Gradients of a block, 32 along `u` in each of two vectors and as many along `v`.
pub(super) type Gradients = [[__m512i; 2]; 2];

/// A level of which many are read at once.
pub(super) trait VectorLevel: Sized {
    /// For each sixteen of the kernels' order, the pixels of its bits.
    const SIXTEENS: [u64; 4];
    /// Where the 64-bit words of both vectors of gradients go for the first 32 pixels; 4 more for the others.
    const WORDS: [i64; 8];

    /// The gradients of the pixels between the levels.
    ///
    /// # Safety
    /// The machine must be as [`is_available`] asks.
    unsafe fn gradients(rows: [&[Self; REACH]; 3]) -> Gradients;

    /// From 32-bit words of 64 pixels in their order to the order of the kernels.
    ///
    /// # Safety
    /// The machine must be as [`is_available`] asks.
    unsafe fn scatter(words: [__m512i; 4]) -> [__m512i; 4];

    /// One bit for each pixel, in the order of the kernels.
    fn own(pixels: u64) -> u64 {
        assert!(is_available());
        Self::SIXTEENS.into_iter().rev().fold(0, |bits, sixteen| {
            // SAFETY: the machine has the instruction.
            (bits << 16) | unsafe { _pext_u64(pixels, sixteen) }
        })
    }

    /// From the order of the kernels to that of the pixels.
    ///
    /// # Safety
    /// The machine must be as [`is_available`] asks.
    #[inline(always)]
    unsafe fn in_order(bits: u64) -> u64 {
        let [a, b, c, d] = Self::SIXTEENS;
        // SAFETY: the caller vouches for the machine.
        unsafe { _pdep_u64(bits, a) | _pdep_u64(bits >> 16, b) | _pdep_u64(bits >> 32, c) | _pdep_u64(bits >> 48, d) }
    }
}

/// Bytes are multiplied by 3 or 10 with both signs and added in pairs.
impl VectorLevel for u8 {
    const SIXTEENS: [u64; 4] =
        [0x000f_000f_000f_000f, 0x00f0_00f0_00f0_00f0, 0x0f00_0f00_0f00_0f00, 0xf000_f000_f000_f000];
    const WORDS: [i64; 8] = [0, 1, 8, 9, 2, 3, 10, 11];

    #[inline(always)]
    unsafe fn gradients([above, middle, below]: [&[u8; REACH]; 3]) -> Gradients {
        // SAFETY: the caller vouches for the machine; there are 66 levels in each row.
        unsafe {
            let (a, m, b) = (above.as_ptr(), middle.as_ptr(), below.as_ptr());
            let a0 = _mm512_loadu_si512(a.cast());
            let a1 = _mm512_loadu_si512(a.add(1).cast());
            let a2 = _mm512_loadu_si512(a.add(2).cast());
            let m0 = _mm512_loadu_si512(m.cast());
            let m2 = _mm512_loadu_si512(m.add(2).cast());
            let b0 = _mm512_loadu_si512(b.cast());
            let b1 = _mm512_loadu_si512(b.add(1).cast());
            let b2 = _mm512_loadu_si512(b.add(2).cast());
            // Minus in the lower byte of a pair.
            let (three, ten) = (_mm512_set1_epi16(0x03fd), _mm512_set1_epi16(0x0af6));
            let (falling, rising) = (differences(a0, b2, three), differences(b0, a2, three));
            let (along, down) = (differences(m0, m2, ten), differences(a1, b1, ten));
            let [x0, y0] = scharr(falling[0], rising[0], along[0], down[0]);
            let [x1, y1] = scharr(falling[1], rising[1], along[1], down[1]);
            [[x0, x1], [y0, y1]]
        }
    }

    #[inline(always)]
    unsafe fn scatter([a, b, c, d]: [__m512i; 4]) -> [__m512i; 4] {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            let (t0, t1) = (_mm512_shuffle_i32x4::<0x44>(a, b), _mm512_shuffle_i32x4::<0xee>(a, b));
            let (t2, t3) = (_mm512_shuffle_i32x4::<0x44>(c, d), _mm512_shuffle_i32x4::<0xee>(c, d));
            [
                _mm512_shuffle_i32x4::<0x88>(t0, t2),
                _mm512_shuffle_i32x4::<0xdd>(t0, t2),
                _mm512_shuffle_i32x4::<0x88>(t1, t3),
                _mm512_shuffle_i32x4::<0xdd>(t1, t3),
            ]
        }
    }
}

/// Of bytes 0 to 7 of every 16, and of 8 to 15: weighted differences, by pairs of weights.
///
/// # Safety
/// The machine must be as [`is_available`] asks.
#[inline(always)]
unsafe fn differences(less: __m512i, more: __m512i, weights: __m512i) -> [__m512i; 2] {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        [
            _mm512_maddubs_epi16(_mm512_unpacklo_epi8(less, more), weights),
            _mm512_maddubs_epi16(_mm512_unpackhi_epi8(less, more), weights),
        ]
    }
}

/// Gradients, of three parts of the differences along both diagonals and ten of those along the axes.
///
/// # Safety
/// The machine must be as [`is_available`] asks.
#[inline(always)]
unsafe fn scharr(falling: __m512i, rising: __m512i, along: __m512i, down: __m512i) -> [__m512i; 2] {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        [
            _mm512_add_epi16(_mm512_add_epi16(falling, rising), along),
            _mm512_add_epi16(_mm512_sub_epi16(falling, rising), down),
        ]
    }
}

impl VectorLevel for i16 {
    const SIXTEENS: [u64; 4] = [0x0f0f_0f0f, 0xf0f0_f0f0, 0x0f0f_0f0f << 32, 0xf0f0_f0f0 << 32];
    const WORDS: [i64; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

    #[inline(always)]
    unsafe fn gradients([above, middle, below]: [&[i16; REACH]; 3]) -> Gradients {
        // SAFETY: the caller vouches for the machine; there are 66 levels in each row.
        unsafe {
            let (a, m, b) = (above.as_ptr(), middle.as_ptr(), below.as_ptr());
            let [x0, y0] = gradients_of_words(a, m, b);
            let [x1, y1] = gradients_of_words(a.add(32), m.add(32), b.add(32));
            [[x0, x1], [y0, y1]]
        }
    }

    #[inline(always)]
    unsafe fn scatter([a, b, c, d]: [__m512i; 4]) -> [__m512i; 4] {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            let low = _mm512_setr_epi64(0, 1, 4, 5, 8, 9, 12, 13);
            let high = _mm512_setr_epi64(2, 3, 6, 7, 10, 11, 14, 15);
            [
                _mm512_permutex2var_epi64(a, low, b),
                _mm512_permutex2var_epi64(a, high, b),
                _mm512_permutex2var_epi64(c, low, d),
                _mm512_permutex2var_epi64(c, high, d),
            ]
        }
    }
}

/// The gradients of 32 pixels.
///
/// # Safety
/// The machine must be as [`is_available`] asks, and there must be 34 levels in each row.
#[inline(always)]
unsafe fn gradients_of_words(a: *const i16, m: *const i16, b: *const i16) -> [__m512i; 2] {
    // SAFETY: as the caller vouches.
    unsafe {
        let (a0, a2) = (_mm512_loadu_si512(a.cast()), _mm512_loadu_si512(a.add(2).cast()));
        let (b0, b2) = (_mm512_loadu_si512(b.cast()), _mm512_loadu_si512(b.add(2).cast()));
        let along = _mm512_sub_epi16(_mm512_loadu_si512(m.add(2).cast()), _mm512_loadu_si512(m.cast()));
        let down = _mm512_sub_epi16(_mm512_loadu_si512(b.add(1).cast()), _mm512_loadu_si512(a.add(1).cast()));
        let (falling, rising) = (_mm512_sub_epi16(b2, a0), _mm512_sub_epi16(a2, b0));
        let (three, ten) = (_mm512_set1_epi16(3), _mm512_set1_epi16(10));
        scharr(
            _mm512_mullo_epi16(falling, three),
            _mm512_mullo_epi16(rising, three),
            _mm512_mullo_epi16(along, ten),
            _mm512_mullo_epi16(down, ten),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_each_others_inverses() {
        if is_available() {
            for k in 0..64 {
                // SAFETY: the machine has the instructions.
                let (a, b) = unsafe {
                    (u8::in_order(<u8 as VectorLevel>::own(1 << k)), i16::in_order(<i16 as VectorLevel>::own(1 << k)))
                };
                assert_eq!((a, b), (1 << k, 1 << k));
            }
        }
    }
}
