//! The pixels of the elevation band, as spans of rows, computed once per camera.

use std::ops::Range;

use nalgebra::{Matrix3, SVector, Vector2, Vector3};

use super::options::{EdgeOptions, Mask};
use crate::camera::{Camera, Interpolated, bearing_table, bearings};
use crate::error::{Error, Result};
use crate::interrupt::check;
use crate::parallel;

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
    camera: Camera,
    robot_from_camera: Matrix3<f64>,
    spans: Vec<Span>,
    /// Column and row of each pixel.
    places: Vec<(u16, u16)>,
    first_column: usize,
    end_column: usize,
    pixels_per_rad: f64,
}

/// Bytes a pixel of the image that its tables take at most: places 4, sectors 1, maps 12, the prefilter's vectors 4.
const TABLE_BYTES: usize = 21;

/// Bytes a pixel that the memory of one thread takes at most, where every pixel is an edge pixel.
const SCRATCH_BYTES: usize = 49;

/// Pixels after which a walk over all asks whether it is to end: a millisecond where a pixel takes 0.2 us.
const CHECKED_PIXELS: usize = 4096;

impl Region {
    /// Walks over the image once. Bearings are computed again where they are asked for: they would be most of the memory.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the mask has another size than the camera's images, [`Error::InvalidOption`] if no
    /// pixel is left, [`Error::InvalidCamera`] if the tables of the camera do not fit into memory.
    pub fn new(
        camera: &Camera,
        robot_from_camera: &Matrix3<f64>,
        options: &EdgeOptions,
        mask: Option<&Mask>,
    ) -> Result<Self> {
        Self::with_notes(camera, robot_from_camera, options, mask, |_| ()).map(|(region, _)| region)
    }

    /// The same, with what is noted of the bearing of each of its pixels in the robot frame.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub(crate) fn with_notes<T: Copy + Default + Send + Sync>(
        camera: &Camera,
        robot_from_camera: &Matrix3<f64>,
        options: &EdgeOptions,
        mask: Option<&Mask>,
        note: impl Fn(&Vector3<f64>) -> T + Sync,
    ) -> Result<(Self, Vec<T>)> {
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
        camera.check_memory(TABLE_BYTES + SCRATCH_BYTES)?;
        let (lowest, highest) = (options.elevation_min_rad.sin(), options.elevation_max_rad.sin());
        let seen = bearing_table(camera, robot_from_camera, |i, bearing| {
            if mask.is_some_and(|mask| !mask.usable(i % width, i / width)) {
                return (Sight::None, T::default());
            }
            match bearing {
                Some(b) if (lowest..=highest).contains(&b.z) => (Sight::Band, note(&b)),
                Some(_) => (Sight::World, T::default()),
                None => (Sight::None, T::default()),
            }
        });
        let mut inside = surrounded(|i| seen[i].0 != Sight::None, [width, height], options.reach_px());
        inside.iter_mut().zip(&seen).for_each(|(inside, (sight, _))| *inside &= *sight == Sight::Band);
        let count = inside.iter().filter(|inside| **inside).count();
        let mut notes = Vec::with_capacity(count);
        let mut region = Self {
            camera: camera.clone(),
            robot_from_camera: *robot_from_camera,
            spans: Vec::new(),
            places: Vec::with_capacity(count),
            first_column: width,
            end_column: 0,
            pixels_per_rad: 0.0,
        };
        for (v, row) in inside.chunks_exact(width).enumerate() {
            check();
            let mut end = 0;
            while let Some(away) = row[end..].iter().position(|inside| *inside) {
                let first = end + away;
                end = row[first..].iter().position(|inside| !inside).map_or(width, |length| first + length);
                region.spans.push(Span { v, first, end, slot: region.places.len() });
                region.places.extend((first..end).map(|u| (u as u16, v as u16)));
                notes.extend(seen[v * width..][first..end].iter().map(|(_, note)| *note));
                region.first_column = region.first_column.min(first);
                region.end_column = region.end_column.max(end);
            }
        }
        let shows_nothing = |mask: &Mask| (0..height).all(|v| (0..width).all(|u| !mask.usable(u, v)));
        if region.places.is_empty() && mask.is_some_and(shows_nothing) {
            return Err(Error::argument("mask", "False everywhere", "True where images show the world"));
        }
        if region.places.is_empty() {
            return Err(Error::option(
                "elevation_min_rad, elevation_max_rad",
                format!("[{:.3}, {:.3}]", options.elevation_min_rad, options.elevation_max_rad),
                "a band that some pixel of the camera sees: check robot_from_camera, the mask and the margin",
            ));
        }
        region.pixels_per_rad = 1.0 / region.mean_solid_angle().sqrt();
        Ok((region, notes))
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
            camera: self.camera,
            robot_from_camera: self.robot_from_camera,
            spans: Vec::new(),
            places: Vec::new(),
            first_column: usize::MAX,
            end_column: 0,
            pixels_per_rad: self.pixels_per_rad / f64::from(stride),
        };
        for span in self.spans.iter().filter(|span| span.v.checked_rem(stride as usize) == Some(0)) {
            let own = span.slot..span.slot + span.end - span.first;
            thinned.spans.push(Span { slot: thinned.places.len(), ..*span });
            thinned.places.extend_from_slice(&self.places[own]);
            thinned.first_column = thinned.first_column.min(span.first);
            thinned.end_column = thinned.end_column.max(span.end);
        }
        if thinned.places.is_empty() {
            return Err(Error::option("row_stride", stride, "a number of rows from 1 on that leaves some of the band"));
        }
        Ok(thinned)
    }

    /// An entry for each slot, of its bearing in the robot frame but for a millionth.
    pub(crate) fn bearing_table<T: Clone + Default + Send>(&self, of: impl Fn(Vector3<f64>) -> T + Sync) -> Vec<T> {
        let lens = bearings(&self.camera, &self.robot_from_camera);
        parallel::filled(self.len(), |first, out: &mut [T]| {
            self.along(&lens, first..first + out.len(), |k, bearing| out[k] = of(bearing));
        })
    }

    /// Tells of some slots what the lens has there, each by its number among them; zeros where it has nothing.
    pub(crate) fn along<const N: usize, F: Fn(Vector2<f64>) -> Option<SVector<f64, N>> + Sync>(
        &self,
        lens: &Interpolated<N, F>,
        slots: Range<usize>,
        mut tell: impl FnMut(usize, SVector<f64, N>),
    ) {
        let first = self.spans.partition_point(|span| span.slot + span.end - span.first <= slots.start);
        for span in self.spans[first..].iter().take_while(|span| span.slot < slots.end) {
            let own = span.slot.max(slots.start)..(span.slot + span.end - span.first).min(slots.end);
            let column = |slot: usize| span.first + slot - span.slot;
            lens.along(span.v, column(own.start)..column(own.end), |k, value| {
                tell(own.start - slots.start + k, value.unwrap_or_else(SVector::zeros));
            });
        }
    }

    /// Mean solid angle of a pixel in steradians, over a sample of the pixels.
    fn mean_solid_angle(&self) -> f64 {
        let angle = |(u, v): &(u16, u16)| {
            let (_, back) = self.camera.unproject_jacobian(&Vector2::new(f64::from(*u), f64::from(*v)))?;
            Some(back.column(0).cross(&back.column(1)).norm())
        };
        let angles: Vec<f64> = self.places.iter().step_by(1 + self.places.len() / 1024).filter_map(angle).collect();
        angles.iter().sum::<f64>() / angles.len().max(1) as f64
    }

    /// The spans, row by row.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// Columns and rows of the images.
    pub(crate) fn image_size(&self) -> [usize; 2] {
        [self.camera.width() as usize, self.camera.height() as usize]
    }

    /// How many pixels there are.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there are none (never, once made).
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
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

    /// Unit bearing in the robot frame of the pixel `slot`.
    #[inline]
    pub(crate) fn bearing(&self, slot: usize) -> Vector3<f64> {
        let (u, v) = self.place(slot);
        let seen = self.camera.unproject(&Vector2::new(f64::from(u), f64::from(v)));
        self.robot_from_camera * seen.unwrap_or_else(|| Vector3::repeat(f64::NAN))
    }

    /// Each pixel `(u, v)` of the region with its bearing in the robot frame, in slot order.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, usize, Vector3<f64>)> + '_ {
        self.places().enumerate().map(|(slot, (u, v))| (u, v, self.bearing(slot)))
    }

    /// `(u, v)` of every pixel, in slot order.
    pub fn places(&self) -> impl ExactSizeIterator<Item = (usize, usize)> + Clone + '_ {
        self.places.iter().enumerate().map(|(slot, (u, v))| {
            if slot.is_multiple_of(CHECKED_PIXELS) {
                check();
            }
            (usize::from(*u), usize::from(*v))
        })
    }
}

/// What a pixel sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Sight {
    /// Nothing of the world.
    #[default]
    None,
    /// The world, outside the elevation band.
    World,
    /// The elevation band.
    Band,
}

/// Whether `is` holds, which is told by the number of a pixel, for all that are up to `reach` away from each along rows, columns and
/// both; it does not for what lies outside the image.
pub(crate) fn surrounded(is: impl Fn(usize) -> bool + Sync, size: [usize; 2], reach: usize) -> Vec<bool> {
    let [width, height] = size;
    let across: Vec<bool> = parallel::rows(size, |v, row| {
        let mut run = 0;
        for u in 0..width {
            run = if is(v * width + u) { run + 1 } else { 0 };
            if run > 2 * reach {
                row[u - reach] = true;
            }
        }
    });
    parallel::rows(size, |v, row: &mut [bool]| {
        if v >= reach && v + reach < height {
            row.fill(true);
            for other in across[(v - reach) * width..(v + reach + 1) * width].chunks_exact(width) {
                row.iter_mut().zip(other).for_each(|(out, other)| *out &= *other);
            }
        }
    })
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
