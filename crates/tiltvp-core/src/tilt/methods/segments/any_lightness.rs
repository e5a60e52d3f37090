//! How light a view is by height above any direction that may be up, as `tilt/lightness.rs` tells of the one that is told.

use nalgebra::Vector3;

use crate::edges::Region;
use crate::image::ImageView;
use crate::tilt::lightness::{BANDS, VARIES};

/// Pixels of a view that are looked at, about.
const SAMPLED: f64 = 2000.0;

/// Sampled pixels below which a band's lightness is drawn to the mean, and its spread not told.
const FEW: f32 = 20.0;

/// A grid of a region's pixels.
#[derive(Debug, Default)]
pub(super) struct Sample {
    pixels: Vec<(usize, usize)>,
    /// Their bearings in the robot frame.
    bearings: Vec<Vector3<f32>>,
}

/// The grey levels of a sample in one image, less their mean, in standard deviations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lightness<'a> {
    bearings: &'a [Vector3<f32>],
    levels: &'a [f32],
}

impl Sample {
    pub(super) fn new(region: &Region) -> Self {
        let step = ((region.len() as f64 / SAMPLED).sqrt().round() as usize).max(1);
        let on_grid = |(u, v): (usize, usize)| u % step == step / 2 && v % step == step / 2;
        let (pixels, bearings) = region
            .places()
            .enumerate()
            .filter(|(_, place)| on_grid(*place))
            .map(|(slot, place)| (place, region.bearing(slot).cast()))
            .unzip();
        Self { pixels, bearings }
    }

    /// How light an image is there. `levels` is scratch.
    pub(super) fn lightness<'a>(&'a self, image: &ImageView<'_>, levels: &'a mut Vec<f32>) -> Lightness<'a> {
        levels.clear();
        levels.extend(self.pixels.iter().map(|(u, v)| f32::from(image.row(*v).get(*u).copied().unwrap_or(0))));
        let n = levels.len().max(1) as f32;
        let mean = levels.iter().sum::<f32>() / n;
        let deviation = (levels.iter().map(|level| (level - mean).powi(2)).sum::<f32>() / n).sqrt();
        for level in &mut *levels {
            *level = (*level - mean) / deviation.max(VARIES as f32);
        }
        Lightness { bearings: &self.bearings, levels }
    }
}

impl Lightness<'_> {
    /// How light the bands above a direction's horizon and below it are, the lowest first, and by how much each varies.
    pub(super) fn bands(&self, up: &Vector3<f64>) -> [f64; 2 * BANDS] {
        let up = up.cast::<f32>();
        let (mut seen, mut sums, mut squares) = ([0.0f32; BANDS], [0.0f32; BANDS], [0.0f32; BANDS]);
        for (bearing, level) in self.bearings.iter().zip(self.levels) {
            let band = ((bearing.dot(&up) + 1.0) * (0.5 * BANDS as f32)).clamp(0.0, BANDS as f32 - 1.0) as usize;
            seen[band] += 1.0;
            sums[band] += level;
            squares[band] += level * level;
        }
        std::array::from_fn(|i| {
            let (band, n) = (i % BANDS, seen[i % BANDS]);
            if i < BANDS {
                return f64::from(sums[band] / (n + FEW));
            }
            let mean = sums[band] / n.max(1.0);
            if n > FEW { f64::from((squares[band] / n - mean * mean).max(0.0).sqrt()) } else { 0.0 }
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::camera::{Camera, Equidistant, Model};
    use crate::edges::EdgeOptions;

    #[test]
    fn what_is_light_above_is_light_in_the_upper_bands() {
        let lens = Equidistant::new(40.0, 79.5, 59.5).unwrap();
        let camera = Camera::new(160, 120, Model::Equidistant(lens)).unwrap();
        let options = EdgeOptions { elevation_min_rad: -2.0, elevation_max_rad: 2.0, ..EdgeOptions::default() };
        let region = Region::new(&camera, &Matrix3::identity(), &options, None).unwrap();
        let sample = Sample::new(&region);
        assert!((1000..4000).contains(&sample.pixels.len()), "{}", sample.pixels.len());
        // The left half of the image is light: the camera's -x is up there.
        let levels: Vec<u8> = (0..160 * 120).map(|i| if i % 160 < 80 { 200 } else { 40 }).collect();
        let image = ImageView::new(&levels, 160, 120, 160).unwrap();
        let mut scratch = Vec::new();
        let lightness = sample.lightness(&image, &mut scratch);
        for (up, sign) in [(-Vector3::x(), 1.0), (Vector3::x(), -1.0)] {
            let bands = lightness.bands(&up);
            assert!(sign * bands[0] < -0.5 && sign * bands[7] > 0.5, "{bands:?}");
            assert!(bands[BANDS..].iter().all(|spread| *spread < 0.5), "{bands:?}");
        }
        let across = lightness.bands(&Vector3::y());
        assert!(across[..BANDS].iter().all(|level| level.abs() < 0.2), "{across:?}");
        assert!(across[BANDS..].iter().all(|spread| *spread > 0.5), "{across:?}");
    }
}
