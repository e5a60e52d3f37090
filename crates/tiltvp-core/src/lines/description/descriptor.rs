//! The descriptor of a line: orientation histograms of both sides of areas along it (Scaramuzza, Siegwart and Martinelli 2009, section 3).

use super::histogram::{AreaScratch, GaussianWindow, histograms};
use super::patch::{Chart, Patch, Raster};
use crate::image::ImageView;
use crate::lines::descriptor_options::{DescriptorOptions, Normalisation};
use crate::lines::line::Lines;
use crate::lines::tables::LineTables;

/// Memory of the descriptor: a patch, and what is the same for all areas.
#[derive(Debug, Clone, Default)]
pub(crate) struct DescriptorScratch {
    patch: Patch,
    window: GaussianWindow,
    /// Half of the smoothing Gaussian, the middle first.
    kernel: Vec<f32>,
    area: AreaScratch,
}

/// Where the lines of an image run, and how far descriptors reach along them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DescriptorSpan<'a> {
    pub(crate) chart: Chart<'a>,
    /// Elevations, or radii in pixels.
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// The radius of an area in samples; none for one sample a pixel.
    pub(crate) samples: Option<usize>,
}

/// Writes the descriptors of lines, one after the other.
pub(crate) fn describe(
    image: &ImageView<'_>,
    tables: &LineTables,
    course: &DescriptorSpan<'_>,
    lines: &Lines,
    options: &DescriptorOptions,
    scratch: &mut DescriptorScratch,
    out: &mut Vec<f32>,
) {
    let DescriptorSpan { chart, low, high, samples } = course;
    let (radius, _) = options.layout(*low, *high);
    let half = samples.unwrap_or((radius.ceil() as usize).clamp(2, 256));
    scratch.make_kernel(options.smoothing * half as f64);
    let pitch = radius / half as f64;
    let side = 2 * (half + scratch.kernel.len()) + 1;
    scratch.window.make(half, options.window, side);
    let reach = Some((half + scratch.kernel.len()) as f64 + 0.5);
    let raster = Raster { pitch, rows: side, columns: side, reach };
    out.clear();
    out.resize(lines.lines.len() * options.values(), 0.0);
    for (line, values) in lines.lines.iter().zip(out.chunks_exact_mut(options.values())) {
        let (_, middles) = options.layout(*low, *high);
        for (middle, pair) in middles.zip(values.chunks_exact_mut(2 * options.bins)) {
            scratch.patch.sample(image, tables, chart, (line.bearing_rad, middle), &raster);
            histograms(&scratch.patch.levels, &scratch.window, &scratch.kernel, &mut scratch.area, pair);
            if options.normalisation == Normalisation::Area {
                normalise(pair, options.clip as f32);
            }
        }
        if options.normalisation == Normalisation::Whole {
            normalise(values, options.clip as f32);
        }
    }
}

impl DescriptorScratch {
    /// A Gaussian of a standard deviation in samples, to two deviations on either side.
    fn make_kernel(&mut self, sigma: f64) {
        let reach = (2.0 * sigma).round() as usize;
        let weight = |k: usize| if k == 0 { 1.0 } else { (-0.5 * (k as f64 / sigma).powi(2)).exp() };
        let sum = 1.0 + 2.0 * (1..=reach).map(weight).sum::<f64>();
        self.kernel.clear();
        self.kernel.extend((0..=reach).map(|k| (weight(k) / sum) as f32));
    }
}

/// Unit length, clipped, unit length; what is all zero stays so.
fn normalise(values: &mut [f32], clip: f32) {
    unit(values);
    for value in values.iter_mut() {
        *value = value.min(clip);
    }
    unit(values);
}

fn unit(values: &mut [f32]) {
    let length = values.iter().map(|x| x * x).sum::<f32>().sqrt();
    if length > 0.0 {
        for value in values.iter_mut() {
            *value /= length;
        }
    }
}
