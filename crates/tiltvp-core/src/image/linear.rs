//! Light between pixel centres: levels through the inverse of the display curve, interpolated where light adds up.

use nalgebra::Vector2;
use tiltvp_kernels::bilinear::along_line;

use super::color::ColorView;
use super::view::ImageView;
use crate::error::{Error, Result};

/// The light of each of the 256 levels, in levels: `255 (level / 255)^gamma`.
///
/// A lens blurs light, not levels: half way up a blurred edge is half of the light, which the display curve moves towards the
/// dark side.
#[derive(Debug, Clone, PartialEq)]
pub struct LightTable {
    gamma: f64,
    light: Box<[f64; 256]>,
}

impl LightTable {
    /// For images whose levels are `light^(1 / gamma)`; 1 for linear ones.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] unless `gamma` is from 0.5 to 4.
    pub fn new(gamma: f64) -> Result<Self> {
        if !(0.5..=4.0).contains(&gamma) {
            return Err(Error::option("display_gamma", gamma, "an exponent from 0.5 to 4"));
        }
        let light = std::array::from_fn(|level| 255.0 * (level as f64 / 255.0).powf(gamma));
        Ok(Self { gamma, light: Box::new(light) })
    }

    /// The exponent.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// The light of a level.
    #[inline]
    pub fn of(&self, level: u8) -> f64 {
        self.light[usize::from(level)]
    }

    /// The light of a grey image between pixel centres, bilinear; `None` where that would need pixels outside the image.
    pub fn gray(&self, image: &ImageView<'_>, u: f64, v: f64) -> Option<f64> {
        let (column, row, du, dv) = corner_of(u, v, image.width(), image.height())?;
        let [a, b, c, d] = image.quad(column, row)?.map(|level| self.of(level));
        let (top, bottom) = (a + (b - a) * du, c + (d - c) * du);
        Some(top + (bottom - top) * dv)
    }

    /// Fills in the light of a grey image at places one step apart about a middle one; whether all of them are in the image.
    pub(crate) fn gray_profile(
        &self,
        image: &ImageView<'_>,
        middle: &Vector2<f64>,
        step: &Vector2<f64>,
        out: &mut [f64],
    ) -> bool {
        let sizes = [image.width(), image.height(), image.stride()];
        along_line(image.data(), sizes, &self.light, (*middle).into(), (*step).into(), out)
    }

    /// The light of blue, green and red between pixel centres, bilinear; `None` where that would need pixels outside the
    /// image.
    pub fn color(&self, image: &ColorView<'_>, u: f64, v: f64) -> Option<[f64; 3]> {
        let (column, row, du, dv) = corner_of(u, v, image.width(), image.height())?;
        let (above, below) = (image.row(row).get(3 * column..)?, image.row(row + 1).get(3 * column..)?);
        let (above, below) = (above.first_chunk::<6>()?, below.first_chunk::<6>()?);
        Some(std::array::from_fn(|c| {
            let along = |row: &[u8; 6]| self.of(row[c]) + (self.of(row[c + 3]) - self.of(row[c])) * du;
            let (top, bottom) = (along(above), along(below));
            top + (bottom - top) * dv
        }))
    }
}

/// The pixel to the upper left of a place and how far the place is from it, if all four pixels around are in the image.
fn corner_of(u: f64, v: f64, width: usize, height: usize) -> Option<(usize, usize, f64, f64)> {
    if !(u >= 0.0 && v >= 0.0 && u < (width - 1) as f64 && v < (height - 1) as f64) {
        return None;
    }
    let (column, row) = (u as usize, v as usize);
    Some((column, row, u - column as f64, v - row as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_a_plane_between_pixels_and_none_outside() {
        let table = LightTable::new(1.0).unwrap();
        let bytes: Vec<u8> = (0..4 * 3).flat_map(|i| [10 * (i % 4) as u8, 20 * (i / 4) as u8, 7]).collect();
        let color = ColorView::new(&bytes, 4, 3, 12).unwrap();
        let [b, g, r] = table.color(&color, 1.25, 0.5).unwrap();
        assert!((b - 12.5).abs() < 1e-12 && (g - 10.0).abs() < 1e-12 && (r - 7.0).abs() < 1e-12);
        assert!(table.color(&color, 3.0, 0.5).is_none() && table.color(&color, -0.1, 0.5).is_none());
        assert!(table.color(&color, f64::NAN, 0.5).is_none());
        let gray: Vec<u8> = (0..4 * 3).map(|i| 10 * (i % 4) as u8).collect();
        let view = ImageView::new(&gray, 4, 3, 4).unwrap();
        assert_eq!(table.gray(&view, 1.5, 1.0), Some(15.0));
        assert_eq!(table.gray(&view, 1.5, 2.0), None);
        let mut profile = [0.0; 3];
        let (middle, step) = (Vector2::new(1.4, 0.9), Vector2::new(0.7, -0.5));
        assert!(table.gray_profile(&view, &middle, &step, &mut profile));
        for (i, light) in profile.iter().enumerate() {
            let place = middle + step * (i as f64 - 1.0);
            assert_eq!(table.gray(&view, place.x, place.y), Some(*light));
        }
        assert!(!table.gray_profile(&view, &middle, &(3.0 * step), &mut profile));
        assert!(!table.gray_profile(&view, &Vector2::new(f64::NAN, 1.0), &step, &mut profile));
        assert!(ColorView::new(&bytes, 4, 3, 11).is_err() && ColorView::new(&bytes, 4, 4, 12).is_err());
    }

    #[test]
    fn the_display_curve_is_undone() {
        let table = LightTable::new(2.2).unwrap();
        assert_eq!(table.of(0), 0.0);
        assert_eq!(table.of(255), 255.0);
        assert!((table.of(186) / 255.0 - 0.5).abs() < 0.01);
        assert!(LightTable::new(0.0).is_err() && LightTable::new(f64::NAN).is_err());
    }
}
