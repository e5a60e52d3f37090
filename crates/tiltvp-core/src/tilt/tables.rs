//! What is known of the pixels that are looked at: made once, and shared by the estimators for which it is the same.

use nalgebra::Vector3;

use super::confidence::SECTORS;
use super::correction::VanishingPoint;
use super::image_circle::ImageCircle;
use super::image_edges::EdgeOrigin;
use super::lightness::Lightness;
use super::shared_tables::SharedTables;
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
    /// What the methods look up.
    pub shared: SharedTables,
}

impl PixelTables {
    pub(super) fn new(origin: &EdgeOrigin) -> Result<Self> {
        let EdgeOrigin { camera, robot_from_camera, options, mask, row_stride } = origin;
        let sector = |bearing: &Vector3<f64>| -> u8 {
            let turn = bearing.y.atan2(bearing.x) / std::f64::consts::TAU + 0.5;
            ((turn * SECTORS as f64) as usize).min(SECTORS - 1) as u8
        };
        let degrees = |bearing: &Vector3<f64>| bearing.z.clamp(-1.0, 1.0).asin().to_degrees().round() as i8;
        let of_bearing = |bearing: &Vector3<f64>| (sector(bearing), degrees(bearing));
        let (whole, notes) = Region::with_notes(camera, robot_from_camera, options, mask.as_ref(), of_bearing)?;
        let of_kept = whole.places().zip(notes).filter(|((_, v), _)| (*v as u32).is_multiple_of(*row_stride));
        let kept: Vec<_> = of_kept.map(|(_, note)| note).collect();
        let region = whole.every_row(*row_stride)?;
        let (sectors, heights_deg) = kept.into_iter().unzip();
        let vertical = VanishingPoint::new(camera, robot_from_camera);
        let circle = ImageCircle::new(camera);
        let lightness = Lightness::new(camera, robot_from_camera, mask.as_ref());
        Ok(Self { region, sectors, heights_deg, vertical, circle, lightness, shared: SharedTables::default() })
    }
}
