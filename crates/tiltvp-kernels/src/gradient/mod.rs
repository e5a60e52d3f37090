//! Scharr gradients in 16-bit integers, their threshold and their compaction, in one pass over blocks of pixels.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod avx512_scharr;
mod block;
mod portable;

use crate::vectorised;

#[cfg(target_arch = "x86_64")]
use avx512::Pending;
#[cfg(target_arch = "x86_64")]
use avx512_scharr::VectorLevel;
pub use block::{BLOCK, Directions, KeptPixels, Level, Levels, PixelBlock, REACH, Threshold, place};
#[cfg(target_arch = "x86_64")]
use fearless_simd::Avx2;

/// Stands where there are no kernels but the portable one.
#[cfg(not(target_arch = "x86_64"))]
trait VectorLevel {}
#[cfg(not(target_arch = "x86_64"))]
impl<L> VectorLevel for L {}

/// A level for which there are kernels.
#[expect(private_bounds, reason = "only the two levels that there are have kernels")]
pub trait GradientLevel: Level + VectorLevel {
    /// The portable kernel for such levels.
    #[doc(hidden)]
    fn portable(levels: &Levels<'_, Self>, blocks: &[PixelBlock], threshold: &Threshold<'_>, kept: &mut KeptPixels<'_>);

    /// The kernel of 256 bits for such levels.
    #[cfg(target_arch = "x86_64")]
    #[doc(hidden)]
    const AVX2: Kernel256<Self>;
}

/// A kernel of 256 bits.
#[cfg(target_arch = "x86_64")]
type Kernel256<L> = fn(Avx2, &Levels<'_, L>, &[PixelBlock], &Threshold<'_>, &mut KeptPixels<'_>);

impl GradientLevel for u8 {
    fn portable(levels: &Levels<'_, u8>, blocks: &[PixelBlock], threshold: &Threshold<'_>, kept: &mut KeptPixels<'_>) {
        portable::bytes(levels, blocks, threshold, kept);
    }

    #[cfg(target_arch = "x86_64")]
    const AVX2: Kernel256<Self> = avx2::bytes;
}

impl GradientLevel for i16 {
    fn portable(levels: &Levels<'_, i16>, blocks: &[PixelBlock], threshold: &Threshold<'_>, kept: &mut KeptPixels<'_>) {
        portable::words(levels, blocks, threshold, kept);
    }

    #[cfg(target_arch = "x86_64")]
    const AVX2: Kernel256<Self> = avx2::words;
}

/// The kernel with the widest vectors of the level.
#[derive(Debug, Clone)]
pub struct GradientKernel(Machine);

#[derive(Debug, Clone)]
enum Machine {
    /// Vectors of 512 bits, and blocks that are not compacted yet.
    #[cfg(target_arch = "x86_64")]
    Avx512(Box<Pending>),
    /// Vectors of 256 bits.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// What the compiler makes of loops.
    Portable,
}

impl Default for GradientKernel {
    fn default() -> Self {
        #[cfg(target_arch = "x86_64")]
        if avx512_scharr::is_available() {
            return Self(Machine::Avx512(Box::default()));
        }
        #[cfg(target_arch = "x86_64")]
        if let Some(token) = crate::level::loops().as_avx2() {
            return Self(Machine::Avx2(token));
        }
        Self(Machine::Portable)
    }
}

impl GradientKernel {
    /// Every kernel that this machine can run at this level.
    #[cfg(test)]
    fn all() -> Vec<Self> {
        let mut all = vec![Self::default(), Self(Machine::Portable)];
        #[cfg(target_arch = "x86_64")]
        all.extend(crate::level::loops().as_avx2().map(|token| Self(Machine::Avx2(token))));
        all
    }

    /// The mask of a block whose pixels are these bits, in the order in which the kernel has its pixels.
    pub fn mask<L: GradientLevel>(&self, pixels: u64) -> u64 {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Machine::Avx512(_) => L::own(pixels),
            _ => pixels,
        }
    }

    /// Keeps those pixels of the blocks whose gradients pass the threshold, now or by the time of [`flush`](Self::flush).
    pub fn run<L: GradientLevel>(
        &mut self,
        levels: &Levels<'_, L>,
        blocks: &[PixelBlock],
        threshold: &Threshold<'_>,
        kept: &mut KeptPixels<'_>,
    ) {
        match &mut self.0 {
            #[cfg(target_arch = "x86_64")]
            Machine::Avx512(pending) => avx512::threshold_blocks(levels, blocks, threshold, pending, kept),
            #[cfg(target_arch = "x86_64")]
            Machine::Avx2(token) => L::AVX2(*token, levels, blocks, threshold, kept),
            Machine::Portable => L::portable(levels, blocks, threshold, kept),
        }
    }

    /// Keeps what still waits to be compacted.
    pub fn flush<L: GradientLevel>(&mut self, kept: &mut KeptPixels<'_>) {
        match &mut self.0 {
            #[cfg(target_arch = "x86_64")]
            Machine::Avx512(pending) => avx512::flush::<L>(pending, kept),
            _ => {
                let _ = kept;
            }
        }
    }
}

vectorised! {
    /// Divides gradients by the parts of their unit.
    pub fn widen_gradients(gradients: &[i16], unit: f32, out: &mut [f32]) {
        for (g, out) in gradients.iter().zip(out) {
            *out = f32::from(*g) * unit;
        }
    }
}

#[cfg(test)]
mod tests;
