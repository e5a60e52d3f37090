//! The inner loop of edge detection: Scharr gradients in 16-bit integers, threshold and screen, compacted.

use multiversion::multiversion;

use super::region::Region;
#[cfg(target_arch = "x86_64")]
use super::sieve_avx512::{self, VectorLevel, Waiting};

/// Pixels of a block, which are tested together, and how far beyond the end of what they keep the kernels may write.
pub(super) const BLOCK: usize = 64;

/// A grey level as the kernels read it.
pub(super) trait Level: Copy + Default + VectorLevel {
    /// Levels, and so gradients, are in this many parts of a grey level.
    const PARTS: i32;
    /// The level as a signed number.
    fn signed(self) -> i16;
    /// The portable kernel for such levels.
    fn portable(levels: &Levels<'_, Self>, blocks: &[Block], test: &Test<'_>, kept: &mut Kept<'_>);
}

/// Stands where there are no kernels but the portable one.
#[cfg(not(target_arch = "x86_64"))]
pub(super) trait VectorLevel {}
#[cfg(not(target_arch = "x86_64"))]
impl<L> VectorLevel for L {}

/// Grey levels as they are: gradients up to 4080.
impl Level for u8 {
    const PARTS: i32 = 1;

    #[inline(always)]
    fn signed(self) -> i16 {
        i16::from(self)
    }

    fn portable(levels: &Levels<'_, Self>, blocks: &[Block], test: &Test<'_>, kept: &mut Kept<'_>) {
        portable_bytes(levels, blocks, test, kept);
    }
}

/// Smoothed levels in units of 1/8, up to 255: gradients in units of 1/8, up to 32640.
impl Level for i16 {
    const PARTS: i32 = 8;

    #[inline(always)]
    fn signed(self) -> i16 {
        self
    }

    fn portable(levels: &Levels<'_, Self>, blocks: &[Block], test: &Test<'_>, kept: &mut Kept<'_>) {
        portable_words(levels, blocks, test, kept);
    }
}

/// Rows of levels: all of an image, or the last few of one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Levels<'a, L> {
    pub data: &'a [L],
    /// From the begin of a row to that of the next.
    pub stride: usize,
    /// Row `v` is in place `v & places`.
    pub places: usize,
    /// Column at which rows begin.
    pub left: usize,
}

/// Levels that the gradients of a block are made of, row by row.
pub(super) const REACH: usize = BLOCK + 2;

impl<'a, L: Level> Levels<'a, L> {
    /// The levels above, beside and below the pixels of a block, from one pixel to the left of its first: [`REACH`] each, in
    /// `rest` those that there are near the end of the data.
    #[inline(always)]
    pub(super) fn around(&self, block: &Block, rest: &'a mut [[L; REACH]; 3]) -> [&'a [L; REACH]; 3] {
        let (u, v) = ((block.place & 0xffff) as usize, (block.place >> 16) as usize);
        let column = u - 1 - self.left;
        if self.places == usize::MAX {
            // All three are within what spans them, which is the one thing to look at.
            let first = (v - 1) * self.stride + column;
            let span = self.data.get(first..first + 2 * self.stride + REACH);
            let row = |k: usize| span.and_then(|span| span.get(k * self.stride..).and_then(<[L]>::first_chunk));
            if let (Some(a), Some(m), Some(b)) = (row(0), row(1), row(2)) {
                return [a, m, b];
            }
        }
        let [a, m, b] = [v - 1, v, v + 1].map(|v| (v & self.places) * self.stride + column);
        let whole = |at: usize| self.data.get(at..at + REACH).and_then(<[L]>::first_chunk);
        if let (Some(a), Some(m), Some(b)) = (whole(a), whole(m), whole(b)) {
            return [a, m, b];
        }
        for (at, rest) in [a, m, b].into_iter().zip(rest.iter_mut()) {
            let there = self.data.get(at..).unwrap_or(&[]);
            let n = there.len().min(REACH);
            rest[..n].copy_from_slice(&there[..n]);
        }
        [&rest[0], &rest[1], &rest[2]]
    }
}

/// Some pixels of a span, at most [`BLOCK`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    /// One bit for each pixel, in the order of the kernels' masks.
    pub own: u64,
    /// Number of the first pixel within the region.
    pub slot: u32,
    /// Its place, see [`place`].
    pub place: u32,
}

impl Block {
    /// The row.
    pub(super) fn v(&self) -> usize {
        (self.place >> 16) as usize
    }
}

/// Row in the upper half, column in the lower.
#[inline(always)]
pub(super) fn place(v: usize, u: usize) -> u32 {
    ((v as u32) << 16) | u as u32
}

/// What a gradient `g` must pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Test<'a> {
    /// The least squared gradient, above zero.
    pub at_least: i32,
    /// The vectors `q` of the region's pixels, if there is a screen.
    pub vectors: Vectors<'a>,
    /// The largest `(q . g)^2 / |g|^2`.
    pub limit: f32,
}

/// The screening vectors of a region.
#[derive(Debug, Clone, Copy)]
pub(super) enum Vectors<'a> {
    /// No screen.
    None,
    /// One for each pixel.
    Each(&'a [[i16; 2]]),
    /// The way from a point to the pixel, in so many parts of a pixel, in which the point is given too.
    From { centre: [i32; 2], parts: i16 },
}

/// Where the kernels write: the numbers of pixels, their places and their gradients. There must be room for all pixels and two
/// blocks more.
pub(super) struct Kept<'a> {
    pub slots: &'a mut [u32],
    pub places: &'a mut [u32],
    pub gx: &'a mut [i16],
    pub gy: &'a mut [i16],
    /// How many are kept.
    pub len: usize,
    /// How many were strong.
    pub strong: usize,
}

/// The kernels with the widest vectors of this machine.
#[derive(Debug, Clone)]
pub(super) enum Sieve {
    /// Vectors of 512 bits, and blocks that are not compacted yet.
    #[cfg(target_arch = "x86_64")]
    Avx512(Box<Waiting>),
    /// What the compiler makes of loops.
    Portable,
}

impl Sieve {
    /// That of this machine.
    pub(super) fn new() -> Self {
        #[cfg(target_arch = "x86_64")]
        if sieve_avx512::is_available() {
            return Self::Avx512(Box::default());
        }
        Self::Portable
    }

    /// The spans of a region in blocks, in slot order.
    pub(super) fn blocks<L: Level>(&self, region: &Region) -> Vec<Block> {
        let mut blocks = Vec::new();
        for span in region.spans() {
            for first in (span.first..span.end).step_by(BLOCK) {
                let own = u64::MAX >> (first + BLOCK).saturating_sub(span.end);
                let own = match self {
                    #[cfg(target_arch = "x86_64")]
                    Self::Avx512(_) => L::own(own),
                    Self::Portable => own,
                };
                let slot = (span.slot + first - span.first) as u32;
                blocks.push(Block { own, slot, place: place(span.v, first) });
            }
        }
        blocks
    }

    /// Keeps those pixels of the blocks whose gradients pass, now or by the time of [`finish`](Self::finish).
    pub(super) fn sift<L: Level>(
        &mut self,
        levels: &Levels<'_, L>,
        blocks: &[Block],
        test: &Test<'_>,
        kept: &mut Kept<'_>,
    ) {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(waiting) => sieve_avx512::sift(levels, blocks, test, waiting, kept),
            Self::Portable => L::portable(levels, blocks, test, kept),
        }
    }

    /// Keeps what still waits.
    pub(super) fn finish<L: Level>(&mut self, kept: &mut Kept<'_>) {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(waiting) => sieve_avx512::finish::<L>(waiting, kept),
            Self::Portable => {
                let _ = kept;
            }
        }
    }
}

macro_rules! portable {
    ($name:ident, $level:ty) => {
        #[multiversion(targets("x86_64+avx2+bmi1+bmi2", "x86_64+sse4.1"))]
        pub(super) fn $name(levels: &Levels<'_, $level>, blocks: &[Block], test: &Test<'_>, kept: &mut Kept<'_>) {
            portable_body(levels, blocks, test, kept);
        }
    };
}

portable!(portable_bytes, u8);
portable!(portable_words, i16);

#[inline(always)]
fn portable_body<L: Level>(levels: &Levels<'_, L>, blocks: &[Block], test: &Test<'_>, kept: &mut Kept<'_>) {
    let mut all = Gradients::default();
    let mut rest = [[L::default(); REACH]; 3];
    for block in blocks {
        gradients_of(levels.around(block, &mut rest), &mut all);
        for i in 0..BLOCK {
            all.marks[i] = if all.squared[i] >= test.at_least { 0x80 } else { 0 };
        }
        let mut passing = bits(&all.marks) & block.own;
        kept.strong += passing.count_ones() as usize;
        if passing == 0 {
            continue;
        }
        match test.vectors {
            Vectors::None => {}
            Vectors::Each(each) => {
                let each = each.get(block.slot as usize..).unwrap_or(&[]);
                passing &= if let Some(each) = each.first_chunk() {
                    screened(each, &mut all, test.limit)
                } else {
                    let mut rest = [[0; 2]; BLOCK];
                    rest[..each.len()].copy_from_slice(each);
                    screened(&rest, &mut all, test.limit)
                };
            }
            Vectors::From { centre: [u, v], parts } => {
                let away = |x: u32, centre: i32| (x as i32 * i32::from(parts)).wrapping_sub(centre) as i16;
                let (first, y) = (away(block.place & 0xffff, u), away(block.place >> 16, v));
                let mut line = [[0, y]; BLOCK];
                for (i, vector) in line.iter_mut().enumerate() {
                    vector[0] = first.wrapping_add(parts.wrapping_mul(i as i16));
                }
                passing &= screened(&line, &mut all, test.limit);
            }
        }
        while passing != 0 {
            let (i, len) = (passing.trailing_zeros(), kept.len);
            (kept.slots[len], kept.places[len]) = (block.slot + i, block.place + i);
            (kept.gx[len], kept.gy[len]) = (all.gx[i as usize], all.gy[i as usize]);
            kept.len += 1;
            passing &= passing - 1;
        }
    }
}

/// The gradients of some pixels, their squares, and marks in the uppermost bit.
struct Gradients {
    gx: [i16; BLOCK],
    gy: [i16; BLOCK],
    squared: [i32; BLOCK],
    marks: [u8; BLOCK],
}

impl Default for Gradients {
    fn default() -> Self {
        Self { gx: [0; BLOCK], gy: [0; BLOCK], squared: [0; BLOCK], marks: [0; BLOCK] }
    }
}

#[inline(always)]
fn gradients_of<L: Level>([a, m, b]: [&[L; REACH]; 3], all: &mut Gradients) {
    // What lies beside a span may be anything.
    let less = |a: L, b: L| a.signed().wrapping_sub(b.signed());
    let weighted = |sides: i16, middle: i16| sides.wrapping_mul(3).wrapping_add(middle.wrapping_mul(10));
    for i in 0..BLOCK {
        let sides = less(a[i + 2], a[i]).wrapping_add(less(b[i + 2], b[i]));
        all.gx[i] = weighted(sides, less(m[i + 2], m[i]));
    }
    for i in 0..BLOCK {
        let sides = less(b[i], a[i]).wrapping_add(less(b[i + 2], a[i + 2]));
        all.gy[i] = weighted(sides, less(b[i + 1], a[i + 1]));
    }
    for i in 0..BLOCK {
        let (x, y) = (i32::from(all.gx[i]), i32::from(all.gy[i]));
        all.squared[i] = (x * x).wrapping_add(y * y);
    }
}

/// One bit for each pixel that passes the screen.
#[inline(always)]
fn screened(vectors: &[[i16; 2]; BLOCK], all: &mut Gradients, limit: f32) -> u64 {
    for (i, vector) in vectors.iter().enumerate() {
        let (x, y) = (i32::from(vector[0]), i32::from(vector[1]));
        let across = (x * i32::from(all.gx[i])).wrapping_add(y * i32::from(all.gy[i])) as f32;
        all.marks[i] = if across * across <= limit * all.squared[i] as f32 { 0x80 } else { 0 };
    }
    bits(&all.marks)
}

/// The uppermost bit of each mark.
#[inline(always)]
fn bits(marks: &[u8; BLOCK]) -> u64 {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_mm_loadu_si128, _mm_movemask_epi8};
        marks.as_chunks::<16>().0.iter().rev().fold(0, |bits, marks| {
            // SAFETY: there are 16 marks, and SSE2 is part of every x86-64.
            let word = unsafe { _mm_movemask_epi8(_mm_loadu_si128(marks.as_ptr().cast())) };
            (bits << 16) | u64::from(word as u32)
        })
    }
    #[cfg(not(target_arch = "x86_64"))]
    marks.iter().enumerate().fold(0, |bits, (i, mark)| bits | (u64::from(*mark >> 7) << i))
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

/// Divides gradients by the parts of their unit.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl", "x86_64+avx2"))]
pub(super) fn widen(gradients: &[i16], unit: f32, out: &mut [f32]) {
    for (g, out) in gradients.iter().zip(out) {
        *out = f32::from(*g) * unit;
    }
}
