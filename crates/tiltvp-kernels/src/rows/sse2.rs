//! Sixteen numbers in four registers of 128 bits, which every x86-64 has.

use std::arch::x86_64::{
    __m128, __m128i, _mm_add_epi32, _mm_add_ps, _mm_and_ps, _mm_andnot_ps, _mm_castpd_ps, _mm_castps_pd,
    _mm_castps_si128, _mm_cmple_ps, _mm_cmplt_ps, _mm_cvtsi128_si32, _mm_loadu_ps, _mm_max_ps, _mm_mul_ps,
    _mm_sad_epu8, _mm_set1_ps, _mm_setzero_ps, _mm_setzero_si128, _mm_storeu_ps, _mm_sub_epi32, _mm_sub_ps,
    _mm_unpackhi_epi64, _mm_unpackhi_pd, _mm_unpackhi_ps, _mm_unpacklo_pd, _mm_unpacklo_ps,
};

use super::simd::{Simd, TURNS, WIDTH};

/// Four registers (SSE2).
#[derive(Clone, Copy)]
pub(super) struct Sse2([__m128; 4]);

impl Sse2 {
    #[inline(always)]
    fn zip(self, other: Self, with: impl Fn(__m128, __m128) -> __m128) -> Self {
        let (Self([a, b, c, d]), Self([e, f, g, h])) = (self, other);
        Self([with(a, e), with(b, f), with(c, g), with(d, h)])
    }
}

/// Operations number by number.
macro_rules! each {
    ($($name:ident = $intrinsic:ident)*) => {
        $(
            #[inline(always)]
            unsafe fn $name(a: Self, b: Self) -> Self {
                // SAFETY: every x86-64 has SSE2.
                a.zip(b, |a, b| unsafe { $intrinsic(a, b) })
            }
        )*
    };
}

impl Simd for Sse2 {
    /// All bits of the numbers that are in it.
    type Mask = Self;

    each! {
        add = _mm_add_ps
        sub = _mm_sub_ps
        mul = _mm_mul_ps
        at_most = _mm_cmple_ps
        below = _mm_cmplt_ps
        keep = _mm_and_ps
    }

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: every x86-64 has SSE2.
        Self([unsafe { _mm_set1_ps(value) }; 4])
    }
    #[inline(always)]
    unsafe fn load(from: &[f32; WIDTH]) -> Self {
        let four = |first: usize| {
            let four: &[f32; 4] = from[first..first + 4].first_chunk().unwrap_or(&[0.0; 4]);
            // SAFETY: every x86-64 has SSE2, and there are four numbers.
            unsafe { _mm_loadu_ps(four.as_ptr()) }
        };
        Self([four(0), four(4), four(8), four(12)])
    }
    #[inline(always)]
    unsafe fn store(self, to: &mut [f32; WIDTH]) {
        for (four, to) in self.0.into_iter().zip(to.as_chunks_mut::<4>().0) {
            // SAFETY: every x86-64 has SSE2, and there is room for four numbers.
            unsafe { _mm_storeu_ps(to.as_mut_ptr(), four) };
        }
    }
    #[inline(always)]
    unsafe fn positive(a: Self) -> Self {
        // SAFETY: every x86-64 has SSE2.
        Self(a.0.map(|a| unsafe { _mm_max_ps(a, _mm_setzero_ps()) }))
    }
    #[inline(always)]
    unsafe fn abs(a: Self) -> Self {
        // SAFETY: every x86-64 has SSE2.
        Self(a.0.map(|a| unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), a) }))
    }
    #[inline(always)]
    unsafe fn at_most_of(mask: Self, a: Self, b: Self) -> Self {
        // SAFETY: every x86-64 has SSE2.
        unsafe { Self::keep(mask, Self::at_most(a, b)) }
    }
    #[inline(always)]
    unsafe fn beyond_of(mask: Self, a: Self, b: Self) -> Self {
        // SAFETY: every x86-64 has SSE2.
        unsafe { Self::at_most(a, b).zip(mask, |near, mask| _mm_andnot_ps(near, mask)) }
    }
    #[inline(always)]
    unsafe fn clear(to: &mut [f32; WIDTH], mask: Self) {
        // SAFETY: every x86-64 has SSE2.
        unsafe { mask.zip(Self::load(to), |mask, own| _mm_andnot_ps(mask, own)).store(to) };
    }
    #[inline(always)]
    unsafe fn count(mask: Self) -> u32 {
        // SAFETY: every x86-64 has SSE2.
        unsafe {
            // A number of the mask is less one; sums of four of them are bytes.
            let [a, b, c, d]: [__m128i; 4] = mask.0.map(|mask| _mm_castps_si128(mask));
            let less = _mm_add_epi32(_mm_add_epi32(a, b), _mm_add_epi32(c, d));
            let halves = _mm_sad_epu8(_mm_sub_epi32(_mm_setzero_si128(), less), _mm_setzero_si128());
            _mm_cvtsi128_si32(_mm_add_epi32(halves, _mm_unpackhi_epi64(halves, halves))) as u32
        }
    }
    #[inline(always)]
    unsafe fn store_fours([a, b, c, d]: [Self; 4], to: &mut [[[f32; 4]; TURNS]; TURNS]) {
        let fours = a.0.into_iter().zip(b.0).zip(c.0.into_iter().zip(d.0));
        for (four, ((a, b), (c, d))) in fours.enumerate() {
            // SAFETY: every x86-64 has SSE2, and there is room for four numbers.
            unsafe {
                let low = (_mm_castps_pd(_mm_unpacklo_ps(a, b)), _mm_castps_pd(_mm_unpacklo_ps(c, d)));
                let high = (_mm_castps_pd(_mm_unpackhi_ps(a, b)), _mm_castps_pd(_mm_unpackhi_ps(c, d)));
                _mm_storeu_ps(to[0][four].as_mut_ptr(), _mm_castpd_ps(_mm_unpacklo_pd(low.0, low.1)));
                _mm_storeu_ps(to[1][four].as_mut_ptr(), _mm_castpd_ps(_mm_unpackhi_pd(low.0, low.1)));
                _mm_storeu_ps(to[2][four].as_mut_ptr(), _mm_castpd_ps(_mm_unpacklo_pd(high.0, high.1)));
                _mm_storeu_ps(to[3][four].as_mut_ptr(), _mm_castpd_ps(_mm_unpackhi_pd(high.0, high.1)));
            }
        }
    }
}
