//! Marks of pixels, a byte each, as bits of a word and as places.

/// A marked pixel's byte: its uppermost bit alone.
pub const MARK: u8 = 0x80;

/// Marks of one word.
const WORD: usize = 64;

/// Places that are written at a time, whether there are so many or not: less is guessed so.
const TOGETHER: usize = 4;

/// How many more places than marks there must be room for.
pub const BEYOND: usize = TOGETHER;

/// The uppermost bit of each mark.
#[inline(always)]
pub(crate) fn bits(marks: &[u8; WORD]) -> u64 {
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

/// Writes the places of the marked in order and returns how many there are. What follows them in `out` may be anything.
///
/// # Panics
/// Unless there is room for [`BEYOND`] more places than marks.
pub fn places(marks: &[u8], out: &mut [u32]) -> usize {
    assert!(out.len() >= marks.len() + BEYOND);
    let (words, rest) = marks.as_chunks::<WORD>();
    let mut last = [0; WORD];
    last[..rest.len()].copy_from_slice(rest);
    let mut count = 0;
    for (word, start) in words.iter().chain(std::iter::once(&last)).zip((0..).step_by(WORD)) {
        let mut bits = bits(word);
        let end = count + bits.count_ones() as usize;
        while count < end {
            for out in &mut out[count..count + TOGETHER] {
                *out = start + bits.trailing_zeros();
                bits &= bits.wrapping_sub(1);
            }
            count += TOGETHER;
        }
        count = end;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_of_the_marks() {
        for n in (0..200).chain([1000]) {
            for stride in [1, 2, 3, 7, 64, 65, 2000] {
                let marks: Vec<u8> = (0..n).map(|i| if i % stride == 0 { MARK } else { 0 }).collect();
                let mut found = vec![u32::MAX; n + BEYOND];
                let count = places(&marks, &mut found);
                let expected: Vec<u32> = (0..n as u32).step_by(stride).collect();
                assert_eq!(found[..count], expected);
            }
        }
    }
}
