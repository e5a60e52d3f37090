//! How light a view is at each height: ceilings and skies, walls, and floors are light and even in different ways.

use nalgebra::{Matrix3, Vector2};

use crate::camera::Camera;
use crate::edges::Mask;
use crate::image::ImageView;

/// Bands of equal solid angle from straight down to straight up: above the horizon ceiling, lamps, windows and doors.
pub(super) const BANDS: usize = 8;

/// Numbers that tell of it: how light each band is, and by how much it varies.
pub(super) const LIGHTS: usize = 2 * BANDS;

/// Pixels of an image that are looked at: bands have a hundred then, and their means err by a tenth of their spread.
const PIXELS: f64 = 1000.0;

/// Pixels of a band at which it counts half: of fewer, which are of one or two things, less.
const FEW: f64 = 10.0;

/// How much a band varies in the mean of 149 views as they are, in standard deviations of the view.
const USUAL: f64 = 0.8;

/// Grey levels by which a view varies at least, for one that does not.
pub(super) const VARIES: f64 = 1.0;

/// The pixels that are looked at, by their bands: made once.
#[derive(Debug)]
pub(super) struct Lightness([Vec<(u16, u16)>; BANDS]);

impl Lightness {
    pub(super) fn new(camera: &Camera, robot_from_camera: &Matrix3<f64>, mask: Option<&Mask>) -> Self {
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let step = (((width * height) as f64 / PIXELS).sqrt() as usize).max(1);
        let mut bands: [Vec<(u16, u16)>; BANDS] = Default::default();
        for v in (step / 2..height).step_by(step) {
            for u in (step / 2..width).step_by(step) {
                if !mask.is_none_or(|mask| mask.usable(u, v)) {
                    continue;
                }
                if let Some(bearing) = camera.unproject(&Vector2::new(u as f64, v as f64)) {
                    let height = (robot_from_camera * bearing).z;
                    let band = ((height + 1.0) * (0.5 * BANDS as f64)) as usize;
                    bands[band.min(BANDS - 1)].push((u as u16, v as u16));
                }
            }
        }
        Self(bands)
    }

    /// How light each band is, in standard deviations of the view from its mean, and how much more than usually each varies; zero
    /// for what is not seen.
    pub(super) fn of(&self, image: &ImageView<'_>) -> [f64; LIGHTS] {
        let mut sums = [[0.0; 3]; BANDS];
        for (band, [count, total, squares]) in self.0.iter().zip(&mut sums) {
            let (mut sum, mut square) = (0u64, 0u64);
            for (u, v) in band {
                let level = u64::from(image.row(usize::from(*v)).get(usize::from(*u)).copied().unwrap_or(0));
                sum += level;
                square += level * level;
            }
            (*count, *total, *squares) = (band.len() as f64, sum as f64, square as f64);
        }
        let [count, total, squares] = [0, 1, 2].map(|i| sums.iter().map(|sums| sums[i]).sum::<f64>());
        if count == 0.0 {
            return [0.0; LIGHTS];
        }
        let mean = total / count;
        let deviation = (squares / count - mean * mean).max(0.0).sqrt().max(VARIES);
        let mut lights = [0.0; LIGHTS];
        let (levels, spreads) = lights.split_at_mut(BANDS);
        for (([count, total, squares], level), spread) in sums.into_iter().zip(levels).zip(spreads) {
            if count > 0.0 {
                let (own, share) = (total / count, count / (count + FEW));
                *level = share * (own - mean) / deviation;
                *spread = share * ((squares / count - own * own).max(0.0).sqrt() / deviation - USUAL);
            }
        }
        lights
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::camera::{Camera, Equirectangular};

    #[test]
    fn what_is_light_above_is_told_and_exposure_is_not() {
        let camera = Camera::new(200, 100, Equirectangular::new(200, 100).unwrap().into()).unwrap();
        let ahead = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        let upside_down = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, -1.0, -1.0)) * ahead;
        let lights = |mounting: &Matrix3<f64>, above: u8, below: u8| {
            let image: Vec<u8> = (0..200 * 100).map(|i| if i < 200 * 50 { above } else { below }).collect();
            Lightness::new(&camera, mounting, None).of(&ImageView::new(&image, 200, 100, 200).unwrap())
        };
        let seen = lights(&ahead, 160, 40);
        assert!(seen[..4].iter().all(|level| *level < -0.8) && seen[4..8].iter().all(|level| *level > 0.8), "{seen:?}");
        assert!(seen[8..].iter().all(|spread| *spread < -0.6), "{seen:?}");
        let apart =
            |a: [f64; LIGHTS], b: [f64; LIGHTS]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart(seen, lights(&ahead, 80, 20)) < 1e-9);
        assert!(apart(seen, lights(&upside_down, 40, 160)) < 0.1);
        assert_eq!(lights(&ahead, 90, 90)[..8], [0.0; 8]);
    }
}
