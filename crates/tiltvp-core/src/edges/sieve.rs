//! The inner loop of edge detection: Scharr gradients, threshold and screen of one span in 16-bit integers, compacted.

use multiversion::multiversion;

/// Pixels that are tested together, and how far beyond the end of what they keep the kernels may write.
pub(super) const BLOCK: usize = 32;

/// A grey level as the kernels read it.
pub(super) trait Level: Copy + Send + Sync {
    /// Levels of the gradients' unit: gradients are in this many parts of a Scharr gradient of 8-bit grey levels.
    const PARTS: i32;
    /// Three parts of a difference and ten, in the gradients' unit.
    fn weigh(difference: i16) -> (i16, i16);
    /// The level as a signed number.
    fn signed(self) -> i16;
}

/// Grey levels as they are: gradients up to 4080.
impl Level for u8 {
    const PARTS: i32 = 1;

    #[inline(always)]
    fn weigh(difference: i16) -> (i16, i16) {
        (3 * difference, 10 * difference)
    }

    #[inline(always)]
    fn signed(self) -> i16 {
        i16::from(self)
    }
}

/// Smoothed levels in units of 1/128, up to 255: gradients in units of 1/8, up to 32640, exact for levels in whole eighths.
impl Level for i16 {
    const PARTS: i32 = 8;

    #[inline(always)]
    fn weigh(difference: i16) -> (i16, i16) {
        // Rounded products with 3/16 and 10/16, as one instruction has them.
        let part = |factor: i32| ((((i32::from(difference) * factor) >> 14) + 1) >> 1) as i16;
        (part(THREE), part(TEN))
    }

    #[inline(always)]
    fn signed(self) -> i16 {
        self
    }
}

/// 3/16 and 10/16 in units of 2^-15.
pub(super) const THREE: i32 = 3 << 11;
pub(super) const TEN: i32 = 10 << 11;

/// What a gradient `g` must pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Test<'a> {
    /// The least squared gradient.
    pub at_least: i32,
    /// The vectors `q` of the span's pixels, if there is a screen.
    pub vectors: Vectors<'a>,
    /// The largest `(q . g)^2 / |g|^2`.
    pub limit: f32,
}

/// The screening vectors of one span.
#[derive(Debug, Clone, Copy)]
pub(super) enum Vectors<'a> {
    /// No screen.
    None,
    /// One for each pixel.
    Each(&'a [[i16; 2]]),
    /// The first pixel's, which grows along `x` by so much from pixel to pixel.
    Line { first: [i16; 2], step: i16 },
}

/// Three rows of levels, one pixel wider than a span on both sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows<'a, L> {
    pub above: &'a [L],
    pub middle: &'a [L],
    pub below: &'a [L],
}

/// Where the kernels write: the numbers of pixels and their gradients, `gy` in the upper half of a word and `gx` in the lower.
pub(super) struct Kept<'a> {
    pub slots: &'a mut [u32],
    pub gradients: &'a mut [u32],
}

/// Writes the pixels of a span of `n`, the first of which is `slot`, whose gradients pass, and returns how many did and how
/// many were strong. There must be room for `n` and a block more.
pub(super) fn sieve<L: Level>(rows: Rows<'_, L>, n: usize, slot: u32, test: &Test<'_>, kept: Kept<'_>) -> (usize, usize)
where
    Dispatch: Sieve<L>,
{
    Dispatch::sieve(rows, n, slot, test, kept)
}

/// The widest vectors of this machine.
pub(super) struct Dispatch;

/// A kernel for one kind of level.
pub(super) trait Sieve<L> {
    /// See [`sieve`].
    fn sieve(rows: Rows<'_, L>, n: usize, slot: u32, test: &Test<'_>, kept: Kept<'_>) -> (usize, usize);
}

macro_rules! dispatch {
    ($level:ty, $portable:ident) => {
        impl Sieve<$level> for Dispatch {
            #[inline]
            fn sieve(rows: Rows<'_, $level>, n: usize, slot: u32, test: &Test<'_>, kept: Kept<'_>) -> (usize, usize) {
                #[cfg(target_arch = "x86_64")]
                if super::sieve_avx512::is_available() {
                    return super::sieve_avx512::sieve(rows, n, slot, test, kept);
                }
                $portable(rows, n, slot, test, kept)
            }
        }

        #[multiversion(targets("x86_64+avx2+bmi1+bmi2", "x86_64+sse4.1"))]
        pub(super) fn $portable(
            rows: Rows<'_, $level>,
            n: usize,
            slot: u32,
            test: &Test<'_>,
            kept: Kept<'_>,
        ) -> (usize, usize) {
            sieve_body(rows, n, slot, test, kept)
        }
    };
}

dispatch!(u8, portable_levels);
dispatch!(i16, portable_smoothed);

#[inline(always)]
fn sieve_body<L: Level + Default>(
    rows: Rows<'_, L>,
    n: usize,
    slot: u32,
    test: &Test<'_>,
    kept: Kept<'_>,
) -> (usize, usize) {
    let Kept { slots, gradients } = kept;
    let rows = [&rows.above[..n + 2], &rows.middle[..n + 2], &rows.below[..n + 2]];
    let (mut len, mut strong) = (0, 0);
    let mut block = Block::default();
    for start in (0..n).step_by(BLOCK) {
        let size = BLOCK.min(n - start);
        let whole = (rows[0][start..].first_chunk(), rows[1][start..].first_chunk(), rows[2][start..].first_chunk());
        let all = if let (Some(above), Some(middle), Some(below)) = whole {
            gradients_of([above, middle, below], &mut block);
            u32::MAX
        } else {
            let mut rest = [[L::default(); BLOCK + 2]; 3];
            for (rest, row) in rest.iter_mut().zip(rows) {
                rest[..size + 2].copy_from_slice(&row[start..start + size + 2]);
            }
            gradients_of([&rest[0], &rest[1], &rest[2]], &mut block);
            u32::MAX >> (BLOCK - size)
        };
        for i in 0..BLOCK {
            block.strong[i] = if block.squared[i] >= test.at_least { 0x80 } else { 0 };
        }
        let mut passing = bits(&block.strong) & all;
        strong += passing.count_ones() as usize;
        match test.vectors {
            Vectors::None => {}
            Vectors::Each(each) => {
                let each = &each[start..];
                passing &= if let Some(each) = each.first_chunk() {
                    screened(each, &mut block, test.limit)
                } else {
                    let mut rest = [[0; 2]; BLOCK];
                    rest[..each.len()].copy_from_slice(each);
                    screened(&rest, &mut block, test.limit)
                };
            }
            Vectors::Line { first: [x, y], step } => {
                let mut line = [[0, y]; BLOCK];
                for (i, vector) in line.iter_mut().enumerate() {
                    vector[0] = x.wrapping_add(step.wrapping_mul((start + i) as i16));
                }
                passing &= screened(&line, &mut block, test.limit);
            }
        }
        while passing != 0 {
            let i = passing.trailing_zeros() as usize;
            let (x, y) = (block.gx[i] as u16, block.gy[i] as u16);
            (slots[len], gradients[len]) = (slot + (start + i) as u32, (u32::from(y) << 16) | u32::from(x));
            len += 1;
            passing &= passing - 1;
        }
    }
    (len, strong)
}

/// The gradients of some pixels, their squares, and marks in the uppermost bit.
struct Block {
    gx: [i16; BLOCK],
    gy: [i16; BLOCK],
    squared: [i32; BLOCK],
    strong: [u8; BLOCK],
    screened: [u8; BLOCK],
}

impl Default for Block {
    fn default() -> Self {
        let (zero, none) = ([0; BLOCK], [0; BLOCK]);
        Self { gx: zero, gy: zero, squared: [0; BLOCK], strong: none, screened: none }
    }
}

#[inline(always)]
fn gradients_of<L: Level>([a, m, b]: [&[L; BLOCK + 2]; 3], block: &mut Block) {
    let three = |a: L, b: L| L::weigh(a.signed() - b.signed()).0;
    let ten = |a: L, b: L| L::weigh(a.signed() - b.signed()).1;
    for i in 0..BLOCK {
        block.gx[i] = three(a[i + 2], a[i]) + three(b[i + 2], b[i]) + ten(m[i + 2], m[i]);
    }
    for i in 0..BLOCK {
        block.gy[i] = three(b[i], a[i]) + three(b[i + 2], a[i + 2]) + ten(b[i + 1], a[i + 1]);
    }
    for i in 0..BLOCK {
        let (x, y) = (i32::from(block.gx[i]), i32::from(block.gy[i]));
        block.squared[i] = x * x + y * y;
    }
}

/// One bit for each pixel that passes the screen.
#[inline(always)]
fn screened(vectors: &[[i16; 2]; BLOCK], block: &mut Block, limit: f32) -> u32 {
    for (i, vector) in vectors.iter().enumerate() {
        let (x, y) = (i32::from(vector[0]), i32::from(vector[1]));
        let across = (x * i32::from(block.gx[i]) + y * i32::from(block.gy[i])) as f32;
        block.screened[i] = if across * across <= limit * block.squared[i] as f32 { 0x80 } else { 0 };
    }
    bits(&block.screened)
}

/// The uppermost bit of each mark.
#[inline(always)]
fn bits(marks: &[u8; BLOCK]) -> u32 {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_mm_loadu_si128, _mm_movemask_epi8};
        // SAFETY: there are 32 marks, and SSE2 is part of every x86-64.
        unsafe {
            let low = _mm_movemask_epi8(_mm_loadu_si128(marks.as_ptr().cast()));
            let high = _mm_movemask_epi8(_mm_loadu_si128(marks.as_ptr().add(16).cast()));
            (low as u32) | ((high as u32) << 16)
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    marks.iter().enumerate().fold(0, |bits, (i, mark)| bits | (u32::from(*mark >> 7) << i))
}

/// Asks for levels that will be read soon.
#[inline(always)]
pub(super) fn expect(levels: &[u8]) {
    #[cfg(target_arch = "x86_64")]
    for line in levels.chunks(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: asking for memory reads none, and every x86-64 can.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(line.as_ptr().cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = levels;
}

/// Takes gradients apart and divides them by the parts of their unit.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
pub(super) fn unpack(gradients: &[u32], unit: f32, gx: &mut [f32], gy: &mut [f32]) {
    for ((g, x), y) in gradients.iter().zip(gx).zip(gy) {
        *x = ((*g << 16) as i32 >> 16) as f32 * unit;
        *y = (*g as i32 >> 16) as f32 * unit;
    }
}
