//! Ridges of gradients: the gradients of a row, which of them are greatest across their edge, and where between pixels.

use std::hint::select_unpredictable;

use crate::marks::MARK;
use crate::vectorised;

/// Pixels that are marked together: spans are padded to whole blocks of this many, a vector of bytes of 256 bits.
pub const MARKED: usize = 32;

vectorised! {
    /// The 3x3 Scharr derivatives (3, 10, 3) of the middle row and their squared magnitude; rows are one pixel wider on both sides.
    pub fn scharr(above: &[f32], middle: &[f32], below: &[f32], gx: &mut [f32], gy: &mut [f32], strength: &mut [f32]) {
        let n = gx.len();
        let (above, middle, below) = (&above[..n + 2], &middle[..n + 2], &below[..n + 2]);
        let (gy, strength) = (&mut gy[..n], &mut strength[..n]);
        for i in 0..n {
            let x = 3.0 * ((above[i + 2] - above[i]) + (below[i + 2] - below[i])) + 10.0 * (middle[i + 2] - middle[i]);
            let y = 3.0 * ((below[i] - above[i]) + (below[i + 2] - above[i + 2])) + 10.0 * (below[i + 1] - above[i + 1]);
            gx[i] = x;
            gy[i] = y;
            strength[i] = x * x + y * y;
        }
    }
}

/// The gradients of pixels in whole blocks of [`MARKED`], and the squared magnitudes about them.
#[derive(Debug, Clone, Copy)]
pub struct Around<'a> {
    /// Gradients along `u`.
    pub gx: &'a [f32],
    /// Gradients along `v`.
    pub gy: &'a [f32],
    /// Squared magnitudes of the row above.
    pub above: &'a [f32],
    /// Squared magnitudes of the row, one pixel wider on both sides.
    pub here: &'a [f32],
    /// Squared magnitudes of the row below.
    pub below: &'a [f32],
}

vectorised! {
    /// Marks the pixels whose squared magnitude reaches `least` and is the greatest of three across the edge: in the row
    /// where `|gx| >= |gy|`, in the column elsewhere. The others become zero.
    pub fn mark(around: &Around<'_>, least: f32, marks: &mut [u8]) {
        mark_where(around, least, marks, std::iter::repeat(|_, _, _, _| true));
    }
}

vectorised! {
    /// The same where also `(q . g)^2 <= limit |g|^2`, with a vector `q` for each pixel.
    pub fn mark_directed(around: &Around<'_>, least: f32, vectors: &[[i16; 2]], limit: f32, marks: &mut [u8]) {
        let tests = vectors.as_chunks::<MARKED>().0.iter().map(|vectors| {
            move |i: usize, x: f32, y: f32, strength: f32| {
                let across = f32::from(vectors[i][0]) * x + f32::from(vectors[i][1]) * y;
                across * across <= limit * strength
            }
        });
        mark_where(around, least, marks, tests);
    }
}

/// With a test for each block.
#[inline(always)]
fn mark_where<T: Fn(usize, f32, f32, f32) -> bool>(
    around: &Around<'_>,
    least: f32,
    marks: &mut [u8],
    tests: impl Iterator<Item = T>,
) {
    let blocks = |values| <[f32]>::as_chunks::<MARKED>(values).0.iter();
    let Around { gx, gy, above, here, below } = *around;
    let gradients = blocks(gx).zip(blocks(gy)).zip(blocks(above).zip(blocks(below)));
    let starts = (0..).step_by(MARKED).map_while(|start| here[start..].first_chunk::<{ MARKED + 2 }>());
    for (((gradients, here), marks), passes) in gradients.zip(starts).zip(marks.as_chunks_mut::<MARKED>().0).zip(tests)
    {
        let ((gx, gy), (above, below)) = gradients;
        let mut marked = [0; MARKED];
        for (i, marked) in marked.iter_mut().enumerate() {
            let (x, y, middle) = (gx[i], gy[i], here[i + 1]);
            // Both are looked at: to look at one of two places would take a look for each pixel.
            let in_row = u32::from(middle > here[i]) & u32::from(middle >= here[i + 2]);
            let in_column = u32::from(middle > above[i]) & u32::from(middle >= below[i]);
            let along_row = u32::from(x.abs() >= y.abs());
            let greatest = (along_row & in_row) | ((along_row ^ 1) & in_column);
            *marked = u32::from(middle >= least) & greatest & u32::from(passes(i, x, y, middle));
        }
        for (mark, marked) in marks.iter_mut().zip(marked) {
            *mark = marked as u8 * MARK;
        }
    }
}

/// What is kept of the pixels of a ridge, side by side.
#[derive(Debug)]
pub struct KeptRidge<'a> {
    /// Gradients along `u`.
    pub gx: &'a mut [f32],
    /// Gradients along `v`.
    pub gy: &'a mut [f32],
    /// Squared magnitudes before, at and after the pixels, across their edges.
    pub across: [&'a mut [f32]; 3],
}

/// Writes gradients and magnitudes of the pixels of a row at these places.
pub fn keep(around: &Around<'_>, places: &[u32], out: KeptRidge<'_>) {
    let KeptRidge { gx, gy, across: [before, middle, after] } = out;
    let pixels = gx.iter_mut().zip(gy).zip(before.iter_mut().zip(middle).zip(after)).zip(places);
    for (((gx, gy), ((before, middle), after)), place) in pixels {
        let i = *place as usize;
        let (x, y, here) = (around.gx[i], around.gy[i], &around.here[i..i + 3]);
        // Chosen as whole numbers, for which there is an instruction that guesses nothing.
        let in_row = x.abs() >= y.abs();
        let chosen =
            |row: f32, column: f32| f32::from_bits(select_unpredictable(in_row, row.to_bits(), column.to_bits()));
        (*gx, *gy, *middle) = (x, y, here[1]);
        (*before, *after) = (chosen(here[0], around.above[i]), chosen(here[2], around.below[i]));
    }
}

vectorised! {
    /// Where the parabolas through magnitudes at -1, 0 and 1 are highest, in `[-0.5, 0.5]`; from squared ones.
    pub fn tops(before: &[f32], middle: &[f32], after: &[f32], out: &mut [f32]) {
        let n = out.len();
        let (before, middle, after) = (&before[..n], &middle[..n], &after[..n]);
        for i in 0..n {
            let (before, after) = (before[i].sqrt(), after[i].sqrt());
            let bend = 2.0 * middle[i].sqrt() - before - after;
            let top = (0.5 * (after - before) / bend).clamp(-0.5, 0.5);
            out[i] = if bend > 0.0 { top } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels whose magnitudes tie now and then.
    fn noise(n: usize, seed: u32) -> Vec<f32> {
        let level = |i: usize| (seed + i as u32).wrapping_mul(747_796_405).wrapping_mul(277_803_737) >> 28;
        (0..n).map(|i| level(i) as f32 - 8.0).collect()
    }

    #[test]
    fn the_machine_marks_the_same_pixels_as_a_loop() {
        for n in [0, MARKED, 3 * MARKED, 16 * MARKED] {
            let (gx, gy) = (noise(n, 1), noise(n, 1000));
            let [above, here, below] = [3, 5, 7].map(|seed| noise(n + 2, seed));
            let around = Around { gx: &gx, gy: &gy, above: &above, here: &here, below: &below };
            let vectors: Vec<[i16; 2]> =
                (0..n).map(|i| [(i * 37 % 101) as i16 - 50, (i * 53 % 89) as i16 - 44]).collect();
            let (mut all, mut directed) = (vec![7; n], vec![7; n]);
            mark(&around, 1.0, &mut all);
            mark_directed(&around, 1.0, &vectors, 900.0, &mut directed);
            let (mut places, mut expected) = (Vec::new(), Vec::new());
            for i in 0..n {
                let (x, y, middle) = (gx[i], gy[i], here[i + 1]);
                let (before, after) = if x.abs() >= y.abs() { (here[i], here[i + 2]) } else { (above[i], below[i]) };
                let ridge = middle >= 1.0 && middle > before && middle >= after;
                let across = f32::from(vectors[i][0]) * x + f32::from(vectors[i][1]) * y;
                assert_eq!(all[i], u8::from(ridge) * MARK);
                assert_eq!(directed[i], u8::from(ridge && across * across <= 900.0 * middle) * MARK);
                if ridge {
                    places.push(i as u32);
                    expected.push([x, y, before, middle, after]);
                }
            }
            let mut kept = [(); 5].map(|()| vec![f32::NAN; places.len()]);
            let [gx, gy, before, middle, after] = kept.each_mut().map(|values| &mut values[..]);
            keep(&around, &places, KeptRidge { gx, gy, across: [before, middle, after] });
            for (i, expected) in expected.iter().enumerate() {
                assert_eq!(kept.each_ref().map(|values| values[i]), *expected);
            }
        }
    }

    #[test]
    fn gradients_are_those_of_the_kernel_written_out() {
        let n = 203;
        let [above, middle, below] = [1, 400, 900].map(|seed| noise(n + 2, seed));
        let [mut gx, mut gy, mut strength] = [(); 3].map(|()| vec![f32::NAN; n]);
        scharr(&above, &middle, &below, &mut gx, &mut gy, &mut strength);
        for i in 0..n {
            let at = |row: &[f32], k: usize| row[i + k];
            let along = |row: &[f32]| at(row, 2) - at(row, 0);
            let down = |k: usize| at(&below, k) - at(&above, k);
            // Whole numbers: exact in any order.
            let x = 3.0 * along(&above) + 10.0 * along(&middle) + 3.0 * along(&below);
            let y = 3.0 * down(0) + 10.0 * down(1) + 3.0 * down(2);
            assert_eq!((gx[i], gy[i], strength[i]), (x, y, x * x + y * y));
        }
    }

    #[test]
    fn tops_are_those_of_parabolas() {
        let (before, middle, after) = ([4.0, 9.0, 1.0, 4.0], [9.0, 9.0, 1.0, 4.0], [4.0, 4.0, 1.0, 9.0]);
        let mut out = [f32::NAN; 4];
        tops(&before, &middle, &after, &mut out);
        assert_eq!(out, [0.0, -0.5, 0.0, 0.0]);
        let (before, middle, after) = (noise(300, 1), noise(300, 400), noise(300, 900));
        let squared = |values: &[f32]| values.iter().map(|x| x * x).collect::<Vec<_>>();
        let mut out = vec![f32::NAN; 300];
        tops(&squared(&before), &squared(&middle), &squared(&after), &mut out);
        for i in 0..300 {
            let [a, b, c] = [before[i], middle[i], after[i]].map(f32::abs);
            let bend = 2.0 * b - a - c;
            let top = if bend > 0.0 { (0.5 * (c - a) / bend).clamp(-0.5, 0.5) } else { 0.0 };
            assert_eq!(out[i].to_bits(), top.to_bits());
        }
    }
}
