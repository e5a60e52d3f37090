//! The inner loop of edge detection: Scharr gradients in 16-bit integers, threshold and screen, compacted.

use multiversion::multiversion;

use super::block::{BLOCK, Block, Kept, Level, Levels, Test, place};
use super::region::Region;
#[cfg(target_arch = "x86_64")]
use super::sieve_avx512::{self, Waiting};
use super::sieve_portable::{portable_bytes, portable_words};
#[cfg(target_arch = "x86_64")]
use super::slopes_avx512::{self, VectorLevel};

/// Stands where there are no kernels but the portable one.
#[cfg(not(target_arch = "x86_64"))]
pub(super) trait VectorLevel {}
#[cfg(not(target_arch = "x86_64"))]
impl<L> VectorLevel for L {}

/// A level for which there are kernels.
pub(super) trait Sifted: Level + VectorLevel {
    /// The portable kernel for such levels.
    fn portable(levels: &Levels<'_, Self>, blocks: &[Block], test: &Test<'_>, kept: &mut Kept<'_>);
}

impl Sifted for u8 {
    fn portable(levels: &Levels<'_, Self>, blocks: &[Block], test: &Test<'_>, kept: &mut Kept<'_>) {
        portable_bytes(levels, blocks, test, kept);
    }
}

impl Sifted for i16 {
    fn portable(levels: &Levels<'_, Self>, blocks: &[Block], test: &Test<'_>, kept: &mut Kept<'_>) {
        portable_words(levels, blocks, test, kept);
    }
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
        if slopes_avx512::is_available() {
            return Self::Avx512(Box::default());
        }
        Self::Portable
    }

    /// The spans of a region in blocks, in slot order.
    pub(super) fn blocks<L: Sifted>(&self, region: &Region) -> Vec<Block> {
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
    pub(super) fn sift<L: Sifted>(
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
    pub(super) fn finish<L: Sifted>(&mut self, kept: &mut Kept<'_>) {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(waiting) => sieve_avx512::finish::<L>(waiting, kept),
            Self::Portable => {
                let _ = kept;
            }
        }
    }
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
