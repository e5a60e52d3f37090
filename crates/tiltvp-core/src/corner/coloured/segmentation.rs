//! Which face of the coloured cuboid each pixel shows: thresholds on chromaticity and intensity (Liu et al. 2018, section II-B).

use tiltvp_kernels::vectorised;

use crate::error::{Error, Result};
use crate::image::ColorView;
use crate::options;
use crate::options::{Kind, OptionValue, Value};

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

options! {
    /// What a pixel has to be to show a face of the cuboid.
    #[derive(Copy)]
    pub struct ColorOptions {
        /// Least share of the face's own primary in the sum of all three.
        chromaticity_min: f64 = 0.45 => 0.34..=1.0, "a share from 0.34 to 1";
        /// Least value of the face's own primary, out of 255.
        intensity_min: u8 = 50 => 0.0..=255.0, "a level from 0 to 255";
        /// Colours of the top, the left and the right face as an upright camera sees them, by their letters.
        faces: [Primary; 3] = [Primary::Red, Primary::Green, Primary::Blue];
    }
    check different_faces
}

fn different_faces(options: &ColorOptions) -> Result<()> {
    let [top, left, right] = options.faces;
    if top == left || left == right || top == right {
        let shown = options.faces.to_value();
        return Err(Error::option("faces", shown, <[Primary; 3]>::KIND.to_string()));
    }
    Ok(())
}

/// The letters of the top, the left and the right face.
impl OptionValue for [Primary; 3] {
    const KIND: Kind = Kind::Text("the letters r, g and b, each once, in any order");

    fn to_value(&self) -> Value {
        Value::Text(self.map(Primary::letter).into_iter().collect())
    }

    fn from_value(value: &Value) -> Option<Self> {
        let Value::Text(word) = value else { return None };
        let letters: Option<Vec<Primary>> = word.chars().map(Primary::from_letter).collect();
        letters?.try_into().ok()
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
    pub(crate) fn byte(self) -> usize {
        match self {
            Self::Blue => 0,
            Self::Green => 1,
            Self::Red => 2,
        }
    }
}

/// Labels of pixels.
pub(crate) const NONE: u8 = 0;
pub(crate) const TOP: u8 = 1;
pub(crate) const LEFT: u8 = 2;
pub(crate) const RIGHT: u8 = 3;

/// The labels of every `step`-th pixel of a window of the image, in both directions.
#[derive(Debug, Clone, Default)]
pub(crate) struct Labels {
    pub(crate) values: Vec<u8>,
    /// First column and row, in pixels.
    pub(crate) origin: [usize; 2],
    /// How many columns and rows of labels there are.
    pub(crate) size: [usize; 2],
    pub(crate) step: usize,
}

impl Labels {
    /// Labels every `step`-th pixel of a window.
    pub(crate) fn fill(
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
        let mut labels = [NONE; 3];
        for (face, label) in options.faces.into_iter().zip([TOP, LEFT, RIGHT]) {
            labels[face.byte()] = label;
        }
        let share = (options.chromaticity_min * 256.0).round() as u16;
        let face = Face { share, intensity: options.intensity_min, labels };
        for (v, out) in rows.step_by(step).zip(self.values.chunks_exact_mut(self.size[0].max(1))) {
            let row = image.row(v).get(3 * columns.start..3 * columns.end).unwrap_or(&[]);
            label_row(row, step, face, out);
        }
    }

    /// The labels of row `i` of the window.
    pub(crate) fn row(&self, i: usize) -> &[u8] {
        let width = self.size[0];
        self.values.get(i * width..(i + 1) * width).unwrap_or(&[])
    }
}

/// What a pixel must be to be of a colour: the strongest of three that differ, at least `intensity`, and at least `share / 256`
/// of their sum; with a share above a third the strongest colour is the only candidate.
#[derive(Debug, Clone, Copy)]
struct Face {
    share: u16,
    intensity: u8,
    /// Labels of blue, green and red.
    labels: [u8; 3],
}

/// Pixels that are labelled together, in vector registers. Answers do not depend on it; a test compares with one by
/// one.
const BLOCK: usize = 64;

vectorised! {
    /// Labels every `step`-th pixel of a row of blue, green and red.
    fn label_row(row: &[u8], step: usize, face: Face, out: &mut [u8]) {
        let (blocks, _) = out.as_chunks_mut::<BLOCK>();
        let mut done = 0;
        for (pixels, out) in row.chunks_exact(3 * step * BLOCK).zip(blocks) {
            // With steps known at compile time the planes are separated in registers.
            let planes = match step {
                1 => planes(pixels, 1),
                2 => planes(pixels, 2),
                _ => planes(pixels, step),
            };
            *out = labels(&planes, face);
            done += BLOCK;
        }
        for (pixels, out) in
            row[(3 * step * done).min(row.len())..].chunks(3 * step * BLOCK).zip(out[done..].chunks_mut(BLOCK))
        {
            let found = labels(&planes(pixels, step), face);
            out.copy_from_slice(&found[..out.len()]);
        }
    }
}

/// Blue, green and red of every `step`-th pixel, black beyond the last.
#[inline(always)]
fn planes(pixels: &[u8], step: usize) -> [[u8; BLOCK]; 3] {
    let mut planes = [[0; BLOCK]; 3];
    if pixels.len() == 3 * step * BLOCK {
        let [b, g, r] = &mut planes;
        for k in 0..BLOCK {
            (b[k], g[k], r[k]) = (pixels[3 * step * k], pixels[3 * step * k + 1], pixels[3 * step * k + 2]);
        }
    } else {
        for (k, pixel) in pixels.chunks(3 * step).enumerate() {
            for (plane, level) in planes.iter_mut().zip(pixel) {
                plane[k] = *level;
            }
        }
    }
    planes
}

#[inline(always)]
fn labels([b, g, r]: &[[u8; BLOCK]; 3], face: Face) -> [u8; BLOCK] {
    // In products of 16 bits by 16 bits the upper half is `share / 256` of the sum, and the lower what is left.
    let (share, least) = (face.share << 2, face.intensity.max(1));
    let mut out = [NONE; BLOCK];
    for (k, out) in out.iter_mut().enumerate() {
        let (b, g, r) = (b[k], g[k], r[k]);
        let sum = (u16::from(b) + u16::from(g) + u16::from(r)) << 6;
        let product = u32::from(sum) * u32::from(share);
        let needed = (product >> 16) as u16 + u16::from(product as u16 != 0);
        let most = b.max(g).max(r);
        let of = |colour: u8, others: u8, label: u8| if colour > others { label } else { NONE };
        let [blue, green, red] = face.labels;
        let label = of(b, g.max(r), blue) | of(g, b.max(r), green) | of(r, b.max(g), red);
        *out = if u16::from(most) >= needed && most >= least { label } else { NONE };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_told_by_three_letters() {
        let faces = [Primary::Green, Primary::Blue, Primary::Red];
        assert_eq!(faces.to_value(), Value::Text("gbr".to_owned()));
        assert_eq!(<[Primary; 3]>::from_value(&faces.to_value()), Some(faces));
        for word in ["", "gb", "gbrr", "gbx"] {
            assert_eq!(<[Primary; 3]>::from_value(&Value::Text(word.to_owned())), None, "{word}");
        }
    }

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
    fn blocks_are_labelled_as_pixels_are_one_by_one() {
        let bytes: Vec<u8> = (0..3 * 1300u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 23) as u8 & 0xf8).collect();
        for (share, intensity) in [(115, 50), (87, 0), (256, 1), (128, 200)] {
            let face = Face { share, intensity, labels: [3, 2, 1] };
            for (pixels, step) in
                [(1, 1), (63, 1), (64, 1), (300, 1), (1300, 2), (127, 2), (400, 3), (1297, 5), (9, 16)]
            {
                let row = &bytes[..3 * pixels];
                let mut out = vec![9; pixels.div_ceil(step)];
                label_row(row, step, face, &mut out);
                for (k, label) in out.into_iter().enumerate() {
                    let [b, g, r] = [0, 1, 2].map(|c| u32::from(row[3 * k * step + c]));
                    let passes = |c: u32, others: u32| {
                        256 * c >= (b + g + r) * u32::from(share) && c >= u32::from(intensity.max(1)) && c > others
                    };
                    let all = [(passes(b, g.max(r)), 3), (passes(g, b.max(r)), 2), (passes(r, b.max(g)), 1)];
                    assert_eq!(label, all.into_iter().find(|(passes, _)| *passes).map_or(NONE, |(_, label)| label));
                }
            }
        }
    }

    #[test]
    fn wrong_options_are_refused_by_name() {
        let wrong = ColorOptions { chromaticity_min: 0.2, ..ColorOptions::default() };
        assert!(wrong.validate().unwrap_err().to_string().contains("chromaticity_min"));
        let wrong = ColorOptions { faces: [Primary::Red; 3], ..ColorOptions::default() };
        assert!(wrong.validate().unwrap_err().to_string().contains("faces"));
    }
}
