//! What is known of the pixels that are looked at: made once, and shared by the estimators for which it is the same.

use nalgebra::Vector3;

use super::confidence::SECTORS;
use super::correction::VanishingPoint;
use super::image_circle::ImageCircle;
use super::image_edges::EdgeOrigin;
use super::lightness::Lightness;
use super::overhead::Overhead;
use super::shared_tables::SharedTables;
use super::sharpness::Sharpness;
use crate::edges::Region;
use crate::error::Result;

/// The pixels that are looked at, and what is known of each.
#[derive(Debug)]
pub(super) struct PixelTables {
    pub region: Region,
    /// Sector of azimuth of each pixel.
    pub sectors: Vec<u8>,
    /// Degrees of each pixel above the horizon.
    pub heights_deg: Vec<i8>,
    /// Where the vertical of the upright robot is seen.
    pub vertical: Option<VanishingPoint>,
    /// Where the rim of the image circle is to be, if the calibration says so.
    pub circle: Option<ImageCircle>,
    /// Where it is looked how light the view is.
    pub lightness: Lightness,
    /// Where it is looked how wide the steps of an image are.
    pub sharpness: Sharpness,
    /// Where lines overhead are looked for.
    pub overhead: Overhead,
    /// What the methods look up.
    pub shared: SharedTables,
}

impl PixelTables {
    pub(super) fn new(origin: &EdgeOrigin) -> Result<Self> {
        let EdgeOrigin { camera, robot_from_camera, options, mask, row_stride } = origin;
        let (front, back, degrees) = (Steps::new(front_sector), Steps::new(back_sector), Steps::new(degrees));
        let of_bearing = |bearing: &Vector3<f64>| {
            let side = bearing.y / (bearing.x.abs() + bearing.y.abs());
            (if bearing.x < 0.0 { back.at(side) } else { front.at(side) }, degrees.at(bearing.z))
        };
        let (whole, notes) = Region::with_notes(camera, robot_from_camera, options, mask.as_ref(), of_bearing)?;
        let of_kept = whole.places().zip(notes).filter(|((_, v), _)| (*v as u32).is_multiple_of(*row_stride));
        let (mut sectors, mut heights_deg): (Vec<_>, Vec<_>) = of_kept.map(|(_, note)| note).unzip();
        sectors.shrink_to_fit();
        heights_deg.shrink_to_fit();
        let vertical = VanishingPoint::new(camera, robot_from_camera);
        let overhead = Overhead::new(origin, whole.pixels_per_rad());
        let sharpness = Sharpness::new(&whole, vertical.as_ref());
        let region = whole.every_row(*row_stride)?;
        let circle = ImageCircle::new(camera);
        let lightness = Lightness::new(camera, robot_from_camera, mask.as_ref());
        let shared = SharedTables::default();
        Ok(Self { region, sectors, heights_deg, vertical, circle, lightness, sharpness, overhead, shared })
    }
}

/// A function of numbers from -1 to 1 that rises or falls by steps, kept for the bins in which there is no step.
struct Steps<T> {
    of: fn(f64) -> T,
    bins: Vec<Option<T>>,
}

/// Bins of a table: of the 180 degrees and the 32 sectors of half a turn one in ten and fewer have a step.
const BINS: usize = 4096;

impl<T: Copy + PartialEq> Steps<T> {
    fn new(of: fn(f64) -> T) -> Self {
        let end = |bin: usize| of(2.0 * bin as f64 / BINS as f64 - 1.0);
        Self { of, bins: (0..BINS).map(|bin| Some(end(bin)).filter(|first| *first == end(bin + 1))).collect() }
    }

    fn at(&self, number: f64) -> T {
        let bin = ((number + 1.0) * (0.5 * BINS as f64)) as usize;
        self.bins.get(bin).copied().flatten().unwrap_or_else(|| (self.of)(number))
    }
}

/// The sector of azimuth of what is to the front, told by how far to the left it is: the share of y in |x| + |y|, with its sign.
fn front_sector(side: f64) -> u8 {
    sector(1.0 - side.abs(), side)
}

/// The same of what is behind.
fn back_sector(side: f64) -> u8 {
    sector(side.abs() - 1.0, side)
}

/// The sector of azimuth of a direction.
pub(super) fn sector(x: f64, y: f64) -> u8 {
    let turn = y.atan2(x) / std::f64::consts::TAU + 0.5;
    ((turn * SECTORS as f64) as usize).min(SECTORS - 1) as u8
}

/// Degrees above the horizon, of a sine.
fn degrees(sine: f64) -> i8 {
    sine.clamp(-1.0, 1.0).asin().to_degrees().round() as i8
}
