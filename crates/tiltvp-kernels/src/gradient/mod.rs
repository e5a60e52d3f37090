//! Scharr gradients in 16-bit integers, their threshold and their compaction, in one pass over blocks of pixels.

#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod avx512_scharr;
mod block;
mod portable;

use multiversion::multiversion;

#[cfg(target_arch = "x86_64")]
use avx512::Pending;
#[cfg(target_arch = "x86_64")]
use avx512_scharr::VectorLevel;
pub use block::{BLOCK, Directions, KeptPixels, Level, Levels, PixelBlock, REACH, Threshold, place};

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
}

impl GradientLevel for u8 {
    fn portable(levels: &Levels<'_, u8>, blocks: &[PixelBlock], threshold: &Threshold<'_>, kept: &mut KeptPixels<'_>) {
        portable::bytes(levels, blocks, threshold, kept);
    }
}

impl GradientLevel for i16 {
    fn portable(levels: &Levels<'_, i16>, blocks: &[PixelBlock], threshold: &Threshold<'_>, kept: &mut KeptPixels<'_>) {
        portable::words(levels, blocks, threshold, kept);
    }
}

/// The kernel with the widest vectors of this machine.
#[derive(Debug, Clone)]
pub struct GradientKernel(Machine);

#[derive(Debug, Clone)]
enum Machine {
    /// Vectors of 512 bits, and blocks that are not compacted yet.
    #[cfg(target_arch = "x86_64")]
    Avx512(Box<Pending>),
    /// What the compiler makes of loops.
    Portable,
}

impl Default for GradientKernel {
    fn default() -> Self {
        #[cfg(target_arch = "x86_64")]
        if avx512_scharr::is_available() {
            return Self(Machine::Avx512(Box::default()));
        }
        Self(Machine::Portable)
    }
}

impl GradientKernel {
    /// The mask of a block whose pixels are these bits, in the order in which the kernel has its pixels.
    pub fn mask<L: GradientLevel>(&self, pixels: u64) -> u64 {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Machine::Avx512(_) => L::own(pixels),
            Machine::Portable => pixels,
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
            Machine::Portable => L::portable(levels, blocks, threshold, kept),
        }
    }

    /// Keeps what still waits to be compacted.
    pub fn flush<L: GradientLevel>(&mut self, kept: &mut KeptPixels<'_>) {
        match &mut self.0 {
            #[cfg(target_arch = "x86_64")]
            Machine::Avx512(pending) => avx512::flush::<L>(pending, kept),
            Machine::Portable => {
                let _ = kept;
            }
        }
    }
}

/// Divides gradients by the parts of their unit.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl", "x86_64+avx2"))]
pub fn widen_gradients(gradients: &[i16], unit: f32, out: &mut [f32]) {
    for (g, out) in gradients.iter().zip(out) {
        *out = f32::from(*g) * unit;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widened_gradients_are_those_of_a_loop() {
        let gradients: Vec<i16> = (0..1000).map(|i| (i * 97 - 32_000) as i16).collect();
        let mut out = vec![f32::NAN; 1000];
        widen_gradients(&gradients, 0.125, &mut out);
        assert!(gradients.iter().zip(&out).all(|(g, out)| *out == f32::from(*g) * 0.125));
    }
}
