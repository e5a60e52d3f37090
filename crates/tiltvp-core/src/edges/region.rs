//! The pixels of the elevation band, as spans of rows, computed once per camera.

use nalgebra::{Matrix3, Vector2, Vector3};
use tiltvp_kernels::prefetch::prefetch;

use super::options::{EdgeOptions, Mask};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::interrupt::check;

/// A run of pixels `first..end` of row `v`; `slot` numbers its first pixel among all pixels of the region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// Row.
    pub v: usize,
    /// First column.
    pub first: usize,
    /// One past the last column.
    pub end: usize,
    /// Number of the first pixel within the region.
    pub slot: usize,
}

/// The pixels whose bearings lie in the elevation band, clear of everything that is not the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    spans: Vec<Span>,
    bearings: Vec<Vector3<f64>>,
    /// Column and row of each pixel.
    places: Vec<(u16, u16)>,
    first_column: usize,
    end_column: usize,
    pixels_per_rad: f64,
}

/// Pixels after which a walk over all asks whether it is to end: a millisecond where a pixel takes 0.2 us.
const CHECKED_PIXELS: usize = 4096;

impl Region {
    /// Walks over the image once.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the mask has another size than the camera's images, [`Error::InvalidOption`] if no
    /// pixel is left.
    pub fn new(
        camera: &Camera,
        robot_from_camera: &Matrix3<f64>,
        options: &EdgeOptions,
        mask: Option<&Mask>,
    ) -> Result<Self> {
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        if let Some(mask) = mask
            && mask.size() != (width, height)
        {
            let (w, h) = mask.size();
            return Err(Error::argument(
                "mask",
                format!("{h} x {w}"),
                format!("{height} x {width}, as the camera's images"),
            ));
        }
        if width.max(height) > usize::from(u16::MAX) {
            return Err(Error::argument(
                "camera",
                format!("{width} x {height} pixels"),
                "images of at most 65535 pixels a side",
            ));
        }
        let (lowest, highest) = (options.elevation_min_rad.sin(), options.elevation_max_rad.sin());
        let mut bearings = vec![None; width * height];
        for (i, bearing) in bearings.iter_mut().enumerate() {
            let (u, v) = (i % width, i / width);
            if u == 0 {
                check();
            }
            if mask.is_none_or(|mask| mask.usable(u, v)) {
                *bearing = camera.unproject(&Vector2::new(u as f64, v as f64)).map(|b| robot_from_camera * b);
            }
        }
        let clear = erode(&bearings.iter().map(Option::is_some).collect::<Vec<_>>(), width, height, options.reach_px());
        let mut region = Self {
            spans: Vec::new(),
            bearings: Vec::new(),
            places: Vec::new(),
            first_column: width,
            end_column: 0,
            pixels_per_rad: 0.0,
        };
        for v in 0..height {
            let mut open: Option<Span> = None;
            for u in 0..=width {
                let inside = (u < width && clear[v * width + u])
                    .then(|| bearings[v * width + u])
                    .flatten()
                    .filter(|bearing| (lowest..=highest).contains(&bearing.z));
                match (inside, &mut open) {
                    (Some(bearing), _) => {
                        open.get_or_insert(Span { v, first: u, end: u, slot: region.bearings.len() }).end = u + 1;
                        region.bearings.push(bearing);
                        region.places.push((u as u16, v as u16));
                    }
                    (None, Some(span)) => {
                        region.first_column = region.first_column.min(span.first);
                        region.end_column = region.end_column.max(span.end);
                        region.spans.push(*span);
                        open = None;
                    }
                    (None, None) => {}
                }
            }
        }
        if region.bearings.is_empty() {
            return Err(Error::option(
                "elevation_min_rad, elevation_max_rad",
                format!("[{:.3}, {:.3}]", options.elevation_min_rad, options.elevation_max_rad),
                "a band that some pixel of the camera sees: check robot_from_camera, the mask and the margin",
            ));
        }
        region.pixels_per_rad = 1.0 / region.mean_solid_angle(camera).sqrt();
        Ok(region)
    }

    /// Every `stride`-th row of it: those whose number is a multiple. Pixels per radian fall as pixels do.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] if no pixel is left, or for a stride of zero.
    pub fn every_row(self, stride: u32) -> Result<Self> {
        if stride == 1 {
            return Ok(self);
        }
        let mut thinned = Self {
            spans: Vec::new(),
            bearings: Vec::new(),
            places: Vec::new(),
            first_column: usize::MAX,
            end_column: 0,
            pixels_per_rad: self.pixels_per_rad / f64::from(stride),
        };
        for span in self.spans.iter().filter(|span| span.v.checked_rem(stride as usize) == Some(0)) {
            let own = span.slot..span.slot + span.end - span.first;
            thinned.spans.push(Span { slot: thinned.bearings.len(), ..*span });
            thinned.bearings.extend_from_slice(&self.bearings[own.clone()]);
            thinned.places.extend_from_slice(&self.places[own]);
            thinned.first_column = thinned.first_column.min(span.first);
            thinned.end_column = thinned.end_column.max(span.end);
        }
        if thinned.bearings.is_empty() {
            return Err(Error::option("row_stride", stride, "a number of rows from 1 on that leaves some of the band"));
        }
        Ok(thinned)
    }

    /// Mean solid angle of a pixel in steradians, over a sample of the pixels.
    fn mean_solid_angle(&self, camera: &Camera) -> f64 {
        let angle = |(u, v): &(u16, u16)| {
            let (_, back) = camera.unproject_jacobian(&Vector2::new(f64::from(*u), f64::from(*v)))?;
            Some(back.column(0).cross(&back.column(1)).norm())
        };
        let angles: Vec<f64> = self.places.iter().step_by(1 + self.places.len() / 1024).filter_map(angle).collect();
        angles.iter().sum::<f64>() / angles.len().max(1) as f64
    }

    /// The spans, row by row.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// How many pixels there are.
    pub fn len(&self) -> usize {
        self.bearings.len()
    }

    /// Whether there are none (never, once made).
    pub fn is_empty(&self) -> bool {
        self.bearings.is_empty()
    }

    /// Columns `first..end` that hold all spans.
    pub fn columns(&self) -> std::ops::Range<usize> {
        self.first_column..self.end_column
    }

    /// Pixels per radian in the mean over the region: the root of the pixels per steradian, divided by the stride of rows.
    pub fn pixels_per_rad(&self) -> f64 {
        self.pixels_per_rad
    }

    /// Column and row of the pixel `slot`; (0, 0) beyond the region.
    #[inline]
    pub fn place(&self, slot: usize) -> (u16, u16) {
        self.places.get(slot).copied().unwrap_or_default()
    }

    /// The unit bearing of the pixel `slot` in the robot frame; none beyond the region.
    #[inline]
    pub fn bearing(&self, slot: usize) -> Option<&Vector3<f64>> {
        self.bearings.get(slot)
    }

    /// Asks for the bearing of a pixel that will be read soon.
    #[inline]
    pub(crate) fn prefetch(&self, slot: usize) {
        prefetch(&self.bearings, slot);
    }

    /// Each pixel `(u, v)` of the region with its bearing in the robot frame, in slot order.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, usize, Vector3<f64>)> + '_ {
        self.places.iter().zip(&self.bearings).enumerate().map(|(slot, ((u, v), bearing))| {
            if slot.is_multiple_of(CHECKED_PIXELS) {
                check();
            }
            (usize::from(*u), usize::from(*v), *bearing)
        })
    }
}

/// `true` where the whole square of `reach` pixels about a pixel is `true`; what lies outside the image is not.
fn erode(inside: &[bool], width: usize, height: usize, reach: usize) -> Vec<bool> {
    let shrink = |source: &[bool], length: usize, lines: usize, at: &dyn Fn(usize, usize) -> usize| {
        let mut out = vec![false; source.len()];
        for line in 0..lines {
            let mut run = 0;
            for i in 0..length {
                run = if source[at(line, i)] { run + 1 } else { 0 };
                if run > 2 * reach {
                    out[at(line, i - reach)] = true;
                }
            }
        }
        out
    };
    let rows = shrink(inside, width, height, &|v, u| v * width + u);
    shrink(&rows, height, width, &|u, v| v * width + u)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Equidistant, Model};

    fn camera() -> Camera {
        let lens = Equidistant::new(139.7, 319.5, 239.5).unwrap();
        Camera::new(640, 480, Model::Equidistant(lens)).unwrap().with_max_theta_rad(92.5f64.to_radians()).unwrap()
    }

    #[test]
    fn spans_cover_the_annulus_in_slot_order() {
        let region = Region::new(&camera(), &Matrix3::identity(), &EdgeOptions::default(), None).unwrap();
        let area = std::f64::consts::PI * (219.4f64.powi(2) - 109.7f64.powi(2));
        assert!((region.len() as f64 / area - 1.0).abs() < 0.005, "{} pixels, {area} expected", region.len());
        let mut slot = 0;
        for span in region.spans() {
            assert_eq!(span.slot, slot);
            slot += span.end - span.first;
        }
        assert_eq!(slot, region.len());
        for (u, v, bearing) in region.pixels() {
            let theta = (u as f64 - 319.5).hypot(v as f64 - 239.5) / 139.7;
            assert!((theta.cos() - bearing.z).abs() < 1e-9);
        }
        // The band of elevations from 0 to 45 degrees has sqrt(2) pi steradians.
        let mean = (area / (2f64.sqrt() * std::f64::consts::PI)).sqrt();
        assert!((region.pixels_per_rad() / mean - 1.0).abs() < 0.01, "{} pixels per radian", region.pixels_per_rad());
    }

    #[test]
    fn mask_and_margin_keep_clear() {
        let usable: Vec<bool> = (0..640 * 480).map(|i| i % 640 > 320).collect();
        let mask = Mask::new(640, 480, usable).unwrap();
        let options = EdgeOptions { margin_px: 3.0, ..EdgeOptions::default() };
        let region = Region::new(&camera(), &Matrix3::identity(), &options, Some(&mask)).unwrap();
        assert_eq!(region.columns().start, 321 + 4);
    }

    #[test]
    fn thinned_rows_are_those_of_the_whole() {
        let whole = Region::new(&camera(), &Matrix3::identity(), &EdgeOptions::default(), None).unwrap();
        for stride in [2, 3, 7] {
            let thinned = whole.clone().every_row(stride).unwrap();
            assert!(thinned.pixels().eq(whole.pixels().filter(|(_, v, _)| v % stride as usize == 0)));
            let ends = thinned.spans().iter().map(|span| span.slot + span.end - span.first);
            assert!(ends.eq(thinned.spans().iter().skip(1).map(|span| span.slot).chain([thinned.len()])));
            assert!((thinned.pixels_per_rad() * f64::from(stride) / whole.pixels_per_rad() - 1.0).abs() < 1e-12);
        }
        assert_eq!(whole.clone().every_row(1).unwrap(), whole);
        assert!(whole.clone().every_row(0).is_err() && whole.every_row(1000).is_err());
    }

    #[test]
    fn an_empty_band_is_refused() {
        let options = EdgeOptions { elevation_min_rad: -1.5, elevation_max_rad: -1.0, ..EdgeOptions::default() };
        assert!(Region::new(&camera(), &Matrix3::identity(), &options, None).is_err());
    }
}
