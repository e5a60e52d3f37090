//! The descriptor of a line: orientation histograms of both sides of areas along it (paper 001 section 3).

use std::f32::consts::{PI, TAU};

use multiversion::multiversion;

use super::arctan::atan2;
use super::line::Lines;
use super::patch::{Chart, Patch, Raster};
use super::sight::Sight;
use crate::error::{Error, Result};
use crate::image::ImageView;

/// What is brought to unit length, clipped, and brought to unit length again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Normalisation {
    /// The pair of histograms of each area, eq. 3.
    Area,
    /// All histograms together, eq. 4.
    Whole,
}

/// Options of the descriptor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DescriptorOptions {
    /// Number of circular areas. Default 3.
    pub areas: usize,
    /// Whether neighbouring areas overlap by half. Default false.
    pub overlapping: bool,
    /// Number of bins `N_b` over the whole circle of orientations. Default 32.
    pub bins: usize,
    /// The greatest value of a bin before the second normalisation. Default 0.1.
    pub clip: f64,
    /// Standard deviation of the Gaussian window as a fraction of an area's radius. Default 1/3.
    pub window: f64,
    /// Standard deviation of the Gaussian that smooths an area before its gradients are taken, as a fraction of its radius, 0
    /// for none. Default 1/12.
    pub smoothing: f64,
    /// What has unit length. Default each area.
    pub normalisation: Normalisation,
}

impl Default for DescriptorOptions {
    fn default() -> Self {
        Self {
            areas: 3,
            overlapping: false,
            bins: 32,
            clip: 0.1,
            window: 1.0 / 3.0,
            smoothing: 1.0 / 12.0,
            normalisation: Normalisation::Area,
        }
    }
}

impl DescriptorOptions {
    pub(super) fn validate(&self) -> Result<()> {
        if !(1..=64).contains(&self.areas) {
            return Err(Error::option("areas", self.areas, "a whole number from 1 to 64"));
        }
        if !(2..=1024).contains(&self.bins) {
            return Err(Error::option("bins", self.bins, "a whole number from 2 to 1024"));
        }
        if !(self.clip > 0.0 && self.clip <= 1.0) {
            return Err(Error::option("clip", self.clip, "a value above 0 and at most 1"));
        }
        if !(0.0..=1.0).contains(&self.smoothing) {
            return Err(Error::option("smoothing", self.smoothing, "a fraction from 0 to 1"));
        }
        if !(self.window > 0.0 && self.window <= 100.0) {
            return Err(Error::option("window", self.window, "a fraction above 0 and at most 100"));
        }
        Ok(())
    }

    /// How many values a descriptor has, eq. 5.
    pub fn values(&self) -> usize {
        2 * self.areas * self.bins
    }

    /// Radius and middles of the areas along a line from `low` to `high`.
    fn layout(&self, low: f64, high: f64) -> (f64, impl Iterator<Item = f64>) {
        let n = self.areas as f64;
        let (radius, first, step) = if self.overlapping {
            let radius = (high - low) / (n + 1.0);
            (radius, radius, radius)
        } else {
            let radius = (high - low) / (2.0 * n);
            (radius, radius, 2.0 * radius)
        };
        (radius, (0..self.areas).map(move |k| low + first + step * k as f64))
    }
}

/// Memory of the descriptor: a patch, and what is the same for all areas.
#[derive(Debug, Clone, Default)]
pub(super) struct DescriptorScratch {
    patch: Patch,
    window: Vec<f32>,
    /// Half of the smoothing Gaussian, the middle first.
    kernel: Vec<f32>,
    rows: Vec<f32>,
    /// Magnitudes and places in the histogram of one row.
    gradients: [Vec<f32>; 2],
    /// Half of the samples across an area, and the window's width, that the window was made for.
    made_for: Option<(usize, f64)>,
}

/// Where the lines of an image run, and how far descriptors reach along them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course<'a> {
    pub(super) chart: Chart<'a>,
    /// Elevations, or radii in pixels.
    pub(super) low: f64,
    pub(super) high: f64,
    /// The radius of an area in samples; none for one sample a pixel.
    pub(super) samples: Option<usize>,
}

/// Writes the descriptors of lines, one after the other.
pub(super) fn describe(
    image: &ImageView<'_>,
    sight: &Sight,
    course: &Course<'_>,
    lines: &Lines,
    options: &DescriptorOptions,
    scratch: &mut DescriptorScratch,
    out: &mut Vec<f32>,
) {
    let Course { chart, low, high, samples } = course;
    let (radius, _) = options.layout(*low, *high);
    let half = samples.unwrap_or((radius.ceil() as usize).clamp(2, 256));
    scratch.make_window(half, options.window);
    scratch.make_kernel(options.smoothing * half as f64);
    let pitch = radius / half as f64;
    let side = 2 * (half + scratch.kernel.len()) + 1;
    let reach = Some((half + scratch.kernel.len()) as f64 + 0.5);
    let raster = Raster { pitch, rows: side, columns: side, reach };
    out.clear();
    out.resize(lines.lines.len() * options.values(), 0.0);
    for (line, values) in lines.lines.iter().zip(out.chunks_exact_mut(options.values())) {
        let (_, middles) = options.layout(*low, *high);
        for (middle, pair) in middles.zip(values.chunks_exact_mut(2 * options.bins)) {
            scratch.patch.sample(image, sight, chart, (line.bearing_rad, middle), &raster);
            smooth(&mut scratch.patch, &scratch.kernel, &mut scratch.rows);
            histograms(&scratch.patch, &scratch.window, half, &mut scratch.gradients, options.bins, pair);
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

    /// Gaussian weights of the samples of an area, zero outside the circle.
    fn make_window(&mut self, half: usize, width: f64) {
        if self.made_for == Some((half, width)) {
            return;
        }
        let n = 2 * half + 1;
        let weight = |i: usize| {
            let (x, y) = ((i % n) as f64 - half as f64, (i / n) as f64 - half as f64);
            let squared = (x * x + y * y) / (half * half) as f64;
            if squared <= 1.0 { (-0.5 * squared / (width * width)).exp() as f32 } else { 0.0 }
        };
        self.window.clear();
        self.window.extend((0..n * n).map(weight));
        self.made_for = Some((half, width));
    }
}

/// Smooths a patch along and across; it loses the kernel's reach on every side.
fn smooth(patch: &mut Patch, kernel: &[f32], rows: &mut Vec<f32>) {
    let reach = kernel.len() - 1;
    if reach == 0 {
        return;
    }
    let (height, width) = (patch.rows - 2 * reach, patch.columns - 2 * reach);
    rows.clear();
    rows.resize(height * patch.columns, 0.0);
    for (i, out) in rows.chunks_exact_mut(patch.columns).enumerate() {
        let row = |k: usize| &patch.levels[k * patch.columns..(k + 1) * patch.columns];
        for (x, level) in out.iter_mut().zip(row(i + reach)) {
            *x = kernel[0] * level;
        }
        for (k, tap) in kernel.iter().enumerate().skip(1) {
            for ((x, below), above) in out.iter_mut().zip(row(i + reach - k)).zip(row(i + reach + k)) {
                *x += tap * (below + above);
            }
        }
    }
    for (out, row) in patch.levels.chunks_exact_mut(width).zip(rows.chunks_exact(patch.columns)) {
        for (x, level) in out.iter_mut().zip(&row[reach..]) {
            *x = kernel[0] * level;
        }
        for (k, tap) in kernel.iter().enumerate().skip(1) {
            for ((x, left), right) in out.iter_mut().zip(&row[reach - k..]).zip(&row[reach + k..]) {
                *x += tap * (left + right);
            }
        }
    }
    (patch.rows, patch.columns) = (height, width);
    patch.levels.truncate(height * width);
}

/// Adds the gradients of a patch to the histograms of its two sides: left of the line, where azimuth is greater, first.
fn histograms(patch: &Patch, window: &[f32], half: usize, gradients: &mut [Vec<f32>; 2], bins: usize, out: &mut [f32]) {
    let (width, n) = (patch.columns, 2 * half + 1);
    let (left, right) = out.split_at_mut(bins);
    let [magnitudes, places] = gradients;
    for values in [&mut *magnitudes, &mut *places] {
        values.clear();
        values.resize(n, 0.0);
    }
    for (i, weights) in window.chunks_exact(n).enumerate() {
        let rows = [i, i + 1, i + 2].map(|row| &patch.levels[row * width..(row + 1) * width]);
        // Nothing of the circle is as far from its middle line as the ends of the rows near its top.
        let first = weights.iter().position(|weight| *weight > 0.0).unwrap_or(n);
        let inside = first..n - first.min(n);
        if inside.is_empty() {
            continue;
        }
        let [below, here, above] = rows.map(|row| &row[first..inside.end + 2]);
        let (magnitudes, places) = (&mut magnitudes[inside.clone()], &mut places[inside.clone()]);
        gradients_of([below, here, above], &weights[inside.clone()], bins as f32 / TAU, magnitudes, places);
        for ((j, magnitude), place) in inside.zip(magnitudes).zip(places) {
            let (magnitude, place) = (*magnitude, *place);
            // NaN is a sample that is not of the world.
            if magnitude.is_nan() || magnitude <= 0.0 {
                continue;
            }
            // Eq. 2: the share w goes to the bin above.
            let bin = place as i32 as usize;
            let share = place - bin as f32;
            let bin = if bin >= bins { bin - bins } else { bin };
            let next = if bin + 1 == bins { 0 } else { bin + 1 };
            let vote = |side: &mut [f32], magnitude: f32| {
                side[bin] += magnitude * (1.0 - share);
                side[next] += magnitude * share;
            };
            match j.cmp(&half) {
                std::cmp::Ordering::Greater => vote(left, magnitude),
                std::cmp::Ordering::Less => vote(right, magnitude),
                std::cmp::Ordering::Equal => {
                    vote(left, 0.5 * magnitude);
                    vote(right, 0.5 * magnitude);
                }
            }
        }
    }
}

/// Weighted magnitudes of the Sobel gradients of one row, and their orientations in bins; rows are one sample wider on both
/// sides.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn gradients_of(
    [below, here, above]: [&[f32]; 3],
    weights: &[f32],
    bins_per_rad: f32,
    magnitudes: &mut [f32],
    places: &mut [f32],
) {
    let n = weights.len();
    let (below, here, above) = (&below[..n + 2], &here[..n + 2], &above[..n + 2]);
    let (magnitudes, places) = (&mut magnitudes[..n], &mut places[..n]);
    for j in 0..n {
        let across = above[j + 2] - above[j] + below[j + 2] - below[j] + 2.0 * (here[j + 2] - here[j]);
        let along = above[j] - below[j] + above[j + 2] - below[j + 2] + 2.0 * (above[j + 1] - below[j + 1]);
        magnitudes[j] = weights[j] * (across * across + along * along).sqrt();
        places[j] = (atan2(across, along) + PI) * bins_per_rad;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_touch_or_overlap_by_half() {
        let options = DescriptorOptions::default();
        let (radius, middles) = options.layout(0.0, 6.0);
        assert_eq!((radius, middles.collect::<Vec<_>>()), (1.0, vec![1.0, 3.0, 5.0]));
        let options = DescriptorOptions { areas: 5, overlapping: true, ..options };
        let (radius, middles) = options.layout(0.0, 6.0);
        assert_eq!((radius, middles.collect::<Vec<_>>()), (1.0, vec![1.0, 2.0, 3.0, 4.0, 5.0]));
    }
}
