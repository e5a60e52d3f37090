//! [`sieve`](super::sieve) with vectors of 512 bits: gradients of 32 or 64 pixels at a time, compacted by the machine's own
//! instruction.

use std::arch::x86_64::{
    __m512, __m512i, __mmask16, _CMP_LE_OQ, _mm512_add_epi16, _mm512_add_epi32, _mm512_cmpge_epi32_mask,
    _mm512_cvtepi32_ps, _mm512_loadu_si512, _mm512_madd_epi16, _mm512_maddubs_epi16, _mm512_mask_cmp_ps_mask,
    _mm512_maskz_compress_epi32, _mm512_maskz_loadu_epi8, _mm512_maskz_loadu_epi16, _mm512_maskz_loadu_epi32,
    _mm512_mul_ps, _mm512_mulhrs_epi16, _mm512_mullo_epi16, _mm512_permutexvar_epi64, _mm512_set1_epi16,
    _mm512_set1_epi32, _mm512_set1_ps, _mm512_setr_epi32, _mm512_setr_epi64, _mm512_setzero_si512,
    _mm512_shuffle_i32x4, _mm512_storeu_si512, _mm512_sub_epi16, _mm512_unpackhi_epi8, _mm512_unpackhi_epi16,
    _mm512_unpacklo_epi8, _mm512_unpacklo_epi16,
};

use super::sieve::{BLOCK, Kept, Level, Rows, TEN, THREE, Test, Vectors};

/// Whether this machine has them.
#[inline]
pub(super) fn is_available() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("popcnt")
}

/// A level of which many are read at once.
pub(super) trait VectorLevel: Level {
    /// How many, at most 64.
    const AT_ONCE: usize;

    /// The gradients of the pixels between and below the pointers' and one to the right, as words of `gy` and `gx`, 16 to a
    /// vector in order. With `MASKED` only the pixels of the mask count.
    ///
    /// # Safety
    /// The levels of the pixels (of the mask) and of the two columns to the right must be readable, and the machine must be as
    /// [`is_available`] asks.
    unsafe fn gradients<const MASKED: bool>(rows: [*const Self; 3], mask: u64) -> [__m512i; 4];
}

/// Bytes are multiplied by 3 or 10 with both signs and added in pairs.
impl VectorLevel for u8 {
    const AT_ONCE: usize = 64;

    #[inline(always)]
    unsafe fn gradients<const MASKED: bool>([above, middle, below]: [*const u8; 3], mask: u64) -> [__m512i; 4] {
        // SAFETY: the caller vouches for the levels and the machine.
        unsafe {
            let [a0, a1, a2] = bytes::<MASKED>(above, mask);
            let [m0, _, m2] = bytes::<MASKED>(middle, mask);
            let [b0, b1, b2] = bytes::<MASKED>(below, mask);
            let x = weighted_bytes([(a0, a2), (b0, b2), (m0, m2)]);
            let y = weighted_bytes([(a0, b0), (a2, b2), (a1, b1)]);
            // Pixels 0 to 3 of every 16, then 4 to 7, and so on: the registers' quarters are transposed.
            let (v0, v1) = (_mm512_unpacklo_epi16(x[0], y[0]), _mm512_unpackhi_epi16(x[0], y[0]));
            let (v2, v3) = (_mm512_unpacklo_epi16(x[1], y[1]), _mm512_unpackhi_epi16(x[1], y[1]));
            let (t0, t1) = (_mm512_shuffle_i32x4::<0x44>(v0, v1), _mm512_shuffle_i32x4::<0xee>(v0, v1));
            let (t2, t3) = (_mm512_shuffle_i32x4::<0x44>(v2, v3), _mm512_shuffle_i32x4::<0xee>(v2, v3));
            [
                _mm512_shuffle_i32x4::<0x88>(t0, t2),
                _mm512_shuffle_i32x4::<0xdd>(t0, t2),
                _mm512_shuffle_i32x4::<0x88>(t1, t3),
                _mm512_shuffle_i32x4::<0xdd>(t1, t3),
            ]
        }
    }
}

/// 64 levels, those one to the right, and two.
///
/// # Safety
/// See [`VectorLevel::gradients`].
#[inline(always)]
unsafe fn bytes<const MASKED: bool>(row: *const u8, mask: u64) -> [__m512i; 3] {
    // SAFETY: the caller vouches for the levels and the machine; levels beyond the mask are not read.
    unsafe {
        if MASKED {
            [
                _mm512_maskz_loadu_epi8(mask, row.cast()),
                _mm512_maskz_loadu_epi8(mask, row.add(1).cast()),
                _mm512_maskz_loadu_epi8(mask, row.add(2).cast()),
            ]
        } else {
            [
                _mm512_loadu_si512(row.cast()),
                _mm512_loadu_si512(row.add(1).cast()),
                _mm512_loadu_si512(row.add(2).cast()),
            ]
        }
    }
}

/// Three parts of the first two differences and ten of the last: of bytes 0 to 7 of every 16, and of 8 to 15.
///
/// # Safety
/// See [`VectorLevel::gradients`].
#[inline(always)]
unsafe fn weighted_bytes([p, q, r]: [(__m512i, __m512i); 3]) -> [__m512i; 2] {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        // Minus in the lower byte of a pair.
        let (three, ten) = (_mm512_set1_epi16(0x03fd), _mm512_set1_epi16(0x0af6));
        let low = _mm512_add_epi16(
            _mm512_add_epi16(
                _mm512_maddubs_epi16(_mm512_unpacklo_epi8(p.0, p.1), three),
                _mm512_maddubs_epi16(_mm512_unpacklo_epi8(q.0, q.1), three),
            ),
            _mm512_maddubs_epi16(_mm512_unpacklo_epi8(r.0, r.1), ten),
        );
        let high = _mm512_add_epi16(
            _mm512_add_epi16(
                _mm512_maddubs_epi16(_mm512_unpackhi_epi8(p.0, p.1), three),
                _mm512_maddubs_epi16(_mm512_unpackhi_epi8(q.0, q.1), three),
            ),
            _mm512_maddubs_epi16(_mm512_unpackhi_epi8(r.0, r.1), ten),
        );
        [low, high]
    }
}

impl VectorLevel for i16 {
    const AT_ONCE: usize = 32;

    #[inline(always)]
    unsafe fn gradients<const MASKED: bool>([above, middle, below]: [*const i16; 3], mask: u64) -> [__m512i; 4] {
        // SAFETY: the caller vouches for the levels and the machine.
        unsafe {
            let [a0, a1, a2] = words::<MASKED>(above, mask as u32);
            let [m0, _, m2] = words::<MASKED>(middle, mask as u32);
            let [b0, b1, b2] = words::<MASKED>(below, mask as u32);
            let x = weighted_words([(a0, a2), (b0, b2), (m0, m2)]);
            let y = weighted_words([(a0, b0), (a2, b2), (a1, b1)]);
            // Unpacking then gives pixels 0 to 15 and 16 to 31.
            let order = _mm512_setr_epi64(0, 4, 1, 5, 2, 6, 3, 7);
            let (x, y) = (_mm512_permutexvar_epi64(order, x), _mm512_permutexvar_epi64(order, y));
            let none = _mm512_setzero_si512();
            [_mm512_unpacklo_epi16(x, y), _mm512_unpackhi_epi16(x, y), none, none]
        }
    }
}

/// 32 levels, those one to the right, and two.
///
/// # Safety
/// See [`VectorLevel::gradients`].
#[inline(always)]
unsafe fn words<const MASKED: bool>(row: *const i16, mask: u32) -> [__m512i; 3] {
    // SAFETY: the caller vouches for the levels and the machine; levels beyond the mask are not read.
    unsafe {
        if MASKED {
            [
                _mm512_maskz_loadu_epi16(mask, row),
                _mm512_maskz_loadu_epi16(mask, row.add(1)),
                _mm512_maskz_loadu_epi16(mask, row.add(2)),
            ]
        } else {
            [
                _mm512_loadu_si512(row.cast()),
                _mm512_loadu_si512(row.add(1).cast()),
                _mm512_loadu_si512(row.add(2).cast()),
            ]
        }
    }
}

/// [`Level::weigh`]: three parts of the first two differences and ten of the last.
///
/// # Safety
/// See [`VectorLevel::gradients`].
#[inline(always)]
unsafe fn weighted_words([p, q, r]: [(__m512i, __m512i); 3]) -> __m512i {
    // SAFETY: the caller vouches for the machine.
    unsafe {
        let (three, ten) = (_mm512_set1_epi16(THREE as i16), _mm512_set1_epi16(TEN as i16));
        let sides = _mm512_add_epi16(
            _mm512_mulhrs_epi16(_mm512_sub_epi16(p.1, p.0), three),
            _mm512_mulhrs_epi16(_mm512_sub_epi16(q.1, q.0), three),
        );
        _mm512_add_epi16(sides, _mm512_mulhrs_epi16(_mm512_sub_epi16(r.1, r.0), ten))
    }
}

/// See [`super::sieve::sieve`]; the machine must have what [`is_available`] asks for.
pub(super) fn sieve<L: VectorLevel>(
    rows: Rows<'_, L>,
    n: usize,
    slot: u32,
    test: &Test<'_>,
    kept: Kept<'_>,
) -> (usize, usize) {
    let Rows { above, middle, below } = rows;
    let rows = [&above[..n + 2], &middle[..n + 2], &below[..n + 2]];
    assert!(is_available() && kept.slots.len() >= n + BLOCK && kept.gradients.len() >= n + BLOCK);
    if let Vectors::Each(each) = test.vectors {
        assert!(each.len() >= n);
    }
    // SAFETY: the machine has the features, rows hold n + 2 levels, there are n vectors and room for n + BLOCK words.
    unsafe {
        match test.vectors {
            Vectors::None => sieve_span::<L, NONE>(rows, n, slot, test, kept),
            Vectors::Each(_) => sieve_span::<L, EACH>(rows, n, slot, test, kept),
            Vectors::Line { .. } => sieve_span::<L, LINE>(rows, n, slot, test, kept),
        }
    }
}

const NONE: u8 = 0;
const EACH: u8 = 1;
const LINE: u8 = 2;

/// What does not change from block to block.
struct Constants {
    at_least: __m512i,
    limit: __m512,
    count: __m512i,
    /// What the screening vectors grow by over 16 pixels.
    step: __m512i,
    /// The screening vector of each pixel of the span.
    each: *const i32,
    slot: u32,
    slots: *mut u32,
    gradients: *mut u32,
}

/// What does.
struct State {
    line: __m512i,
    len: usize,
    strong: usize,
}

/// # Safety
/// See [`sieve`].
#[target_feature(enable = "avx512f,avx512bw,avx512vl,bmi2,popcnt")]
unsafe fn sieve_span<L: VectorLevel, const SCREEN: u8>(
    rows: [&[L]; 3],
    n: usize,
    slot: u32,
    test: &Test<'_>,
    kept: Kept<'_>,
) -> (usize, usize) {
    // SAFETY: as the caller vouches: blocks are whole within n, and the last one is masked.
    unsafe {
        let Kept { slots, gradients } = kept;
        let count = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        let (mut line, mut step, mut each) = (count, count, std::ptr::null());
        match test.vectors {
            Vectors::Line { first: [x, y], step: by } => {
                let first = (i32::from(y) << 16) | i32::from(x as u16);
                let along = _mm512_mullo_epi16(count, _mm512_set1_epi32(i32::from(by as u16)));
                line = _mm512_add_epi16(_mm512_set1_epi32(first), along);
                step = _mm512_set1_epi32(i32::from((16 * i32::from(by)) as u16));
            }
            Vectors::Each(vectors) => each = vectors.as_ptr().cast(),
            Vectors::None => {}
        }
        let constants = Constants {
            at_least: _mm512_set1_epi32(test.at_least),
            limit: _mm512_set1_ps(test.limit),
            count,
            step,
            each,
            slot,
            slots: slots.as_mut_ptr(),
            gradients: gradients.as_mut_ptr(),
        };
        let mut state = State { line, len: 0, strong: 0 };
        let [above, middle, below] = [rows[0].as_ptr(), rows[1].as_ptr(), rows[2].as_ptr()];
        let mut start = 0;
        while start + L::AT_ONCE <= n {
            let g = L::gradients::<false>([above.add(start), middle.add(start), below.add(start)], 0);
            keep::<SCREEN, false>(g[0], start, u16::MAX, &constants, &mut state);
            keep::<SCREEN, false>(g[1], start + 16, u16::MAX, &constants, &mut state);
            if L::AT_ONCE > 32 {
                keep::<SCREEN, false>(g[2], start + 32, u16::MAX, &constants, &mut state);
                keep::<SCREEN, false>(g[3], start + 48, u16::MAX, &constants, &mut state);
            }
            start += L::AT_ONCE;
        }
        if start < n {
            let mask = (1u64 << (n - start)) - 1;
            let g = L::gradients::<true>([above.add(start), middle.add(start), below.add(start)], mask);
            keep::<SCREEN, true>(g[0], start, mask as __mmask16, &constants, &mut state);
            if mask >> 16 != 0 {
                keep::<SCREEN, true>(g[1], start + 16, (mask >> 16) as __mmask16, &constants, &mut state);
            }
            if mask >> 32 != 0 {
                keep::<SCREEN, true>(g[2], start + 32, (mask >> 32) as __mmask16, &constants, &mut state);
                keep::<SCREEN, true>(g[3], start + 48, (mask >> 48) as __mmask16, &constants, &mut state);
            }
        }
        (state.len, if SCREEN == NONE { state.len } else { state.strong })
    }
}

/// Tests the gradients of the 16 pixels from `start` on and appends those of the mask that pass.
///
/// # Safety
/// The machine must have the features, `each` must hold the pixels (of the mask) if the screen is of that kind, and there must
/// be room for 16 more words.
#[inline(always)]
unsafe fn keep<const SCREEN: u8, const MASKED: bool>(
    g: __m512i,
    start: usize,
    own: __mmask16,
    constants: &Constants,
    state: &mut State,
) {
    // SAFETY: as the caller vouches.
    unsafe {
        let squared = _mm512_madd_epi16(g, g);
        let mut strong = _mm512_cmpge_epi32_mask(squared, constants.at_least);
        if MASKED {
            strong &= own;
        }
        let mut passing = strong;
        if SCREEN != NONE {
            let vectors = if SCREEN == LINE {
                state.line
            } else if MASKED {
                _mm512_maskz_loadu_epi32(own, constants.each.wrapping_add(start))
            } else {
                _mm512_loadu_si512(constants.each.add(start).cast())
            };
            let across = _mm512_cvtepi32_ps(_mm512_madd_epi16(vectors, g));
            let most = _mm512_mul_ps(constants.limit, _mm512_cvtepi32_ps(squared));
            passing = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(strong, _mm512_mul_ps(across, across), most);
            state.strong += strong.count_ones() as usize;
        }
        if SCREEN == LINE {
            state.line = _mm512_add_epi16(state.line, constants.step);
        }
        // Most hold nothing that passes a screen.
        if passing != 0 {
            let first = _mm512_set1_epi32(constants.slot.wrapping_add(start as u32) as i32);
            let slots = _mm512_maskz_compress_epi32(passing, _mm512_add_epi32(constants.count, first));
            _mm512_storeu_si512(constants.slots.add(state.len).cast(), slots);
            let gradients = _mm512_maskz_compress_epi32(passing, g);
            _mm512_storeu_si512(constants.gradients.add(state.len).cast(), gradients);
            state.len += passing.count_ones() as usize;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::sieve::{portable_levels, portable_smoothed};
    use super::*;

    /// A kernel for levels.
    type Kernel<L> = fn(Rows<'_, L>, usize, u32, &Test<'_>, Kept<'_>) -> (usize, usize);

    /// What a kernel finds: slots, gradients, how many were strong.
    fn found<L: Level>(kernel: Kernel<L>, rows: Rows<'_, L>, n: usize, test: &Test<'_>) -> (Vec<u32>, Vec<u32>, usize) {
        let (mut slots, mut gradients) = (vec![0; n + BLOCK], vec![0; n + BLOCK]);
        let (len, strong) = kernel(rows, n, 17, test, Kept { slots: &mut slots, gradients: &mut gradients });
        slots.truncate(len);
        gradients.truncate(len);
        (slots, gradients, strong)
    }

    fn compare<L: VectorLevel>(plain: Kernel<L>, levels: &[L], at_least: i32) {
        let vectors: Vec<[i16; 2]> = (0..200).map(|i| [(i * 307 - 30_000) as i16, (20_000 - i * 11) as i16]).collect();
        let mut passing = 0;
        for n in (1..150).chain([200]) {
            let rows = Rows { above: &levels[..n + 2], middle: &levels[300..n + 302], below: &levels[600..n + 602] };
            for vectors in
                [Vectors::None, Vectors::Each(&vectors[..n]), Vectors::Line { first: [-9000, 8000], step: 91 }]
            {
                for at_least in [1, at_least, i32::MAX] {
                    let test = Test { at_least, vectors, limit: 1e8 };
                    let ours = found(sieve::<L>, rows, n, &test);
                    assert_eq!(ours, found(plain, rows, n, &test), "{n} pixels, {test:?}");
                    passing += ours.0.len();
                }
            }
        }
        assert!(passing > 10_000, "{passing}");
    }

    #[test]
    fn vectors_give_the_same_bits_as_single_numbers() {
        if !is_available() {
            return;
        }
        let random = |i: u32| i.wrapping_mul(2_654_435_761).rotate_left(11).wrapping_mul(0x85eb_ca6b) >> 16;
        let levels: Vec<u8> = (0..1000).map(|i| random(i) as u8).collect();
        compare(portable_levels, &levels, 500 * 500);
        let extreme: Vec<u8> = (0..1000).map(|i| if random(i) & 1 == 1 { 255 } else { 0 }).collect();
        compare(portable_levels, &extreme, 500 * 500);
        let smoothed: Vec<i16> = (0..1000).map(|i| (random(i) % 32_641) as i16).collect();
        compare(portable_smoothed, &smoothed, 4000 * 4000);
        let extreme: Vec<i16> = (0..1000).map(|i| if random(i) & 1 == 1 { 32_640 } else { 0 }).collect();
        compare(portable_smoothed, &extreme, 4000 * 4000);
    }
}
