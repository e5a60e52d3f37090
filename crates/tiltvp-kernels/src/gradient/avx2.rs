//! The kernel with vectors of 256 bits: 64 pixels are tested at a time, in the order in which the machine unpacks levels; packed
//! marks are in the order of the pixels again.
//!
//! By the machine's own names: the library's interleaving is over whole vectors, which is two permutations more each time. There
//! are no closures given to functions of the standard library, which are compiled for plain machines.

use std::arch::x86_64::{
    __m256i, _CMP_LE_OQ, _mm256_add_epi16, _mm256_castps_si256, _mm256_cmp_ps, _mm256_cmpgt_epi32, _mm256_cvtepi32_ps,
    _mm256_madd_epi16, _mm256_maddubs_epi16, _mm256_movemask_epi8, _mm256_mul_ps, _mm256_mullo_epi16,
    _mm256_packs_epi16, _mm256_packs_epi32, _mm256_permute4x64_epi64, _mm256_set_m128i, _mm256_set1_epi16,
    _mm256_set1_epi32, _mm256_set1_ps, _mm256_sub_epi16, _mm256_unpackhi_epi8, _mm256_unpackhi_epi16,
    _mm256_unpacklo_epi8, _mm256_unpacklo_epi16,
};

use fearless_simd::{Avx2, SimdBase as _, SimdInto as _, i16x8, i16x16, i32x8, u8x32};

use super::block::{BLOCK, Directions, KeptPixels, Level, Levels, PixelBlock, REACH, Threshold};
use crate::prefetch::prefetch;

/// Gradients of a block: four vectors along `u`, and four along `v`.
type Gradients = [[__m256i; 4]; 2];

/// Gradients of a block along both axes, in rows in which every byte is a place.
type Placed = [[i16; 256]; 2];

/// Marks of a block, ones in all bits: of the lower quarters of each vector's gradients, and of the upper.
type Marks = [[__m256i; 2]; 4];

/// Rows that are asked for before they are needed. Only time depends on it.
const AHEAD: usize = 6;

/// A level of which many are read at once.
pub(super) trait Level256: Level {
    /// The first pixel of each vector of gradients.
    const FIRST: [usize; 4];
    /// From a vector's first pixel to that of its upper half.
    const HALF: usize;
    /// Where the gradient of each pixel is in the vectors; that of none may be any.
    const PLACES: [u8; BLOCK + 1] = places(Self::FIRST, Self::HALF);

    /// The gradients of the pixels between the levels.
    fn gradients(token: Avx2, rows: [&[Self; REACH]; 3]) -> Gradients;
}

const fn places(first: [usize; 4], half: usize) -> [u8; BLOCK + 1] {
    let mut places = [0; BLOCK + 1];
    let mut i = 0;
    while i < BLOCK {
        places[first[i / 16] + half * (i / 8 % 2) + i % 8] = i as u8;
        i += 1;
    }
    places
}

/// Bytes are multiplied by 3 or 10 with both signs and added in pairs.
impl Level256 for u8 {
    const FIRST: [usize; 4] = [0, 8, 32, 40];
    const HALF: usize = 16;

    #[inline(always)]
    fn gradients(token: Avx2, rows: [&[u8; REACH]; 3]) -> Gradients {
        gradients_of_bytes(token, rows)
    }
}

impl Level256 for i16 {
    const FIRST: [usize; 4] = [0, 16, 32, 48];
    const HALF: usize = 8;

    #[inline(always)]
    fn gradients(token: Avx2, rows: [&[i16; REACH]; 3]) -> Gradients {
        gradients_of_words(token, rows)
    }
}

fearless_simd::kernel! {
    #[inline(always)]
    fn gradients_of_bytes(token: Avx2, rows: [&[u8; REACH]; 3]) -> Gradients {
        let [above, middle, below] = rows;
        let [x0, y0] = bytes_from::<0>(token, above, middle, below);
        let [x1, y1] = bytes_from::<32>(token, above, middle, below);
        [[x0[0], x0[1], x1[0], x1[1]], [y0[0], y0[1], y1[0], y1[1]]]
    }
}

/// The gradients of 32 pixels: of bytes 0 to 7 of every 16, and of 8 to 15.
#[inline]
#[target_feature(enable = "avx2")]
fn bytes_from<const AT: usize>(token: Avx2, a: &[u8; REACH], m: &[u8; REACH], b: &[u8; REACH]) -> [[__m256i; 2]; 2] {
    let read = |row: &[u8; REACH], shift: usize| -> __m256i {
        u8x32::from_slice(token, &row[AT + shift..AT + shift + 32]).into()
    };
    let (a0, a1, a2) = (read(a, 0), read(a, 1), read(a, 2));
    let (m0, m2) = (read(m, 0), read(m, 2));
    let (b0, b1, b2) = (read(b, 0), read(b, 1), read(b, 2));
    // Minus in the lower byte of a pair.
    let (three, ten) = (_mm256_set1_epi16(0x03fd), _mm256_set1_epi16(0x0af6));
    let (falling, rising) = (differences(a0, b2, three), differences(b0, a2, three));
    let (along, down) = (differences(m0, m2, ten), differences(a1, b1, ten));
    let [x0, y0] = scharr(falling[0], rising[0], along[0], down[0]);
    let [x1, y1] = scharr(falling[1], rising[1], along[1], down[1]);
    [[x0, x1], [y0, y1]]
}

/// Of bytes 0 to 7 of every 16, and of 8 to 15: weighted differences, by pairs of weights.
#[inline]
#[target_feature(enable = "avx2")]
fn differences(less: __m256i, more: __m256i, weights: __m256i) -> [__m256i; 2] {
    [
        _mm256_maddubs_epi16(_mm256_unpacklo_epi8(less, more), weights),
        _mm256_maddubs_epi16(_mm256_unpackhi_epi8(less, more), weights),
    ]
}

/// Gradients, of three parts of the differences along both diagonals and ten of those along the axes.
#[inline]
#[target_feature(enable = "avx2")]
fn scharr(falling: __m256i, rising: __m256i, along: __m256i, down: __m256i) -> [__m256i; 2] {
    [
        _mm256_add_epi16(_mm256_add_epi16(falling, rising), along),
        _mm256_add_epi16(_mm256_sub_epi16(falling, rising), down),
    ]
}

fearless_simd::kernel! {
    #[inline(always)]
    fn gradients_of_words(token: Avx2, rows: [&[i16; REACH]; 3]) -> Gradients {
        let [above, middle, below] = rows;
        let [x0, y0] = words_from::<0>(token, above, middle, below);
        let [x1, y1] = words_from::<16>(token, above, middle, below);
        let [x2, y2] = words_from::<32>(token, above, middle, below);
        let [x3, y3] = words_from::<48>(token, above, middle, below);
        [[x0, x1, x2, x3], [y0, y1, y2, y3]]
    }
}

/// The gradients of 16 pixels.
#[inline]
#[target_feature(enable = "avx2")]
fn words_from<const AT: usize>(token: Avx2, a: &[i16; REACH], m: &[i16; REACH], b: &[i16; REACH]) -> [__m256i; 2] {
    let read = |row: &[i16; REACH], shift: usize| -> __m256i {
        i16x16::from_slice(token, &row[AT + shift..AT + shift + 16]).into()
    };
    let (a0, a2, b0, b2) = (read(a, 0), read(a, 2), read(b, 0), read(b, 2));
    let along = _mm256_sub_epi16(read(m, 2), read(m, 0));
    let down = _mm256_sub_epi16(read(b, 1), read(a, 1));
    let (falling, rising) = (_mm256_sub_epi16(b2, a0), _mm256_sub_epi16(a2, b0));
    let (three, ten) = (_mm256_set1_epi16(3), _mm256_set1_epi16(10));
    scharr(
        _mm256_mullo_epi16(falling, three),
        _mm256_mullo_epi16(rising, three),
        _mm256_mullo_epi16(along, ten),
        _mm256_mullo_epi16(down, ten),
    )
}

fearless_simd::kernel! {
    /// See [`GradientKernel::run`](super::GradientKernel::run).
    pub(super) fn bytes(
        token: Avx2,
        levels: &Levels<'_, u8>,
        blocks: &[PixelBlock],
        threshold: &Threshold<'_>,
        kept: &mut KeptPixels<'_>,
    ) {
        threshold_blocks(token, levels, blocks, threshold, kept);
    }
}

fearless_simd::kernel! {
    /// See [`GradientKernel::run`](super::GradientKernel::run).
    pub(super) fn words(
        token: Avx2,
        levels: &Levels<'_, i16>,
        blocks: &[PixelBlock],
        threshold: &Threshold<'_>,
        kept: &mut KeptPixels<'_>,
    ) {
        threshold_blocks(token, levels, blocks, threshold, kept);
    }
}

#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,popcnt")]
fn threshold_blocks<L: Level256>(
    token: Avx2,
    levels: &Levels<'_, L>,
    blocks: &[PixelBlock],
    threshold: &Threshold<'_>,
    kept: &mut KeptPixels<'_>,
) {
    // Above zero, so that one less is a number.
    let less = _mm256_set1_epi32(threshold.at_least - 1);
    let none = [[_mm256_set1_epi32(0); 2]; 4];
    let along = match threshold.directions {
        Directions::From { parts, .. } => along::<L>(token, parts),
        _ => none,
    };
    let mut rest = [[L::default(); REACH]; 3];
    let mut placed: Placed = [[0; 256]; 2];
    for block in blocks {
        if levels.places == usize::MAX {
            // An image is rarely in the nearest cache.
            prefetch(levels.data, (block.v() + AHEAD) * levels.stride + (block.place & 0xffff) as usize);
        }
        let [x, y] = L::gradients(token, levels.around(block, &mut rest));
        let (mut g, mut squared, mut strong) = (none, none, none);
        for k in 0..4 {
            g[k] = [_mm256_unpacklo_epi16(x[k], y[k]), _mm256_unpackhi_epi16(x[k], y[k])];
            for half in 0..2 {
                squared[k][half] = _mm256_madd_epi16(g[k][half], g[k][half]);
                strong[k][half] = _mm256_cmpgt_epi32(squared[k][half], less);
            }
        }
        let mut passing = bits::<L>(strong) & block.own;
        if passing == 0 {
            continue;
        }
        kept.strong += passing.count_ones() as usize;
        match threshold.directions {
            Directions::None => {}
            Directions::Each(each) => {
                let each = each.get(block.slot as usize..).unwrap_or(&[]);
                let mut some = [[0; 2]; BLOCK];
                let each = each.first_chunk().unwrap_or_else(|| {
                    some[..each.len()].copy_from_slice(each);
                    &some
                });
                passing &= directed::<L>(vectors::<L>(token, each), g, squared, threshold.limit);
            }
            Directions::From { centre: [u, v], parts } => {
                let away = |x: u32, centre: i32| (x as i32 * i32::from(parts)).wrapping_sub(centre);
                let (x, y) = (away(block.place & 0xffff, u), away(block.place >> 16, v));
                let first = _mm256_set1_epi32((y << 16) | (x & 0xffff));
                let mut q = along;
                for k in 0..4 {
                    for half in 0..2 {
                        q[k][half] = _mm256_add_epi16(first, along[k][half]);
                    }
                }
                passing &= directed::<L>(q, g, squared, threshold.limit);
            }
        }
        if passing != 0 {
            for (g, placed) in [x, y].into_iter().zip(&mut placed) {
                for (g, placed) in g.into_iter().zip(placed.as_chunks_mut::<16>().0) {
                    let g: i16x16<Avx2> = g.simd_into(token);
                    g.store_slice(placed);
                }
            }
            kept.append(block, passing, placed.each_ref(), &L::PLACES);
        }
    }
}

/// One bit for each pixel, in their order.
#[inline]
#[target_feature(enable = "avx2")]
fn bits<L: Level256>(marks: Marks) -> u64 {
    let thirty_two = |[a, b]: [[__m256i; 2]; 2]| {
        let bytes = _mm256_packs_epi16(_mm256_packs_epi32(a[0], a[1]), _mm256_packs_epi32(b[0], b[1]));
        // The upper half of a vector is where its pixels are, or between.
        let bytes = if L::HALF == 16 { bytes } else { _mm256_permute4x64_epi64::<0b11_01_10_00>(bytes) };
        u64::from(_mm256_movemask_epi8(bytes) as u32)
    };
    let [a, b, c, d] = marks;
    thirty_two([a, b]) | (thirty_two([c, d]) << 32)
}

/// One bit for each of the gradients `g` with `(q . g)^2 <= limit |g|^2`.
#[inline]
#[target_feature(enable = "avx2")]
fn directed<L: Level256>(q: Marks, g: Marks, squared: Marks, limit: f32) -> u64 {
    let limit = _mm256_set1_ps(limit);
    let mut marks = q;
    for k in 0..4 {
        for half in 0..2 {
            let across = _mm256_cvtepi32_ps(_mm256_madd_epi16(q[k][half], g[k][half]));
            let most = _mm256_mul_ps(limit, _mm256_cvtepi32_ps(squared[k][half]));
            let within = _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_mul_ps(across, across), most);
            marks[k][half] = _mm256_castps_si256(within);
        }
    }
    bits::<L>(marks)
}

/// How far the direction vectors of a block are from that of its first pixel.
#[inline]
#[target_feature(enable = "avx2")]
fn along<L: Level256>(token: Avx2, parts: i16) -> Marks {
    let mut along = [[_mm256_set1_epi32(0); 2]; 4];
    for (along, first) in along.iter_mut().zip(L::FIRST) {
        for (half, along) in along.iter_mut().enumerate() {
            let first = first + 4 * half;
            let number = |i: usize| (first + i % 4 + L::HALF * (i / 4)) as i32;
            let numbers = i32x8::from_slice(token, &std::array::from_fn::<i32, 8, _>(number)).into();
            *along = _mm256_mullo_epi16(numbers, _mm256_set1_epi16(parts));
        }
    }
    along
}

/// The direction vectors of a block.
#[inline]
#[target_feature(enable = "avx2")]
fn vectors<L: Level256>(token: Avx2, each: &[[i16; 2]; BLOCK]) -> Marks {
    let each: &[i16] = each.as_flattened();
    let four = |first: usize| i16x8::from_slice(token, &each[2 * first..2 * first + 8]).into();
    let mut q = [[_mm256_set1_epi32(0); 2]; 4];
    for (q, first) in q.iter_mut().zip(L::FIRST) {
        for (half, q) in q.iter_mut().enumerate() {
            let first = first + 4 * half;
            *q = _mm256_set_m128i(four(first + L::HALF), four(first));
        }
    }
    q
}
