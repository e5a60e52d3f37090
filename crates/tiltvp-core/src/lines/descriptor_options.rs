//! How lines are described: areas, bins, window, normalisation.

use crate::error::{Error, Result};

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
    pub(super) fn layout(&self, low: f64, high: f64) -> (f64, impl Iterator<Item = f64>) {
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
