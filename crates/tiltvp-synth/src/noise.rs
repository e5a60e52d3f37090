//! Portable lattice noise: hashes of integers, smooth value noise and its sum over octaves.

/// A hash of two lattice coordinates and a seed (the finaliser of MurmurHash3).
pub(crate) fn hash(x: i64, y: i64, seed: u32) -> u32 {
    let mut h =
        (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77) ^ seed.wrapping_mul(0xC2B2_AE3D);
    h ^= h >> 16;
    h = h.wrapping_mul(0x85EB_CA6B);
    h ^= h >> 13;
    h = h.wrapping_mul(0xC2B2_AE35);
    h ^ (h >> 16)
}

/// A hash as a number in `[0, 1)`.
pub(crate) fn hash_unit(x: i64, y: i64, seed: u32) -> f64 {
    f64::from(hash(x, y, seed)) / 4_294_967_296.0
}

/// The greatest integer that is not greater, without a call where the processor has no instruction for it.
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from(x < whole as f64)
}

fn fade(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

/// Smooth noise in `[-1, 1]` with lattice spacing 1.
pub(crate) fn value_noise(x: f64, y: f64, seed: u32) -> f64 {
    let (i, j) = (floor(x), floor(y));
    let (fx, fy) = (fade(x - i as f64), fade(y - j as f64));
    let row = |j: i64| hash_unit(i, j, seed) * (1.0 - fx) + hash_unit(i + 1, j, seed) * fx;
    2.0 * (row(j) * (1.0 - fy) + row(j + 1) * fy) - 1.0
}

/// Octaves of [`value_noise`] from `period` downwards, each half as strong, in about `[-1, 1]`; octaves finer than
/// `footprint` (same unit as `x`) fade out, so that distant surfaces do not shimmer.
pub(crate) fn fractal_noise(x: f64, y: f64, period: f64, octaves: u32, footprint: f64, seed: u32) -> f64 {
    let (mut sum, mut weight, mut period) = (0.0, 0.6, period);
    for octave in 0..octaves {
        let visible = fade_by_size(period, footprint);
        if visible <= 0.0 {
            break;
        }
        sum += weight * visible * value_noise(x / period, y / period, seed.wrapping_add(octave));
        weight *= 0.5;
        period *= 0.5;
    }
    sum
}

/// 1 where a feature of the given size is much larger than the footprint of a sample, 0 where it is smaller.
pub(crate) fn fade_by_size(size: f64, footprint: f64) -> f64 {
    (2.0 - 2.0 * footprint / size).clamp(0.0, 1.0)
}
