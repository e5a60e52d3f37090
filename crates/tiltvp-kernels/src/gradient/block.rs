//! What the gradient kernels work on: rows of levels, blocks of pixels, thresholds, and where the pixels that pass are kept.

/// Pixels of a block, one for each bit of a mask, which are tested together, and how far beyond the end of what they keep the kernels may write.
pub const BLOCK: usize = 64;

/// A grey level as the kernels read it.
pub trait Level: Copy + Default {
    /// Levels, and so gradients, are in this many parts of a grey level.
    const PARTS: i32;
    /// The level as a signed number.
    fn signed(self) -> i16;
}

/// Grey levels as they are: gradients up to 4080.
impl Level for u8 {
    const PARTS: i32 = 1;

    #[inline(always)]
    fn signed(self) -> i16 {
        i16::from(self)
    }
}

/// Smoothed levels in units of 1/8, up to 255: gradients in units of 1/8, up to 32640.
impl Level for i16 {
    const PARTS: i32 = 8;

    #[inline(always)]
    fn signed(self) -> i16 {
        self
    }
}

/// Rows of levels: all of an image, or the last few of one.
#[derive(Debug, Clone, Copy)]
pub struct Levels<'a, L> {
    /// The levels.
    pub data: &'a [L],
    /// From the begin of a row to that of the next.
    pub stride: usize,
    /// Row `v` is in place `v & places`.
    pub places: usize,
    /// Column at which rows begin.
    pub left: usize,
}

/// Levels that the gradients of a block are made of, row by row.
pub const REACH: usize = BLOCK + 2;

impl<'a, L: Level> Levels<'a, L> {
    /// The levels above, beside and below the pixels of a block, from one pixel to the left of its first: [`REACH`] each, in
    /// `rest` those that there are near the end of the data.
    #[inline(always)]
    pub fn around(&self, block: &PixelBlock, rest: &'a mut [[L; REACH]; 3]) -> [&'a [L; REACH]; 3] {
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
pub struct PixelBlock {
    /// One bit for each pixel, in the order of the kernels' masks.
    pub own: u64,
    /// Number of the first pixel within the region.
    pub slot: u32,
    /// Its place, see [`place`].
    pub place: u32,
}

impl PixelBlock {
    /// The row.
    #[inline]
    pub fn v(&self) -> usize {
        (self.place >> 16) as usize
    }
}

/// Row in the upper half, column in the lower.
#[inline(always)]
pub fn place(v: usize, u: usize) -> u32 {
    ((v as u32) << 16) | u as u32
}

/// What a gradient `g` must pass: a magnitude, and a direction.
#[derive(Debug, Clone, Copy)]
pub struct Threshold<'a> {
    /// The least squared gradient, above zero.
    pub at_least: i32,
    /// The vectors `q` that directions are compared with.
    pub directions: Directions<'a>,
    /// The largest `(q . g)^2 / |g|^2`.
    pub limit: f32,
}

/// The vectors that the directions of gradients are compared with.
#[derive(Debug, Clone, Copy)]
pub enum Directions<'a> {
    /// Any direction passes.
    None,
    /// One for each pixel, by its slot.
    Each(&'a [[i16; 2]]),
    /// The way from a point to the pixel, in so many parts of a pixel, in which the point is given too.
    From {
        /// The point.
        centre: [i32; 2],
        /// Parts of a pixel.
        parts: i16,
    },
}

/// Where the kernels write: the numbers of pixels, their places and their gradients. There must be room for all pixels and two
/// blocks more.
pub struct KeptPixels<'a> {
    /// Numbers of the pixels.
    pub slots: &'a mut [u32],
    /// Their places.
    pub places: &'a mut [u32],
    /// Gradients along `u`.
    pub gx: &'a mut [i16],
    /// Gradients along `v`.
    pub gy: &'a mut [i16],
    /// How many are kept.
    pub len: usize,
    /// How many were strong.
    pub strong: usize,
}

/// Pixels that are compacted at once, whether there are so many or not: the loop's end is guessed wrong less often. Only time depends
/// on it.
const AT_ONCE: usize = 8;

impl KeptPixels<'_> {
    /// Appends the pixels of the mask, with gradients along both axes in rows of a power of two. Where that of each pixel is stands in
    /// `places`; that of none may be any.
    #[inline(always)]
    pub(super) fn append<const ROW: usize>(
        &mut self,
        block: &PixelBlock,
        passing: u64,
        [x, y]: [&[i16; ROW]; 2],
        places: &[u8; BLOCK + 1],
    ) {
        let room = self.len..self.len + BLOCK;
        let to_slots = self.slots[room.clone()].as_chunks_mut::<AT_ONCE>().0;
        let to_places = self.places[room.clone()].as_chunks_mut::<AT_ONCE>().0;
        let gx = self.gx[room.clone()].as_chunks_mut::<AT_ONCE>().0;
        let gy = self.gy[room].as_chunks_mut::<AT_ONCE>().0;
        let mut waiting = passing;
        for ((to_slots, to_places), (gx, gy)) in to_slots.iter_mut().zip(to_places).zip(gx.iter_mut().zip(gy)) {
            for k in 0..AT_ONCE {
                // When none waits any longer, what is written does not count.
                let i = waiting.trailing_zeros();
                let from = usize::from(places[i as usize]) % ROW;
                (to_slots[k], to_places[k]) = (block.slot.wrapping_add(i), block.place.wrapping_add(i));
                (gx[k], gy[k]) = (x[from], y[from]);
                waiting &= waiting.wrapping_sub(1);
            }
            if waiting == 0 {
                break;
            }
        }
        self.len += passing.count_ones() as usize;
    }
}
