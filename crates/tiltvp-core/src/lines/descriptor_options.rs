//! How lines are described: areas, bins, window, normalisation.

use super::description::profile_rows;
use crate::options::Above;
use crate::{options, words};

words! {
    /// What a descriptor is made of.
    pub enum DescriptorKind {
        /// Histograms of gradient orientation in circular areas, eqs. 2 to 5: for images that are little apart.
        Areas = "areas",
        /// Grey levels beside the line over the logarithm of the height, for `match_wide`: for images that are metres apart.
        /// The other options of descriptors are those of areas.
        Profile = "profile",
    }
}

words! {
    /// What is brought to unit length, clipped, and brought to unit length again.
    pub enum Normalisation {
        /// The pair of histograms of each area, eq. 3.
        Area = "area",
        /// All histograms together, eq. 4.
        Whole = "whole",
    }
}

options! {
    /// Options of the descriptor.
    #[derive(Copy)]
    pub struct DescriptorOptions {
        /// What is described: "areas", the paper's histograms, or "profile", grey levels along the line for `match_wide`, to which the
        /// other options of descriptors are nothing.
        kind: DescriptorKind = DescriptorKind::Areas;
        /// Number of circular areas.
        areas: usize = 3 => 1.0..=64.0, "a whole number from 1 to 64";
        /// Whether neighbouring areas overlap by half.
        overlapping: bool = false;
        /// Number of bins `N_b` over the whole circle of orientations.
        bins: usize = 32 => 2.0..=1024.0, "a whole number from 2 to 1024";
        /// The greatest value of a bin before the second normalisation.
        clip: f64 = 0.1 => Above(0.0, 1.0), "a value above 0 and at most 1";
        /// Standard deviation of the Gaussian window as a fraction of an area's radius.
        window: f64 = 1.0 / 3.0 => Above(0.0, 100.0), "a fraction above 0 and at most 100";
        /// Standard deviation of the Gaussian that smooths an area before its gradients are taken, as a fraction of its radius,
        /// 0 for none.
        smoothing: f64 = 1.0 / 12.0 => 0.0..=1.0, "a fraction from 0 to 1";
        /// What has unit length.
        normalisation: Normalisation = Normalisation::Area;
    }
}

impl DescriptorOptions {
    /// How many values a descriptor has, eq. 5 for areas.
    pub fn values(&self) -> usize {
        match self.kind {
            DescriptorKind::Areas => 2 * self.areas * self.bins,
            DescriptorKind::Profile => profile_rows::VALUES,
        }
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
