//! From light to grey levels: exposure, blur, gamma, noise.

use rayon::prelude::*;
use tiltvp_core::options::{Between, POSITIVE};
use tiltvp_core::{methods, options};

use crate::rng::Rng;
use crate::texture::luminance;

options! {
    /// Like a camera's automatic: no more than a tenth of the valid pixels are washed out.
    #[derive(Copy)]
    pub struct AutoExposure {
        /// What the mean level of the valid pixels becomes, of full scale.
        mean_level: f64 = 0.45 => Between(0.0, 1.0), "a level within (0, 1)";
    }
}

options! {
    /// The same for every view.
    #[derive(Copy)]
    pub struct FixedExposure {
        /// Factor on radiance; white in the room's light has a radiance of 1, display white is 1.
        gain: f64 = 1.0 => POSITIVE, "a positive number";
    }
}

methods! {
    /// How light becomes brightness.
    #[derive(Copy)]
    #[non_exhaustive]
    pub enum Exposure {
        /// By the light in the view.
        Auto(AutoExposure) = "auto",
        /// By a factor.
        Fixed(FixedExposure) = "fixed",
    }
}

impl Exposure {
    /// So that the mean level of the valid pixels becomes `mean_level`, in `(0, 1)` of full scale.
    pub const fn auto(mean_level: f64) -> Self {
        Self::Auto(AutoExposure { mean_level })
    }

    /// Radiance times `gain`.
    pub const fn fixed(gain: f64) -> Self {
        Self::Fixed(FixedExposure { gain })
    }
}

options! {
    /// How a view becomes an image.
    pub struct RenderOptions {
        /// Rays per pixel side: 3 casts 9 rays per pixel, each at a random place of its own ninth.
        samples: usize = 3 => 1.0..=8.0, "rays per pixel side in [1, 8]";
        /// Standard deviation of a Gaussian blur, pixels; 0 for none.
        blur_sigma_px: f64 = 0.0 => 0.0..=50.0, "pixels in [0, 50]";
        /// Standard deviation of Gaussian noise, grey levels of 255, independent in the grey image and each colour.
        noise_sigma: f64 = 0.0 => 0.0..=255.0, "grey levels in [0, 255]";
        /// How light becomes brightness.
        [flat] exposure: Exposure = Exposure::auto(0.45);
        /// Exponent of the display curve, `level = light^(1/gamma)`.
        gamma: f64 = 2.2 => 0.5..=4.0, "an exponent in [0.5, 4]";
        /// Loss of light at 90 degrees off the axis, growing with the square of the angle.
        vignetting: f64 = 0.25 => 0.0..=1.0, "a share in [0, 1]";
        /// Seed of ray places and noise.
        seed: u64 = 0;
    }
}

/// An 8-bit image, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Width, pixels.
    pub width_px: usize,
    /// Height, pixels.
    pub height_px: usize,
    /// Grey levels (Rec. 709 luminance), `height * width`.
    pub gray: Vec<u8>,
    /// Red, green, blue levels, `height * width * 3`.
    pub rgb: Vec<u8>,
}

/// An 8-bit colour image, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColorImage {
    /// Width, pixels.
    pub width_px: usize,
    /// Height, pixels.
    pub height_px: usize,
    /// Blue, green, red levels, `height * width * 3`.
    pub bgr: Vec<u8>,
}

/// Light per pixel, and which pixels the lens reaches.
pub(crate) struct Film {
    pub(crate) width: usize,
    pub(crate) light: Vec<[f32; 3]>,
    pub(crate) valid: Vec<bool>,
}

impl Film {
    /// Blurs, and returns the factor from light to brightness.
    fn blurred_and_exposed(&mut self, options: &RenderOptions) -> f64 {
        if options.blur_sigma_px > 0.0 {
            self.blur(options.blur_sigma_px);
        }
        match options.exposure {
            Exposure::Fixed(FixedExposure { gain }) => gain,
            Exposure::Auto(AutoExposure { mean_level }) => self.automatic_gain(mean_level, options.gamma),
        }
    }

    /// Blurs, exposes and quantises. Pixels that the lens does not reach are 0, without noise.
    pub(crate) fn develop(mut self, options: &RenderOptions) -> Image {
        let gain = self.blurred_and_exposed(options);
        let (width, height) = (self.width, self.light.len() / self.width);
        let (mut gray, mut rgb) = (vec![0u8; width * height], vec![0u8; 3 * width * height]);
        gray.par_chunks_mut(width).zip(rgb.par_chunks_mut(3 * width)).enumerate().for_each(
            |(y, (gray_row, rgb_row))| {
                // One stream of noise per row: the same bytes for any number of threads.
                let mut rng = Rng::new(options.seed, 1 + y as u64);
                let mut quantise = |light: f64| {
                    let noise = if options.noise_sigma > 0.0 { options.noise_sigma * rng.normal() } else { 0.0 };
                    (255.0 * display(gain * light, options.gamma) + noise).round().clamp(0.0, 255.0) as u8
                };
                for x in 0..width {
                    if self.valid[y * width + x] {
                        let color = self.light[y * width + x].map(f64::from);
                        gray_row[x] = quantise(luminance(color));
                        for c in 0..3 {
                            rgb_row[3 * x + c] = quantise(color[c]);
                        }
                    }
                }
            },
        );
        Image { width_px: width, height_px: height, gray, rgb }
    }

    /// [`develop`](Self::develop) for colours alone and a fixed exposure, from tables: quicker by an order of magnitude, at
    /// 1/50 of a level.
    pub(crate) fn develop_color(mut self, options: &RenderOptions) -> ColorImage {
        let gain = self.blurred_and_exposed(options);
        let (curve, noise) = (Curve::new(options.gamma), normal_quantiles(options.noise_sigma));
        let (width, height) = (self.width, self.light.len() / self.width);
        let mut bgr = vec![0u8; 3 * width * height];
        bgr.par_chunks_mut(3 * width).enumerate().for_each(|(y, row)| {
            // One stream of noise per row: the same bytes for any number of threads.
            let mut rng = Rng::new(options.seed, 1 + y as u64);
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                let k = y * width + x;
                let bits = rng.bits();
                if self.valid[k] {
                    for (c, level) in pixel.iter_mut().enumerate() {
                        let noise = noise[(bits >> (16 * c)) as usize & 0xFFFF];
                        *level = (curve.level(gain as f32 * self.light[k][2 - c]) + noise + 0.5) as u8;
                    }
                }
            }
        });
        ColorImage { width_px: width, height_px: height, bgr }
    }

    /// The sum of the light of two films.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        for (own, other) in self.light.iter_mut().zip(&other.light) {
            *own = [own[0] + other[0], own[1] + other[1], own[2] + other[2]];
        }
        self
    }

    /// So many times the light.
    pub(crate) fn scaled(mut self, factor: f32) -> Self {
        for light in &mut self.light {
            *light = light.map(|l| l * factor);
        }
        self
    }

    /// The gain for which the mean level of every seventh valid pixel is as asked, by bisection of its logarithm; no more
    /// than keeps nine tenths of them off the shoulder.
    fn automatic_gain(&self, mean_level: f64, gamma: f64) -> f64 {
        let mut light: Vec<f64> = (0..self.light.len())
            .filter(|&k| self.valid[k])
            .step_by(7)
            .map(|k| luminance(self.light[k].map(f64::from)))
            .collect();
        if light.iter().all(|&l| l <= 0.0) {
            return 1.0;
        }
        let (mut low, mut high) = (-12.0f64, 12.0f64);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            let gain = middle.exp();
            let mean = light.iter().map(|l| display(gain * l, gamma)).sum::<f64>() / light.len() as f64;
            if mean < mean_level { low = middle } else { high = middle }
        }
        light.sort_by(f64::total_cmp);
        let bright = light[light.len() * 9 / 10].max(f64::MIN_POSITIVE);
        (0.5 * (low + high)).exp().min(SHOULDER / bright)
    }

    /// Separable Gaussian, the border repeated.
    fn blur(&mut self, sigma: f64) {
        let radius = (3.0 * sigma).ceil() as isize;
        let raw: Vec<f64> = (-radius..=radius).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
        let total: f64 = raw.iter().sum();
        let kernel: Vec<f32> = raw.iter().map(|k| (k / total) as f32).collect();
        let (width, height) = (self.width as isize, (self.light.len() / self.width) as isize);
        for (dx, dy) in [(1, 0), (0, 1)] {
            let source = self.light.clone();
            self.light.par_chunks_mut(self.width).enumerate().for_each(|(y, row)| {
                for (x, out) in row.iter_mut().enumerate() {
                    *out = [0.0; 3];
                    for (k, weight) in (-radius..=radius).zip(&kernel) {
                        let sx = (x as isize + k * dx).clamp(0, width - 1);
                        let sy = (y as isize + k * dy).clamp(0, height - 1);
                        let light = source[(sy * width + sx) as usize];
                        for c in 0..3 {
                            out[c] += weight * light[c];
                        }
                    }
                }
            });
        }
    }
}

/// The display curve as a table over the square root of the light, which straightens it out where it is steep.
struct Curve {
    levels: Vec<f32>,
}

impl Curve {
    /// Entries of the table: a quarter of a grey level or less apart up to the shoulder, for any gamma from 1 on.
    const STEPS: usize = 4096;
    /// The greatest light of the table; what is brighter is white to a hundredth of a level.
    const REACH: f32 = 4.0;

    fn new(gamma: f64) -> Self {
        let root = |k: usize| f64::from(Self::REACH).sqrt() * k as f64 / Self::STEPS as f64;
        Self { levels: (0..=Self::STEPS + 1).map(|k| (255.0 * display(root(k).powi(2), gamma)) as f32).collect() }
    }

    /// The level, of 255.
    fn level(&self, light: f32) -> f32 {
        let at = light.clamp(0.0, Self::REACH).sqrt() * (Self::STEPS as f32 / Self::REACH.sqrt());
        let (k, share) = (at as usize, at.fract());
        self.levels[k] + share * (self.levels[k + 1] - self.levels[k])
    }
}

/// The 65,536 quantiles of a normal distribution in the middles of as many equal shares.
fn normal_quantiles(sigma: f64) -> Vec<f32> {
    const COUNT: usize = 1 << 16;
    // Bisection of the cumulative distribution would do; its inverse by integration is quicker: dz = dp / density.
    let mut half = Vec::with_capacity(COUNT / 2);
    let (mut z, step) = (0.0f64, 1.0 / COUNT as f64);
    let slope = |z: f64| std::f64::consts::TAU.sqrt() * (0.5 * z * z).exp();
    for k in 0..COUNT / 2 {
        let width = if k == 0 { 0.5 * step } else { step };
        let middle = z + 0.5 * width * slope(z);
        z += width * slope(middle);
        half.push((sigma * z) as f32);
    }
    half.iter().rev().map(|z| -z).chain(half.iter().copied()).collect()
}

/// Share of full light up to which the display curve has no shoulder: the look of a camera whose whites roll off gently.
const SHOULDER: f64 = 0.7;

/// The display level in `[0, 1]`: straight up to the shoulder, which never quite clips.
fn display(light: f64, gamma: f64) -> f64 {
    let light = light.max(0.0);
    let rest = 1.0 - SHOULDER;
    let rolled = if light < SHOULDER { light } else { 1.0 - rest * (-(light - SHOULDER) / rest).exp() };
    rolled.powf(1.0 / gamma)
}
