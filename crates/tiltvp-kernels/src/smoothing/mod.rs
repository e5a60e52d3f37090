//! Separable Gaussian smoothing of rows: sums of columns, then sums along a row.

mod fixed;

use crate::vectorised;

pub use fixed::{TAP_UNITS, fixed_columns, fixed_rows};

/// Steps of a grey level in which smoothed rows are rounded: Scharr gradients of levels up to 255 in these units are at most 32640,
/// which is in 16 bits.
const EIGHTHS: f32 = 8.0;

vectorised! {
    /// Grey levels as numbers of single precision.
    pub fn widen(row: &[u8], out: &mut [f32]) {
        for (o, i) in out.iter_mut().zip(row) {
            *o = f32::from(*i);
        }
    }
}

vectorised! {
    /// Grey levels times a tap.
    pub fn scale(row: &[u8], tap: f32, out: &mut [f32]) {
        for (o, i) in out.iter_mut().zip(row) {
            *o = f32::from(*i) * tap;
        }
    }
}

vectorised! {
    /// The middle row and its neighbours at once, which is all that narrow Gaussians take.
    pub fn three_rows([above, middle, below]: [&[u8]; 3], [centre, side]: [f32; 2], out: &mut [f32]) {
        for (((o, a), m), b) in out.iter_mut().zip(above).zip(middle).zip(below) {
            *o = f32::from(*m) * centre + (f32::from(*a) + f32::from(*b)) * side;
        }
    }
}

vectorised! {
    /// Adds two rows at like distances times their tap.
    pub fn add_scaled(above: &[u8], below: &[u8], tap: f32, out: &mut [f32]) {
        for ((o, a), b) in out.iter_mut().zip(above).zip(below) {
            *o += (f32::from(*a) + f32::from(*b)) * tap;
        }
    }
}

vectorised! {
    /// Rounds levels to eighths; halves go to the even one.
    pub fn quantise(row: &[f32], out: &mut [i16]) {
        for (o, i) in out.iter_mut().zip(row) {
            *o = (i * EIGHTHS).round_ties_even() as i16;
        }
    }
}

/// Adds a row times a tap, where its mirror image is outside.
pub fn add_scaled_one(row: &[u8], tap: f32, out: &mut [f32]) {
    for (o, i) in out.iter_mut().zip(row) {
        *o += f32::from(*i) * tap;
    }
}

vectorised! {
    /// `sums` reach as far beyond `out` on both sides as the taps do, of which there are at least two.
    pub fn convolve(sums: &[f32], taps: &[f32], out: &mut [f32]) {
        let (radius, length) = (taps.len() - 1, out.len());
        let window = |shift: usize| &sums[shift..shift + length];
        for (((o, l), c), r) in out.iter_mut().zip(window(radius - 1)).zip(window(radius)).zip(window(radius + 1)) {
            *o = c * taps[0] + (l + r) * taps[1];
        }
        for (offset, tap) in taps.iter().enumerate().skip(2) {
            for ((o, l), r) in out.iter_mut().zip(window(radius - offset)).zip(window(radius + offset)) {
                *o += (l + r) * tap;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each kernel against its formula, pixel by pixel, to the last bit.
    #[test]
    fn rows_are_those_of_plain_loops() {
        const N: usize = 203;
        let row = |k: usize| (0..N + 10).map(|i| ((i * i * (83 + k) + 7 * k) % 256) as u8).collect::<Vec<_>>();
        let (above, middle, below) = (row(0), row(5), row(9));
        let check = |found: &[f32], of: &dyn Fn(usize) -> f32| {
            assert!(found.iter().enumerate().all(|(i, found)| found.to_bits() == of(i).to_bits()));
        };
        let at = |row: &[u8], i: usize| f32::from(row[i]);
        let mut out = vec![0.0f32; N];
        widen(&above, &mut out);
        check(&out, &|i| at(&above, i));
        scale(&above, 0.37, &mut out);
        check(&out, &|i| at(&above, i) * 0.37);
        three_rows([&above, &middle, &below], [0.6, 0.2], &mut out);
        check(&out, &|i| at(&middle, i) * 0.6 + (at(&above, i) + at(&below, i)) * 0.2);
        let before = out.clone();
        add_scaled(&above, &below, 0.1, &mut out);
        check(&out, &|i| before[i] + (at(&above, i) + at(&below, i)) * 0.1);
        let before = out.clone();
        add_scaled_one(&above, 0.1, &mut out);
        check(&out, &|i| before[i] + at(&above, i) * 0.1);
        let mut eighths = vec![0i16; N];
        quantise(&out, &mut eighths);
        assert!(eighths.iter().zip(&out).all(|(e, x)| *e == (x * 8.0).round_ties_even() as i16));
        let sums: Vec<f32> = middle.iter().map(|level| f32::from(*level) * 0.7).collect();
        let taps = [0.4, 0.2, 0.07, 0.03];
        convolve(&sums[..N + 6], &taps, &mut out);
        check(&out, &|i| {
            let pair = |k: usize| (sums[i + 3 - k] + sums[i + 3 + k]) * taps[k];
            (sums[i + 3] * taps[0] + pair(1)) + pair(2) + pair(3)
        });
    }
}
