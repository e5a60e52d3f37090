//! Separable Gaussian smoothing, one row at a time.

use tiltvp_kernels::smoothing::{
    TAP_UNITS, add_scaled, add_scaled_one, convolve, fixed_columns, fixed_rows, quantise, scale, three_rows, widen,
};

use super::view::ImageView;

/// [`TAP_UNITS`] as a number.
const UNITS: f32 = TAP_UNITS as f32;

/// The part of the Gaussian's weight that may be cut off at both ends. The taps are normalised again, and their standard deviation
/// is at most 4 % below that asked for (of 0.4 to 4 pixels).
const TAIL: f64 = 0.01;

/// A sampled Gaussian and one row of scratch; `sigma = 0` copies rows.
#[derive(Debug, Clone)]
pub struct Smoother {
    taps: Vec<f32>,
    column_sums: Vec<f32>,
    /// Scratch of the rows in fixed point: sums of columns, and a row in single precision.
    fixed_sums: Vec<i16>,
    plain: Vec<f32>,
}

impl Smoother {
    /// A Gaussian of `sigma_px` pixels for rows of at most `max_width` pixels.
    pub fn new(sigma_px: f64, max_width: usize) -> Self {
        let taps = gaussian_taps(sigma_px);
        let (narrow, wide) = if taps.len() == 2 { (max_width + 2, 0) } else { (0, max_width) };
        Self {
            column_sums: vec![0.0; max_width + 2 * taps.len()],
            fixed_sums: vec![0; narrow],
            plain: vec![0.0; wide],
            taps,
        }
    }

    /// Whether rows are copied as they are.
    pub fn copies(&self) -> bool {
        self.taps.len() == 1
    }

    /// [`row`](Self::row) rounded to 1/8 of a grey level, in that unit.
    ///
    /// Columns and rows that the kernel reaches should lie within the image: others may be smoothed in single precision first,
    /// which takes longer.
    pub fn fixed_row(&mut self, image: &ImageView<'_>, v: usize, first: usize, out: &mut [i16]) {
        let n = out.len();
        let inside = first >= 1 && first + n < image.width() && v >= 1 && v + 1 < image.height();
        if let ([centre, side], true) = (&self.taps[..], inside && self.fixed_sums.len() >= n + 2) {
            let taps = [*centre, *side].map(|tap| (tap * UNITS) as i16);
            let part = |v: usize| image.row(v).get(first - 1..=first + n).unwrap_or(&[]);
            fixed_columns([part(v - 1), part(v), part(v + 1)], taps, &mut self.fixed_sums[..n + 2]);
            fixed_rows(&self.fixed_sums[..n + 2], taps, out);
            return;
        }
        let mut plain = std::mem::take(&mut self.plain);
        if plain.len() < n {
            plain.resize(n, 0.0);
        }
        self.row(image, v, first, &mut plain[..n]);
        quantise(&plain[..n], out);
        self.plain = plain;
    }

    /// How many pixels to each side a smoothed pixel is made from.
    pub fn radius(sigma_px: f64) -> usize {
        gaussian_taps(sigma_px).len() - 1
    }

    /// Writes columns `first..first + out.len()` of the smoothed row `v`.
    ///
    /// What lies outside the image counts as black. Takes no memory for rows of the width that it was made for.
    pub fn row(&mut self, image: &ImageView<'_>, v: usize, first: usize, out: &mut [f32]) {
        let radius = self.taps.len() - 1;
        let from = first.saturating_sub(radius);
        let to = (first + out.len() + radius).min(image.width());
        let part = |v: usize| image.row(v).get(from..to).unwrap_or(&[]);
        if radius == 0 {
            out.fill(0.0);
            widen(part(v), out);
            return;
        }
        // One sum for each column that the kernel reaches; those outside the image stay black.
        let needed = out.len() + 2 * radius;
        if self.column_sums.len() < needed {
            self.column_sums.resize(needed, 0.0);
        }
        let outside = from + radius - first;
        let inside = outside..outside + to.saturating_sub(from);
        self.column_sums[..inside.start].fill(0.0);
        self.column_sums[inside.end..needed].fill(0.0);
        let sums = &mut self.column_sums[inside];
        let inside = v >= 1 && v + 1 < image.height();
        if inside {
            three_rows([part(v - 1), part(v), part(v + 1)], [self.taps[0], self.taps[1]], sums);
        } else if v < image.height() {
            scale(part(v), self.taps[0], sums);
        } else {
            sums.fill(0.0);
        }
        for (offset, tap) in self.taps.iter().enumerate().skip(if inside { 2 } else { 1 }) {
            let above = v.checked_sub(offset).map_or(&[][..], part);
            let below = part(v + offset);
            if above.is_empty() || below.is_empty() {
                add_scaled_one(above, *tap, sums);
                add_scaled_one(below, *tap, sums);
            } else {
                add_scaled(above, below, *tap, sums);
            }
        }
        convolve(&self.column_sums[..needed], &self.taps, out);
    }
}

/// Half of a sampled Gaussian, the centre first, normalised to a sum of one over both halves; if there are but two taps, in
/// whole units of 1/256.
fn gaussian_taps(sigma_px: f64) -> Vec<f32> {
    if sigma_px <= 0.0 {
        return vec![1.0];
    }
    let weight = |i: usize| (-0.5 * (i as f64 / sigma_px).powi(2)).exp();
    let reach = (6.0 * sigma_px).ceil() as usize + 1;
    let total = 1.0 + 2.0 * (1..=reach).map(weight).sum::<f64>();
    let tail = |radius: usize| 2.0 * (radius + 1..=reach).map(weight).sum::<f64>() / total;
    let radius = (1..reach).find(|&r| tail(r) < TAIL).unwrap_or(reach);
    let kept = 1.0 + 2.0 * (1..=radius).map(weight).sum::<f64>();
    if radius == 1 {
        // So that sums of three by three pixels are exact in whole numbers.
        let side = (f64::from(UNITS) * weight(1) / kept).round() as f32 / UNITS;
        return vec![1.0 - 2.0 * side, side];
    }
    (0..=radius).map(|i| (weight(i) / kept) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_a_constant_and_spreads_a_point() {
        let data = [50u8; 11 * 11];
        let view = ImageView::new(&data, 11, 11, 11).unwrap();
        let mut out = [0.0f32; 3];
        Smoother::new(1.0, 11).row(&view, 5, 4, &mut out);
        assert!(out.iter().all(|x| (x - 50.0).abs() < 1e-4), "{out:?}");

        let mut data = [0u8; 11 * 11];
        data[5 * 11 + 5] = 255;
        let view = ImageView::new(&data, 11, 11, 11).unwrap();
        Smoother::new(0.6, 11).row(&view, 5, 4, &mut out);
        assert!(out[0] > 20.0 && (out[0] - out[2]).abs() < 1e-4 && out[1] > 3.0 * out[0], "{out:?}");
    }

    #[test]
    fn every_pixel_is_the_weighted_sum_with_black_outside() {
        let (width, height) = (9usize, 7usize);
        let data: Vec<u8> = (0..width * height).map(|i| (i * 83 % 251) as u8).collect();
        let view = ImageView::new(&data, width, height, width).unwrap();
        for sigma in [0.0, 0.6, 1.0, 2.5] {
            let taps = gaussian_taps(sigma);
            let radius = taps.len() as isize - 1;
            let level = |u: isize, v: isize| {
                let inside = (0..width as isize).contains(&u) && (0..height as isize).contains(&v);
                if inside { f32::from(data[(v * width as isize + u) as usize]) } else { 0.0 }
            };
            let mut smoother = Smoother::new(sigma, width);
            for v in 0..height as isize + 3 {
                for first in 0..width {
                    let mut out = vec![f32::NAN; width - first + 2];
                    smoother.row(&view, v as usize, first, &mut out);
                    for (i, found) in out.iter().enumerate() {
                        let u = (first + i) as isize;
                        let expected: f32 = (-radius..=radius)
                            .flat_map(|y| (-radius..=radius).map(move |x| (x, y)))
                            .map(|(x, y)| taps[x.unsigned_abs()] * taps[y.unsigned_abs()] * level(u + x, v + y))
                            .sum();
                        assert!((found - expected).abs() < 1e-3, "sigma {sigma}, ({u}, {v}): {found}, not {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn rows_in_fixed_point_are_the_rows_rounded() {
        let (width, height) = (97usize, 12usize);
        let data: Vec<u8> = (0..width * height).map(|i| (i * i * 83 % 256) as u8).collect();
        for data in [data, vec![255; width * height]] {
            let view = ImageView::new(&data, width, height, width).unwrap();
            for sigma in [0.4, 0.6, 1.5] {
                let mut smoother = Smoother::new(sigma, width);
                for v in 0..height {
                    for first in [0, 1, 5] {
                        let (mut plain, mut fixed) = (vec![0.0f32; 91], vec![0i16; 91]);
                        smoother.row(&view, v, first, &mut plain);
                        smoother.fixed_row(&view, v, first, &mut fixed);
                        for (p, f) in plain.iter().zip(&fixed) {
                            assert!((p * 8.0 - f32::from(*f)).abs() < 0.501 && *f <= 2040, "{p} {f}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn no_smoothing_copies() {
        let data: Vec<u8> = (0..30).collect();
        let view = ImageView::new(&data, 6, 5, 6).unwrap();
        let mut out = [0.0f32; 4];
        Smoother::new(0.0, 6).row(&view, 2, 1, &mut out);
        assert_eq!(out, [13.0, 14.0, 15.0, 16.0]);
    }
}
