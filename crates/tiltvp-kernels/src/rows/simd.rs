//! Sixteen numbers of single precision at a time, in vectors of any width: what the kernels of single precision are written in.

#[cfg(any(test, not(target_arch = "x86_64")))]
use std::cmp::Ordering;

/// Numbers that are worked on together: those of the widest vectors.
pub(super) const WIDTH: usize = 16;

/// Groups are summed in so many turns, so that neighbouring rows of one group need not wait for each other; a vector of four rows
/// is written for each.
pub(super) const TURNS: usize = 4;

/// Sixteen numbers of single precision, in whatever registers hold them.
///
/// Every operation rounds as IEEE 754 says and products are never fused with sums, so all implementations give the same bits.
///
/// # Safety
/// All methods need a machine with the vectors that the implementation is made of.
pub(super) trait Simd: Copy {
    /// One bit or word for each number.
    type Mask: Copy;
    unsafe fn splat(value: f32) -> Self;
    unsafe fn load(from: &[f32; WIDTH]) -> Self;
    unsafe fn store(self, to: &mut [f32; WIDTH]);
    unsafe fn add(a: Self, b: Self) -> Self;
    unsafe fn sub(a: Self, b: Self) -> Self;
    unsafe fn mul(a: Self, b: Self) -> Self;
    /// The number where it is above zero, zero elsewhere.
    unsafe fn positive(a: Self) -> Self;
    unsafe fn at_most(a: Self, b: Self) -> Self::Mask;
    unsafe fn below(a: Self, b: Self) -> Self::Mask;
    /// The numbers of the mask, and zeros.
    unsafe fn keep(a: Self, mask: Self::Mask) -> Self;
    unsafe fn count(mask: Self::Mask) -> u32;
    /// Without its sign.
    unsafe fn abs(a: Self) -> Self;
    /// Numbers of the mask that are at most the others.
    unsafe fn at_most_of(mask: Self::Mask, a: Self, b: Self) -> Self::Mask;
    /// Numbers of the mask that are not.
    unsafe fn beyond_of(mask: Self::Mask, a: Self, b: Self) -> Self::Mask;
    /// Zeros for the numbers of the mask, as they are for the others.
    unsafe fn clear(to: &mut [f32; WIDTH], mask: Self::Mask);
    /// Four numbers of every row together, rows 0, 4, 8, 12 first, then rows 1, 5, 9, 13, and so on.
    unsafe fn store_fours(columns: [Self; 4], to: &mut [[[f32; 4]; TURNS]; TURNS]);
}

/// One number after the other, for machines without a kernel, and what kernels are held to.
#[cfg(any(test, not(target_arch = "x86_64")))]
#[derive(Clone, Copy)]
pub(super) struct Scalar([f32; WIDTH]);

#[cfg(any(test, not(target_arch = "x86_64")))]
impl Scalar {
    #[inline(always)]
    fn zip(self, other: Self, with: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| with(self.0[i], other.0[i])))
    }
}

#[cfg(any(test, not(target_arch = "x86_64")))]
impl Simd for Scalar {
    type Mask = [bool; WIDTH];

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; WIDTH])
    }
    #[inline(always)]
    unsafe fn load(from: &[f32; WIDTH]) -> Self {
        Self(*from)
    }
    #[inline(always)]
    unsafe fn store(self, to: &mut [f32; WIDTH]) {
        *to = self.0;
    }
    #[inline(always)]
    unsafe fn add(a: Self, b: Self) -> Self {
        a.zip(b, |a, b| a + b)
    }
    #[inline(always)]
    unsafe fn sub(a: Self, b: Self) -> Self {
        a.zip(b, |a, b| a - b)
    }
    #[inline(always)]
    unsafe fn mul(a: Self, b: Self) -> Self {
        a.zip(b, |a, b| a * b)
    }
    #[inline(always)]
    unsafe fn positive(a: Self) -> Self {
        Self(a.0.map(|a| if a > 0.0 { a } else { 0.0 }))
    }
    #[inline(always)]
    unsafe fn at_most(a: Self, b: Self) -> Self::Mask {
        std::array::from_fn(|i| a.0[i] <= b.0[i])
    }
    #[inline(always)]
    unsafe fn below(a: Self, b: Self) -> Self::Mask {
        std::array::from_fn(|i| a.0[i] < b.0[i])
    }
    #[inline(always)]
    unsafe fn keep(a: Self, mask: Self::Mask) -> Self {
        Self(std::array::from_fn(|i| if mask[i] { a.0[i] } else { 0.0 }))
    }
    #[inline(always)]
    unsafe fn count(mask: Self::Mask) -> u32 {
        mask.iter().map(|held| u32::from(*held)).sum()
    }
    #[inline(always)]
    unsafe fn abs(a: Self) -> Self {
        Self(a.0.map(f32::abs))
    }
    #[inline(always)]
    unsafe fn at_most_of(mask: Self::Mask, a: Self, b: Self) -> Self::Mask {
        std::array::from_fn(|i| mask[i] && a.0[i] <= b.0[i])
    }
    #[inline(always)]
    unsafe fn beyond_of(mask: Self::Mask, a: Self, b: Self) -> Self::Mask {
        std::array::from_fn(|i| mask[i] && a.0[i].partial_cmp(&b.0[i]).is_none_or(Ordering::is_gt))
    }
    #[inline(always)]
    unsafe fn clear(to: &mut [f32; WIDTH], mask: Self::Mask) {
        to.iter_mut().zip(mask).for_each(|(to, masked)| *to = if masked { 0.0 } else { *to });
    }
    #[inline(always)]
    unsafe fn store_fours(columns: [Self; 4], to: &mut [[[f32; 4]; TURNS]; TURNS]) {
        for row in 0..WIDTH {
            for (column, to) in columns.iter().zip(&mut to[row % TURNS][row / TURNS]) {
                *to = column.0[row];
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use std::arch::x86_64::{
        __m256, __m512, __mmask16, _CMP_LE_OQ, _CMP_LT_OQ, _CMP_NLE_UQ, _mm256_add_ps, _mm256_and_ps, _mm256_andnot_ps,
        _mm256_castps_pd, _mm256_cmp_ps, _mm256_loadu_ps, _mm256_max_ps, _mm256_movemask_ps, _mm256_mul_ps,
        _mm256_set1_ps, _mm256_setzero_ps, _mm256_storeu_pd, _mm256_storeu_ps, _mm256_sub_ps, _mm256_unpackhi_pd,
        _mm256_unpackhi_ps, _mm256_unpacklo_pd, _mm256_unpacklo_ps, _mm512_abs_ps, _mm512_add_ps, _mm512_castps_pd,
        _mm512_cmp_ps_mask, _mm512_loadu_ps, _mm512_mask_cmp_ps_mask, _mm512_mask_storeu_ps, _mm512_maskz_mov_ps,
        _mm512_max_ps, _mm512_mul_ps, _mm512_set1_ps, _mm512_setzero_ps, _mm512_storeu_pd, _mm512_storeu_ps,
        _mm512_sub_ps, _mm512_unpackhi_pd, _mm512_unpackhi_ps, _mm512_unpacklo_pd, _mm512_unpacklo_ps,
    };

    use super::{Simd, TURNS, WIDTH};

    /// One register of 512 bits (AVX-512 F).
    #[derive(Clone, Copy)]
    pub(in crate::rows) struct Avx512(__m512);

    /// A method as one intrinsic, or a few.
    macro_rules! methods {
        ($($name:ident($($argument:ident: $kind:ty),*) -> $out:ty $body:block)*) => {
            $(
                #[inline(always)]
                unsafe fn $name($($argument: $kind),*) -> $out {
                    // SAFETY: the caller vouches for the machine; references hold 16 numbers.
                    unsafe { $body }
                }
            )*
        };
    }

    impl Simd for Avx512 {
        type Mask = __mmask16;

        methods! {
            splat(value: f32) -> Self { Self(_mm512_set1_ps(value)) }
            load(from: &[f32; WIDTH]) -> Self { Self(_mm512_loadu_ps(from.as_ptr())) }
            add(a: Self, b: Self) -> Self { Self(_mm512_add_ps(a.0, b.0)) }
            sub(a: Self, b: Self) -> Self { Self(_mm512_sub_ps(a.0, b.0)) }
            mul(a: Self, b: Self) -> Self { Self(_mm512_mul_ps(a.0, b.0)) }
            positive(a: Self) -> Self { Self(_mm512_max_ps(a.0, _mm512_setzero_ps())) }
            at_most(a: Self, b: Self) -> __mmask16 { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a.0, b.0) }
            below(a: Self, b: Self) -> __mmask16 { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a.0, b.0) }
            keep(a: Self, mask: __mmask16) -> Self { Self(_mm512_maskz_mov_ps(mask, a.0)) }
            abs(a: Self) -> Self { Self(_mm512_abs_ps(a.0)) }
            at_most_of(mask: __mmask16, a: Self, b: Self) -> __mmask16 {
                _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(mask, a.0, b.0)
            }
            beyond_of(mask: __mmask16, a: Self, b: Self) -> __mmask16 {
                _mm512_mask_cmp_ps_mask::<_CMP_NLE_UQ>(mask, a.0, b.0)
            }
        }

        #[inline(always)]
        unsafe fn count(mask: __mmask16) -> u32 {
            mask.count_ones()
        }
        #[inline(always)]
        unsafe fn clear(to: &mut [f32; WIDTH], mask: __mmask16) {
            // SAFETY: the caller vouches for the machine, the reference holds 16 numbers.
            unsafe { _mm512_mask_storeu_ps(to.as_mut_ptr(), mask, _mm512_setzero_ps()) }
        }

        #[inline(always)]
        unsafe fn store_fours([a, b, c, d]: [Self; 4], to: &mut [[[f32; 4]; TURNS]; TURNS]) {
            // SAFETY: the caller vouches for the machine, the references hold 16 numbers each.
            unsafe {
                let low = (_mm512_unpacklo_ps(a.0, b.0), _mm512_unpacklo_ps(c.0, d.0));
                let high = (_mm512_unpackhi_ps(a.0, b.0), _mm512_unpackhi_ps(c.0, d.0));
                let low = (_mm512_castps_pd(low.0), _mm512_castps_pd(low.1));
                let high = (_mm512_castps_pd(high.0), _mm512_castps_pd(high.1));
                _mm512_storeu_pd(to[0].as_mut_ptr().cast(), _mm512_unpacklo_pd(low.0, low.1));
                _mm512_storeu_pd(to[1].as_mut_ptr().cast(), _mm512_unpackhi_pd(low.0, low.1));
                _mm512_storeu_pd(to[2].as_mut_ptr().cast(), _mm512_unpacklo_pd(high.0, high.1));
                _mm512_storeu_pd(to[3].as_mut_ptr().cast(), _mm512_unpackhi_pd(high.0, high.1));
            }
        }

        #[inline(always)]
        unsafe fn store(self, to: &mut [f32; WIDTH]) {
            // SAFETY: the caller vouches for the machine, the reference holds 16 numbers.
            unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
        }
    }

    /// [`Simd::store_fours`] of eight rows, from `first` fours on.
    ///
    /// # Safety
    /// The machine must have AVX2.
    #[inline(always)]
    unsafe fn store_half([a, b, c, d]: [__m256; 4], to: &mut [[[f32; 4]; TURNS]; TURNS], first: usize) {
        // SAFETY: the caller vouches for the machine, and two fours follow the first.
        unsafe {
            let low = (_mm256_castps_pd(_mm256_unpacklo_ps(a, b)), _mm256_castps_pd(_mm256_unpacklo_ps(c, d)));
            let high = (_mm256_castps_pd(_mm256_unpackhi_ps(a, b)), _mm256_castps_pd(_mm256_unpackhi_ps(c, d)));
            _mm256_storeu_pd(to[0][first..first + 2].as_mut_ptr().cast(), _mm256_unpacklo_pd(low.0, low.1));
            _mm256_storeu_pd(to[1][first..first + 2].as_mut_ptr().cast(), _mm256_unpackhi_pd(low.0, low.1));
            _mm256_storeu_pd(to[2][first..first + 2].as_mut_ptr().cast(), _mm256_unpacklo_pd(high.0, high.1));
            _mm256_storeu_pd(to[3][first..first + 2].as_mut_ptr().cast(), _mm256_unpackhi_pd(high.0, high.1));
        }
    }

    /// Two registers of 256 bits (AVX2).
    #[derive(Clone, Copy)]
    pub(in crate::rows) struct Avx2(__m256, __m256);

    impl Simd for Avx2 {
        type Mask = (__m256, __m256);

        methods! {
            splat(value: f32) -> Self { Self(_mm256_set1_ps(value), _mm256_set1_ps(value)) }
            load(from: &[f32; WIDTH]) -> Self {
                Self(_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(8)))
            }
            add(a: Self, b: Self) -> Self { Self(_mm256_add_ps(a.0, b.0), _mm256_add_ps(a.1, b.1)) }
            sub(a: Self, b: Self) -> Self { Self(_mm256_sub_ps(a.0, b.0), _mm256_sub_ps(a.1, b.1)) }
            mul(a: Self, b: Self) -> Self { Self(_mm256_mul_ps(a.0, b.0), _mm256_mul_ps(a.1, b.1)) }
            positive(a: Self) -> Self {
                Self(_mm256_max_ps(a.0, _mm256_setzero_ps()), _mm256_max_ps(a.1, _mm256_setzero_ps()))
            }
            at_most(a: Self, b: Self) -> Self::Mask {
                (_mm256_cmp_ps::<_CMP_LE_OQ>(a.0, b.0), _mm256_cmp_ps::<_CMP_LE_OQ>(a.1, b.1))
            }
            below(a: Self, b: Self) -> Self::Mask {
                (_mm256_cmp_ps::<_CMP_LT_OQ>(a.0, b.0), _mm256_cmp_ps::<_CMP_LT_OQ>(a.1, b.1))
            }
            keep(a: Self, mask: Self::Mask) -> Self { Self(_mm256_and_ps(a.0, mask.0), _mm256_and_ps(a.1, mask.1)) }
            abs(a: Self) -> Self {
                let sign = _mm256_set1_ps(-0.0);
                Self(_mm256_andnot_ps(sign, a.0), _mm256_andnot_ps(sign, a.1))
            }
            at_most_of(mask: Self::Mask, a: Self, b: Self) -> Self::Mask {
                let near = Self::at_most(a, b);
                (_mm256_and_ps(mask.0, near.0), _mm256_and_ps(mask.1, near.1))
            }
            beyond_of(mask: Self::Mask, a: Self, b: Self) -> Self::Mask {
                let near = Self::at_most(a, b);
                (_mm256_andnot_ps(near.0, mask.0), _mm256_andnot_ps(near.1, mask.1))
            }
            clear(to: &mut [f32; WIDTH], mask: Self::Mask) -> () {
                let own = Self::load(to);
                Self(_mm256_andnot_ps(mask.0, own.0), _mm256_andnot_ps(mask.1, own.1)).store(to);
            }
            count(mask: Self::Mask) -> u32 {
                _mm256_movemask_ps(mask.0).count_ones() + _mm256_movemask_ps(mask.1).count_ones()
            }
        }

        #[inline(always)]
        unsafe fn store_fours([a, b, c, d]: [Self; 4], to: &mut [[[f32; 4]; TURNS]; TURNS]) {
            // SAFETY: the caller vouches for the machine, the references hold 16 numbers each.
            unsafe {
                store_half([a.0, b.0, c.0, d.0], to, 0);
                store_half([a.1, b.1, c.1, d.1], to, 2);
            }
        }

        #[inline(always)]
        unsafe fn store(self, to: &mut [f32; WIDTH]) {
            // SAFETY: the caller vouches for the machine, the reference holds 16 numbers.
            unsafe {
                _mm256_storeu_ps(to.as_mut_ptr(), self.0);
                _mm256_storeu_ps(to.as_mut_ptr().add(8), self.1);
            }
        }
    }
}
