//! Which face of the coloured cuboid each pixel shows: thresholds on chromaticity and intensity (paper section II-B).

use multiversion::multiversion;

use crate::error::{Error, Result};
use crate::image::ColorView;

/// A primary colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Primary {
    /// The third byte of a pixel.
    Red,
    /// The second byte.
    Green,
    /// The first byte.
    Blue,
}

/// What a pixel has to be to show a face of the cuboid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColorOptions {
    /// Least share of the face's own primary in the sum of all three, from 0.34 to 1. Default 0.45.
    pub chromaticity_min: f64,
    /// Least value of the face's own primary, out of 255. Default 50.
    pub intensity_min: u8,
    /// Colours of the top, the left and the right face as an upright camera sees them. Default red, green, blue.
    pub faces: [Primary; 3],
}

impl Default for ColorOptions {
    fn default() -> Self {
        Self { chromaticity_min: 0.45, intensity_min: 50, faces: [Primary::Red, Primary::Green, Primary::Blue] }
    }
}

impl ColorOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        if !(0.34..=1.0).contains(&self.chromaticity_min) {
            return Err(Error::option("chromaticity_min", self.chromaticity_min, "a share from 0.34 to 1"));
        }
        let [top, left, right] = self.faces;
        if top == left || left == right || top == right {
            let shown = self.faces.map(Primary::letter).into_iter().collect::<String>();
            return Err(Error::option("faces", shown, "three different colours of r, g and b: top, left, right"));
        }
        Ok(())
    }
}

impl Primary {
    /// `r`, `g` or `b`.
    pub fn letter(self) -> char {
        match self {
            Self::Red => 'r',
            Self::Green => 'g',
            Self::Blue => 'b',
        }
    }

    /// The colour of a letter, `None` for any but `r`, `g` and `b`.
    pub fn from_letter(letter: char) -> Option<Self> {
        [Self::Red, Self::Green, Self::Blue].into_iter().find(|primary| primary.letter() == letter)
    }

    /// Its place among the bytes of a pixel.
    pub(super) fn byte(self) -> usize {
        match self {
            Self::Blue => 0,
            Self::Green => 1,
            Self::Red => 2,
        }
    }
}

/// Labels of pixels.
pub(super) const NONE: u8 = 0;
pub(super) const TOP: u8 = 1;
pub(super) const LEFT: u8 = 2;
pub(super) const RIGHT: u8 = 3;

/// The labels of every `step`-th pixel of a window of the image, in both directions.
#[derive(Debug, Clone, Default)]
pub(super) struct Labels {
    pub(super) values: Vec<u8>,
    /// First column and row, in pixels.
    pub(super) origin: [usize; 2],
    /// How many columns and rows of labels there are.
    pub(super) size: [usize; 2],
    pub(super) step: usize,
}

impl Labels {
    /// Labels every `step`-th pixel of a window.
    pub(super) fn fill(
        &mut self,
        image: &ColorView<'_>,
        options: &ColorOptions,
        columns: std::ops::Range<usize>,
        rows: std::ops::Range<usize>,
        step: usize,
    ) {
        let step = step.max(1);
        (self.origin, self.step) = ([columns.start, rows.start], step);
        self.size = [columns.len().div_ceil(step), rows.len().div_ceil(step)];
        self.values.resize(self.size[0] * self.size[1], NONE);
        let share = (options.chromaticity_min * 256.0).round() as u16;
        let mut by_byte = [NONE; 3];
        for (face, label) in options.faces.into_iter().zip([TOP, LEFT, RIGHT]) {
            by_byte[face.byte()] = label;
        }
        for (v, out) in rows.step_by(step).zip(self.values.chunks_exact_mut(self.size[0].max(1))) {
            let row = image.row(v).get(3 * columns.start..3 * columns.end).unwrap_or(&[]);
            label_row(row, step, share, options.intensity_min, by_byte, out);
        }
    }

    /// The labels of row `i` of the window.
    pub(super) fn row(&self, i: usize) -> &[u8] {
        let width = self.size[0];
        self.values.get(i * width..(i + 1) * width).unwrap_or(&[])
    }
}

/// A pixel is of a colour whose value is at least `intensity` and at least `share / 256` of the sum; with a share above a
/// third of it the strongest colour is the only candidate, but for ties of two, which are none.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl", "x86_64+avx2+fma"))]
fn label_row(row: &[u8], step: usize, share: u16, intensity: u8, by_byte: [u8; 3], out: &mut [u8]) {
    for (pixel, label) in row.chunks(3 * step).zip(out) {
        let Some([b, g, r]) = pixel.first_chunk::<3>().copied() else { continue };
        let needed = (u32::from(b) + u32::from(g) + u32::from(r)) * u32::from(share);
        let passes = |c: u8, others: u8| {
            u8::from((u32::from(c) << 8) >= needed) & u8::from(c >= intensity.max(1)) & u8::from(c > others)
        };
        *label = passes(b, g.max(r)) * by_byte[0] + passes(g, b.max(r)) * by_byte[1] + passes(r, b.max(g)) * by_byte[2];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_labelled_by_share_and_value() {
        let bgr: [[u8; 3]; 8] = [
            [10, 20, 200],
            [10, 200, 20],
            [200, 10, 20],
            [100, 100, 100],
            [0, 0, 0],
            [5, 5, 40],
            [120, 10, 130],
            [90, 90, 20],
        ];
        let bytes: Vec<u8> = bgr.into_iter().flatten().collect();
        let image = ColorView::new(&bytes, 8, 1, 24).unwrap();
        let mut labels = Labels::default();
        labels.fill(&image, &ColorOptions::default(), 0..8, 0..1, 1);
        assert_eq!(labels.row(0), [TOP, LEFT, RIGHT, NONE, NONE, NONE, TOP, NONE]);
        labels.fill(&image, &ColorOptions::default(), 1..3, 0..1, 1);
        assert_eq!(labels.row(0), [LEFT, RIGHT]);
        labels.fill(&image, &ColorOptions::default(), 1..8, 0..1, 3);
        assert_eq!(labels.row(0), [LEFT, NONE, NONE]);
        let faces = [Primary::Blue, Primary::Red, Primary::Green];
        labels.fill(&image, &ColorOptions { faces, ..ColorOptions::default() }, 0..8, 0..1, 1);
        assert_eq!(labels.row(0)[..3], [LEFT, RIGHT, TOP]);
    }

    #[test]
    fn wrong_options_are_refused_by_name() {
        let wrong = ColorOptions { chromaticity_min: 0.2, ..ColorOptions::default() };
        assert!(wrong.validate().unwrap_err().to_string().contains("chromaticity_min"));
        let wrong = ColorOptions { faces: [Primary::Red; 3], ..ColorOptions::default() };
        assert!(wrong.validate().unwrap_err().to_string().contains("faces"));
    }
}
