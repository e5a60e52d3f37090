//! What is seen through the windows: sky, a skyline of houses and trees, infinitely far away.

use nalgebra::Vector3;

use crate::noise::{fractal_noise, hash_unit};
use crate::texture::{Color, mix, rgb, scale};

/// Share of the light of the landscape that reaches the eye: panes are tinted, so that the view is not burnt out.
const GLASS: f64 = 0.5;

/// The day outside: brightness, where the sun is, and the seed of the skyline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Outdoors {
    /// Radiance of the bright sky.
    pub(crate) brightness: f64,
    /// Unit direction towards the sun, world frame.
    pub(crate) towards_sun: Vector3<f64>,
    /// Irradiance of the sun on a surface that faces it; 0 behind clouds and at night.
    pub(crate) sun: f64,
    /// Seed of skyline and clouds.
    pub(crate) seed: u32,
}

impl Outdoors {
    /// The radiance from a unit direction of the world frame.
    pub(crate) fn radiance(&self, direction: &Vector3<f64>) -> Color {
        let azimuth = direction.y.atan2(direction.x);
        let elevation = direction.z.atan2(direction.xy().norm());
        scale(self.reflectance(azimuth, elevation), GLASS * self.brightness)
    }

    fn reflectance(&self, azimuth: f64, elevation: f64) -> Color {
        let block = (azimuth / 0.22).floor();
        let house = 0.05 + 0.22 * hash_unit(block as i64, 0, self.seed);
        let trees = 0.06 + 0.10 * fractal_noise(azimuth, 0.0, 0.3, 5, 0.0, self.seed);
        if elevation < -0.04 {
            return mix(rgb(96, 104, 80), rgb(120, 118, 110), -elevation);
        }
        if elevation < trees {
            return scale(rgb(58, 80, 46), 1.0 + 0.5 * fractal_noise(azimuth, elevation, 0.05, 3, 0.0, self.seed ^ 3));
        }
        if elevation < house {
            let (column, row) = ((azimuth / 0.044).floor(), (elevation / 0.045).floor());
            let (x, y) = (azimuth / 0.044 - column, elevation / 0.045 - row);
            let wall = [rgb(186, 150, 120), rgb(200, 196, 186), rgb(150, 100, 84)]
                [(hash_unit(block as i64, 1, self.seed) * 3.0) as usize % 3];
            let pane = (0.25..0.75).contains(&x) && (0.2..0.75).contains(&y);
            return if pane { rgb(70, 80, 96) } else { scale(wall, 0.8) };
        }
        let cloud = fractal_noise(azimuth, 2.5 * elevation, 0.5, 4, 0.0, self.seed ^ 5);
        mix(mix(rgb(236, 242, 250), rgb(150, 190, 236), 1.2 * elevation), [1.1; 3], 0.4 + 1.2 * cloud)
    }
}
