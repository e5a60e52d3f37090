//! Narrow Gaussians in fixed point: sums of three columns, then of three of those, rounded once.

#[cfg(target_arch = "x86_64")]
use crate::level::{Level, level, loops};
use crate::vectorised;

/// Units of the taps: three by three pixels weighted by them are exact in whole numbers.
pub const TAP_UNITS: i32 = 256;

/// What is taken from sums of columns, so that they are signed numbers of 16 bits.
const HALF: i32 = 1 << 15;

/// Bits of sums that are rounded off: what is left is in units of 1/8 of a grey level.
const BITS: u32 = 13;

/// What the rounded sums of [`HALF`]s lack, in these units.
const MIDDLE: i32 = (HALF * TAP_UNITS) >> BITS;

/// Half a unit, as a product of two numbers of 16 bits.
const HALF_UNIT: (i16, i16) = (64, 64);

const _: () = assert!(HALF_UNIT.0 as i32 * HALF_UNIT.1 as i32 == 1 << (BITS - 1));

vectorised! {
    /// The middle row and its neighbours weighted by taps in units of 1/256, exactly, in units of 1/256 of a grey level, less 128.
    pub fn fixed_columns([above, middle, below]: [&[u8]; 3], [centre, side]: [i16; 2], out: &mut [i16]) {
        let (centre, side) = (centre as u16, side as u16);
        for (((o, a), m), b) in out.iter_mut().zip(above).zip(middle).zip(below) {
            let sum = u16::from(*m) * centre + (u16::from(*a) + u16::from(*b)) * side;
            *o = (sum ^ HALF as u16) as i16;
        }
    }
}

/// The same along a row of columns' sums, one wider on both sides, rounded once, to 1/8 of a grey level; halves go to the
/// even one. So turned and negative images are smoothed alike, and Scharr gradients of the row are exact in units of 1/8.
///
/// # Panics
/// Unless there are two more sums than levels.
pub fn fixed_rows(sums: &[i16], taps: [i16; 2], out: &mut [i16]) {
    assert!(sums.len() >= out.len() + 2);
    #[cfg(target_arch = "x86_64")]
    if level() == Level::Avx512 {
        // SAFETY: the machine has the level, and there are two more sums than levels.
        unsafe { avx512::fixed_rows(sums, taps, out) };
        return;
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(token) = loops().as_avx2() {
        avx2::fixed_rows(token, sums, taps, out);
        return;
    }
    scalar(sums, taps, out);
}

vectorised! {
    fn scalar(sums: &[i16], [centre, side]: [i16; 2], out: &mut [i16]) {
        let n = out.len();
        let (left, middle, right) = (&sums[..n], &sums[1..=n], &sums[2..n + 2]);
        let (centre, side) = (i32::from(centre), i32::from(side));
        for (((o, l), m), r) in out.iter_mut().zip(left).zip(middle).zip(right) {
            let sum = i32::from(*m) * centre + (i32::from(*l) + i32::from(*r)) * side;
            let even = (sum >> BITS) & 1;
            *o = (((sum + (1 << (BITS - 1)) - 1 + even) >> BITS) + MIDDLE) as i16;
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::{
        __m256i, _mm256_add_epi16, _mm256_add_epi32, _mm256_and_si256, _mm256_andnot_si256, _mm256_cmpeq_epi32,
        _mm256_madd_epi16, _mm256_packs_epi32, _mm256_set1_epi16, _mm256_set1_epi32, _mm256_setzero_si256,
        _mm256_srai_epi32, _mm256_srli_epi32, _mm256_unpackhi_epi16, _mm256_unpacklo_epi16,
    };

    use fearless_simd::{Avx2, SimdBase as _, SimdInto as _, i16x16};

    use super::{BITS, HALF_UNIT, MIDDLE, scalar};

    fearless_simd::kernel! {
        /// See [`fixed_rows`](super::fixed_rows).
        pub(super) fn fixed_rows(token: Avx2, sums: &[i16], taps: [i16; 2], out: &mut [i16]) {
            let [centre, side] = taps;
            let sides = _mm256_set1_epi16(side);
            let middles = _mm256_set1_epi32((i32::from(HALF_UNIT.1) << 16) | i32::from(centre as u16));
            let taps = [sides, middles];
            let (whole, rest) = out.as_chunks_mut::<16>();
            for (out, sums) in whole.iter_mut().zip(sums.windows(18).step_by(16)) {
                let [l, m, r] = [&sums[..16], &sums[1..17], &sums[2..18]];
                let [l, m, r] = [i16x16::from_slice(token, l), i16x16::from_slice(token, m), i16x16::from_slice(token, r)];
                let levels: i16x16<Avx2> = levels([l.into(), m.into(), r.into()], taps).simd_into(token);
                levels.store_slice(out);
            }
            let done = whole.len() * 16;
            scalar(&sums[done..], [centre, side], rest);
        }
    }

    /// Levels of 16 pixels.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn levels([l, m, r]: [__m256i; 3], [sides, middles]: [__m256i; 2]) -> __m256i {
        let offset = _mm256_set1_epi16(HALF_UNIT.0);
        let low = sum(
            _mm256_madd_epi16(_mm256_unpacklo_epi16(l, r), sides),
            _mm256_madd_epi16(_mm256_unpacklo_epi16(m, offset), middles),
        );
        let high = sum(
            _mm256_madd_epi16(_mm256_unpackhi_epi16(l, r), sides),
            _mm256_madd_epi16(_mm256_unpackhi_epi16(m, offset), middles),
        );
        _mm256_add_epi16(_mm256_packs_epi32(low, high), _mm256_set1_epi16(MIDDLE as i16))
    }

    /// The rounded sum of two, of which one has the half in it.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn sum(a: __m256i, b: __m256i) -> __m256i {
        let more = _mm256_add_epi32(a, b);
        // Nothing is rounded off a half and a half: it has gone up, perhaps to an odd number.
        let off = _mm256_and_si256(more, _mm256_set1_epi32((1 << BITS) - 1));
        let halves = _mm256_cmpeq_epi32(off, _mm256_setzero_si256());
        _mm256_andnot_si256(_mm256_srli_epi32::<31>(halves), _mm256_srai_epi32::<{ BITS as i32 }>(more))
    }
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::{
        __m512i, _mm512_add_epi16, _mm512_add_epi32, _mm512_loadu_si512, _mm512_madd_epi16, _mm512_mask_and_epi32,
        _mm512_mask_storeu_epi16, _mm512_maskz_loadu_epi16, _mm512_packs_epi32, _mm512_set1_epi16, _mm512_set1_epi32,
        _mm512_srai_epi32, _mm512_storeu_si512, _mm512_testn_epi32_mask, _mm512_unpackhi_epi16, _mm512_unpacklo_epi16,
    };

    use super::{BITS, HALF_UNIT, MIDDLE};

    /// # Safety
    /// The machine must have the features, with two more sums than levels.
    #[target_feature(enable = "avx512f,avx512bw")]
    pub(super) unsafe fn fixed_rows(sums: &[i16], [centre, side]: [i16; 2], out: &mut [i16]) {
        // SAFETY: as the caller vouches; what a mask leaves out is neither read nor written.
        unsafe {
            let sides = _mm512_set1_epi16(side);
            let middles = _mm512_set1_epi32((i32::from(HALF_UNIT.1) << 16) | i32::from(centre as u16));
            let (offset, grey) = (_mm512_set1_epi16(HALF_UNIT.0), _mm512_set1_epi16(MIDDLE as i16));
            let whole = out.len() / 32 * 32;
            let mut first = 0;
            while first < whole {
                let from = sums.as_ptr().add(first);
                let l = _mm512_loadu_si512(from.cast());
                let m = _mm512_loadu_si512(from.add(1).cast());
                let r = _mm512_loadu_si512(from.add(2).cast());
                let levels = levels([l, m, r], sides, middles, offset, grey);
                _mm512_storeu_si512(out.as_mut_ptr().add(first).cast(), levels);
                first += 32;
            }
            if whole < out.len() {
                let own = u32::MAX >> (whole + 32 - out.len());
                let from = sums.as_ptr().add(whole);
                let l = _mm512_maskz_loadu_epi16(own, from);
                let m = _mm512_maskz_loadu_epi16(own, from.add(1));
                let r = _mm512_maskz_loadu_epi16(own, from.add(2));
                let levels = levels([l, m, r], sides, middles, offset, grey);
                _mm512_mask_storeu_epi16(out.as_mut_ptr().add(whole), own, levels);
            }
        }
    }

    /// Levels of 32 pixels.
    ///
    /// # Safety
    /// The machine must have the features.
    #[inline(always)]
    unsafe fn levels(
        [l, m, r]: [__m512i; 3],
        sides: __m512i,
        middles: __m512i,
        offset: __m512i,
        grey: __m512i,
    ) -> __m512i {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            let low = sum(
                _mm512_madd_epi16(_mm512_unpacklo_epi16(l, r), sides),
                _mm512_madd_epi16(_mm512_unpacklo_epi16(m, offset), middles),
            );
            let high = sum(
                _mm512_madd_epi16(_mm512_unpackhi_epi16(l, r), sides),
                _mm512_madd_epi16(_mm512_unpackhi_epi16(m, offset), middles),
            );
            _mm512_add_epi16(_mm512_packs_epi32(low, high), grey)
        }
    }

    /// The rounded sum of two, of which one has the half in it.
    ///
    /// # Safety
    /// The machine must have AVX-512 F.
    #[inline(always)]
    unsafe fn sum(a: __m512i, b: __m512i) -> __m512i {
        // SAFETY: the caller vouches for the machine.
        unsafe {
            let more = _mm512_add_epi32(a, b);
            // Nothing is rounded off a half and a half: it has gone up, perhaps to an odd number.
            let halves = _mm512_testn_epi32_mask(more, _mm512_set1_epi32((1 << BITS) - 1));
            let up = _mm512_srai_epi32::<BITS>(more);
            _mm512_mask_and_epi32(up, halves, up, _mm512_set1_epi32(!1))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_gives_the_same_bits_as_a_loop_and_mirrors_negatives() {
        let taps = [170, 43];
        for n in (0..100).chain([257]) {
            let sums: Vec<i16> = (0..n + 2).map(|i| ((i * i * 2_654_435 + 77 * i) % 65_281) as u16 as i16).collect();
            let (mut ours, mut plainly) = (vec![0; n], vec![0; n]);
            fixed_rows(&sums, taps, &mut ours);
            scalar(&sums, taps, &mut plainly);
            assert_eq!(ours, plainly);
            #[cfg(target_arch = "x86_64")]
            if let Some(token) = loops().as_avx2() {
                ours.fill(0);
                avx2::fixed_rows(token, &sums, taps, &mut ours);
                assert_eq!(ours, plainly);
            }
        }
        // All sums of a grey level's 1/256 parts, and of the negative.
        for sum in (0..=65_280u32).step_by(16) {
            let level = |sum: u32| {
                let mut out = [0];
                scalar(&[(sum as u16 ^ 0x8000) as i16; 3], taps, &mut out);
                i32::from(out[0])
            };
            assert_eq!(level(sum) + level(65_280 - sum), 2040);
            assert!((f64::from(level(sum)) - f64::from(sum) / 32.0).abs() <= 0.5);
        }
    }
}
