//! Tables that a line extractor computes once for a camera: the pixels it looks at, their rays, and the elevations it sees.

use nalgebra::Matrix3;

use super::options::LineOptions;
use crate::camera::{Camera, bearing_table};
use crate::edges::{EdgeOptions, LiftTable, NormalKind, Prefilter, Region, surrounded, whole};
use crate::error::Result;

/// The unit of a table of bearings: the largest that 16 bits hold for components from -1 to 1.
const UNIT: f32 = 1.0 / 32767.0;

/// First component of what is no bearing.
const NO_RAY: i16 = i16::MIN;

/// Tables of one camera.
#[derive(Debug, Clone)]
pub(super) struct LineTables {
    pub(super) region: Region,
    pub(super) prefilter: Prefilter,
    /// Bearing of every pixel in the robot frame, in row order and units of [`UNIT`]: half the memory of single precision, to
    /// a thousandth of a degree. [`NO_RAY`] where there is none.
    rays: Vec<[i16; 3]>,
    /// How many pixels away, along rows, columns or both, the nearest is at or around which the world is not seen, at most 255;
    /// in row order.
    pub(super) clearance: Vec<u8>,
    pub(super) width: usize,
    pub(super) height: usize,
    /// Lowest and highest elevation, in radians, that are seen in most directions.
    pub(super) band: (f64, f64),
}

impl LineTables {
    pub(super) fn new(camera: &Camera, robot_from_camera: &Matrix3<f64>, options: &LineOptions) -> Result<Self> {
        // Ridges look at the neighbours' gradients.
        let edges = EdgeOptions { margin_px: options.edges.margin_px + 1.0, ..options.edges };
        let region = Region::new(camera, robot_from_camera, &edges, options.mask.as_ref())?;
        let lift = LiftTable::new(camera, robot_from_camera, &region, NormalKind::Tangent);
        let prefilter = lift.prefilter(1.0);
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let rays = bearing_table(camera, robot_from_camera, |_, ray| {
            ray.map_or([NO_RAY; 3], |ray| [ray.x, ray.y, ray.z].map(|x| whole(x / f64::from(UNIT)).max(-i16::MAX)))
        });
        let usable = |i: usize| {
            rays[i][0] != NO_RAY && options.mask.as_ref().is_none_or(|mask| mask.usable(i % width, i / width))
        };
        let clear = surrounded(usable, [width, height], 1);
        let clearance = distances(clear.into_iter().map(|sees| u8::MAX * u8::from(sees)).collect(), width);
        let band = band_of(&region);
        Ok(Self { region, prefilter, rays, clearance, width, height, band })
    }

    /// Whether the world is seen at every pixel up to `reach` away from `(u, v)`, along rows, columns or both, and around it.
    #[inline]
    pub(super) fn is_clear_around(&self, u: i32, v: i32, reach: u32) -> bool {
        let (Ok(u), Ok(v)) = (usize::try_from(u), usize::try_from(v)) else { return false };
        u < self.width && self.clearance.get(v * self.width + u).is_some_and(|clear| u32::from(*clear) > reach)
    }

    /// The ray of a pixel, and whether it has one.
    #[inline]
    pub(super) fn ray(&self, u: usize, v: usize) -> Option<[f32; 3]> {
        match self.rays.get(v * self.width + u) {
            Some([x, y, z]) if *x != NO_RAY => Some([f32::from(*x) * UNIT, f32::from(*y) * UNIT, f32::from(*z) * UNIT]),
            _ => None,
        }
    }
}

/// From 255 and 0 the distances to the nearest 0, along rows, columns or both, of an image whose border is 0.
fn distances(mut values: Vec<u8>, width: usize) -> Vec<u8> {
    // The neighbours in the row before first, all at once, then those along the row, one after the other.
    let relax = |row: &mut [u8], before: &[u8]| {
        for (at, three) in row[1..].iter_mut().zip(before.windows(3)) {
            *at = (*at).min(three[0].min(three[1]).min(three[2]).saturating_add(1));
        }
    };
    let along = |nearest: u8, at: &mut u8| {
        *at = (*at).min(nearest.saturating_add(1));
        *at
    };
    let height = values.len() / width;
    for v in 1..height.saturating_sub(1) {
        let (above, row) = values.split_at_mut(v * width);
        relax(&mut row[..width], &above[above.len() - width..]);
        row[..width].iter_mut().fold(0, along);
    }
    for v in (1..height.saturating_sub(1)).rev() {
        let (row, below) = values.split_at_mut((v + 1) * width);
        let row = &mut row[v * width..];
        relax(row, &below[..width]);
        row.iter_mut().rev().fold(0, along);
    }
    values
}

/// The elevations that three quarters of the directions see, of those that see any.
fn band_of(region: &Region) -> (f64, f64) {
    const SECTORS: usize = 90;
    let mut seen = [(f32::INFINITY, f32::NEG_INFINITY); SECTORS];
    let of_each = region.bearing_table(|ray| {
        let turn = (ray.y as f32).atan2(ray.x as f32) / std::f32::consts::TAU + 0.5;
        (((turn * SECTORS as f32) as usize).min(SECTORS - 1) as u8, (ray.z / ray.xy().norm()) as f32)
    });
    for (sector, tangent) in of_each {
        let (low, high) = &mut seen[usize::from(sector)];
        (*low, *high) = (low.min(tangent), high.max(tangent));
    }
    let sorted = |pick: fn(&(f32, f32)) -> f32| {
        let tangents = seen.iter().filter(|sector| sector.0 <= sector.1).map(pick);
        let mut values: Vec<f64> = tangents.map(|tangent| f64::from(tangent).atan()).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let (lows, highs) = (sorted(|sector| sector.0), sorted(|sector| sector.1));
    let (low, high) = (lows[3 * (lows.len() - 1) / 4], highs[(highs.len() - 1) / 4]);
    // A camera that sees no elevation in most directions: what it sees in any.
    if high - low > 0.05 { (low, high) } else { (lows[0], highs[highs.len() - 1].max(lows[0] + 0.05)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_to_the_nearest_zero() {
        let (width, height) = (23, 17);
        let edge = |at: usize, n: usize| at == 0 || at + 1 == n;
        let zero = |i: usize| edge(i % width, width) || edge(i / width, height) || (i * 7919).is_multiple_of(83);
        let values: Vec<u8> = (0..width * height).map(|i| if zero(i) { 0 } else { 255 }).collect();
        for (at, found) in distances(values, width).into_iter().enumerate() {
            let away = |i: usize| (i % width).abs_diff(at % width).max((i / width).abs_diff(at / width));
            let nearest = (0..width * height).filter(|i| zero(*i)).map(away).min().unwrap();
            assert_eq!(usize::from(found), nearest);
        }
    }
}
