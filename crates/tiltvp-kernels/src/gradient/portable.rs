//! The kernel in loops that the compiler makes vectors of, for every machine.

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
    for block in blocks {
        gradients_of(levels.around(block, &mut rest), &mut all);
        for i in 0..BLOCK {
            all.marks[i] = if all.squared[i] >= threshold.at_least { MARK } else { 0 };
        }
        let mut passing = bits(&all.marks) & block.own;
        kept.strong += passing.count_ones() as usize;
        if passing == 0 {
            continue;
        }
        match threshold.directions {
            Directions::None => {}
            Directions::Each(each) => {
                let each = each.get(block.slot as usize..).unwrap_or(&[]);
                passing &= if let Some(each) = each.first_chunk() {
                    directed(each, &mut all, threshold.limit)
                } else {
                    let mut rest = [[0; 2]; BLOCK];
                    rest[..each.len()].copy_from_slice(each);
                    directed(&rest, &mut all, threshold.limit)
                };
            }
            Directions::From { centre: [u, v], parts } => {
                let away = |x: u32, centre: i32| (x as i32 * i32::from(parts)).wrapping_sub(centre) as i16;
                let (first, y) = (away(block.place & 0xffff, u), away(block.place >> 16, v));
                let mut line = [[0, y]; BLOCK];
                for (i, vector) in line.iter_mut().enumerate() {
                    vector[0] = first.wrapping_add(parts.wrapping_mul(i as i16));
                }
                passing &= directed(&line, &mut all, threshold.limit);
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

/// One bit for each pixel whose gradient has an allowed direction.
#[inline(always)]
fn directed(vectors: &[[i16; 2]; BLOCK], all: &mut Gradients, limit: f32) -> u64 {
    for (i, vector) in vectors.iter().enumerate() {
        let (x, y) = (i32::from(vector[0]), i32::from(vector[1]));
        let across = (x * i32::from(all.gx[i])).wrapping_add(y * i32::from(all.gy[i])) as f32;
        all.marks[i] = if across * across <= limit * all.squared[i] as f32 { MARK } else { 0 };
    }
    bits(&all.marks)
}
