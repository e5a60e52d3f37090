//! The kernel in loops that the compiler makes vectors of, for every machine, with the pairs of 128 bits that it does not find.

#[cfg(not(target_arch = "x86_64"))]
use crate::marks::{MARK, bits};
use crate::vectorised;

use super::block::{BLOCK, Directions, KeptPixels, Level, Levels, PixelBlock, REACH, Threshold};

vectorised! {
    pub(super) fn bytes(
        levels: &Levels<'_, u8>,
        blocks: &[PixelBlock],
        threshold: &Threshold<'_>,
        kept: &mut KeptPixels<'_>,
    ) {
        threshold_blocks(levels, blocks, threshold, kept);
    }
}

vectorised! {
    pub(super) fn words(
        levels: &Levels<'_, i16>,
        blocks: &[PixelBlock],
        threshold: &Threshold<'_>,
        kept: &mut KeptPixels<'_>,
    ) {
        threshold_blocks(levels, blocks, threshold, kept);
    }
}

/// The scalar twin of every kernel.
#[inline(always)]
pub(super) fn threshold_blocks<L: Level>(
    levels: &Levels<'_, L>,
    blocks: &[PixelBlock],
    threshold: &Threshold<'_>,
    kept: &mut KeptPixels<'_>,
) {
    let mut all = Gradients::default();
    let mut rest = [[L::default(); REACH]; 3];
    let mut along = [[0; 2]; BLOCK];
    if let Directions::From { parts, .. } = threshold.directions {
        along = std::array::from_fn(|i| [parts.wrapping_mul(i as i16), 0]);
    }
    for block in blocks {
        gradients_of(levels.around(block, &mut rest), &mut all);
        let mut passing = all.strong(threshold.at_least) & block.own;
        kept.strong += passing.count_ones() as usize;
        if passing == 0 {
            continue;
        }
        match threshold.directions {
            Directions::None => {}
            Directions::Each(each) => {
                let each = each.get(block.slot as usize..).unwrap_or(&[]);
                passing &= if let Some(each) = each.first_chunk() {
                    all.directed(each, threshold.limit)
                } else {
                    let mut rest = [[0; 2]; BLOCK];
                    rest[..each.len()].copy_from_slice(each);
                    all.directed(&rest, threshold.limit)
                };
            }
            Directions::From { centre: [u, v], parts } => {
                let away = |x: u32, centre: i32| (x as i32 * i32::from(parts)).wrapping_sub(centre) as i16;
                let first = [away(block.place & 0xffff, u), away(block.place >> 16, v)];
                passing &= all.directed(&along.map(|[x, _]| [first[0].wrapping_add(x), first[1]]), threshold.limit);
            }
        }
        if passing != 0 {
            kept.append(block, passing, [&all.gx, &all.gy], &IN_ORDER);
        }
    }
}

/// The places of gradients that are in the order of the pixels.
const IN_ORDER: [u8; BLOCK + 1] = {
    let mut places = [0; BLOCK + 1];
    let mut i = 0;
    while i < BLOCK {
        places[i] = i as u8;
        i += 1;
    }
    places
};

/// The gradients of some pixels and their squares.
struct Gradients {
    gx: [i16; BLOCK],
    gy: [i16; BLOCK],
    squared: [i32; BLOCK],
}

impl Default for Gradients {
    fn default() -> Self {
        Self { gx: [0; BLOCK], gy: [0; BLOCK], squared: [0; BLOCK] }
    }
}

#[cfg(target_arch = "x86_64")]
impl Gradients {
    /// One bit for each pixel whose squared gradient, which is kept, is at least that much.
    #[inline(always)]
    fn strong(&mut self, at_least: i32) -> u64 {
        let gradients = self.gx.as_chunks().0.iter().zip(self.gy.as_chunks().0);
        let squared = self.squared.as_chunks_mut().0.iter_mut();
        gradients.zip(squared).rev().fold(0, |bits, ((gx, gy), squared)| {
            (bits << sse2::TOGETHER) | u64::from(sse2::strong(gx, gy, at_least, squared))
        })
    }

    /// One bit for each pixel whose gradient has an allowed direction.
    #[inline(always)]
    fn directed(&self, vectors: &[[i16; 2]; BLOCK], limit: f32) -> u64 {
        let gradients = self.gx.as_chunks().0.iter().zip(self.gy.as_chunks().0);
        let others = vectors.as_chunks().0.iter().zip(self.squared.as_chunks().0);
        gradients.zip(others).rev().fold(0, |bits, ((gx, gy), (vectors, squared))| {
            (bits << sse2::TOGETHER) | u64::from(sse2::directed(gx, gy, vectors, squared, limit))
        })
    }
}

/// What the compiler makes no good vectors of, in those of 128 bits, which every x86-64 has: products in pairs, and bits of comparisons.
#[cfg(target_arch = "x86_64")]
mod sse2 {
    use std::arch::x86_64::{
        __m128i, _mm_cmpgt_epi32, _mm_cmple_ps, _mm_cvtepi32_ps, _mm_loadu_si128, _mm_madd_epi16, _mm_movemask_epi8,
        _mm_movemask_ps, _mm_mul_ps, _mm_packs_epi16, _mm_packs_epi32, _mm_set1_epi32, _mm_set1_ps, _mm_storeu_si128,
        _mm_unpackhi_epi16, _mm_unpacklo_epi16,
    };

    /// Pixels that are worked on together.
    pub(super) const TOGETHER: usize = 8;

    /// Eight gradients, four pairs each.
    #[inline(always)]
    fn pairs(gx: &[i16; TOGETHER], gy: &[i16; TOGETHER]) -> [__m128i; 2] {
        // SAFETY: every x86-64 has SSE2, and the references hold eight words.
        unsafe {
            let (x, y) = (_mm_loadu_si128(gx.as_ptr().cast()), _mm_loadu_si128(gy.as_ptr().cast()));
            [_mm_unpacklo_epi16(x, y), _mm_unpackhi_epi16(x, y)]
        }
    }

    /// Writes the squares of gradients; a bit for each that is at least that much.
    #[inline(always)]
    pub(super) fn strong(
        gx: &[i16; TOGETHER],
        gy: &[i16; TOGETHER],
        at_least: i32,
        squared: &mut [i32; TOGETHER],
    ) -> u8 {
        let pairs = pairs(gx, gy);
        // SAFETY: every x86-64 has SSE2, and there is room for eight numbers.
        unsafe {
            let [low, high] = pairs.map(|g| _mm_madd_epi16(g, g));
            _mm_storeu_si128(squared.as_mut_ptr().cast(), low);
            _mm_storeu_si128(squared[4..].as_mut_ptr().cast(), high);
            let least = _mm_set1_epi32(at_least);
            let weak = _mm_packs_epi32(_mm_cmpgt_epi32(least, low), _mm_cmpgt_epi32(least, high));
            !(_mm_movemask_epi8(_mm_packs_epi16(weak, weak)) as u8)
        }
    }

    /// A bit for each gradient that has an allowed direction.
    #[inline(always)]
    pub(super) fn directed(
        gx: &[i16; TOGETHER],
        gy: &[i16; TOGETHER],
        vectors: &[[i16; 2]; TOGETHER],
        squared: &[i32; TOGETHER],
        limit: f32,
    ) -> u8 {
        let pairs = pairs(gx, gy);
        let mut bits = 0;
        for (half, pair) in pairs.into_iter().enumerate() {
            // SAFETY: every x86-64 has SSE2, and four pairs and numbers follow the first of each half.
            bits |= unsafe {
                let vectors = _mm_loadu_si128(vectors[4 * half..4 * half + 4].as_ptr().cast());
                let squared = _mm_loadu_si128(squared[4 * half..4 * half + 4].as_ptr().cast());
                let across = _mm_cvtepi32_ps(_mm_madd_epi16(vectors, pair));
                let most = _mm_mul_ps(_mm_set1_ps(limit), _mm_cvtepi32_ps(squared));
                _mm_movemask_ps(_mm_cmple_ps(_mm_mul_ps(across, across), most)) << (4 * half)
            };
        }
        bits as u8
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Gradients {
    /// One bit for each pixel whose squared gradient, which is kept, is at least that much.
    #[inline(always)]
    fn strong(&mut self, at_least: i32) -> u64 {
        let mut marks = [0; BLOCK];
        for (i, mark) in marks.iter_mut().enumerate() {
            let (x, y) = (i32::from(self.gx[i]), i32::from(self.gy[i]));
            self.squared[i] = (x * x).wrapping_add(y * y);
            *mark = if self.squared[i] >= at_least { MARK } else { 0 };
        }
        bits(&marks)
    }

    /// One bit for each pixel whose gradient has an allowed direction.
    #[inline(always)]
    fn directed(&self, vectors: &[[i16; 2]; BLOCK], limit: f32) -> u64 {
        let mut marks = [0; BLOCK];
        for (i, (mark, vector)) in marks.iter_mut().zip(vectors).enumerate() {
            let (x, y) = (i32::from(vector[0]), i32::from(vector[1]));
            let across = (x * i32::from(self.gx[i])).wrapping_add(y * i32::from(self.gy[i])) as f32;
            *mark = if across * across <= limit * self.squared[i] as f32 { MARK } else { 0 };
        }
        bits(&marks)
    }
}

#[inline(always)]
fn gradients_of<L: Level>([a, m, b]: [&[L; REACH]; 3], all: &mut Gradients) {
    // What lies beside a span may be anything.
    let less = |a: L, b: L| a.signed().wrapping_sub(b.signed());
    let weighted = |diagonals: i16, middle: i16| diagonals.wrapping_mul(3).wrapping_add(middle.wrapping_mul(10));
    for i in 0..BLOCK {
        let (falling, rising) = (less(b[i + 2], a[i]), less(a[i + 2], b[i]));
        all.gx[i] = weighted(falling.wrapping_add(rising), less(m[i + 2], m[i]));
        all.gy[i] = weighted(falling.wrapping_sub(rising), less(b[i + 1], a[i + 1]));
    }
}
