//! How far the bearings of each landmark scatter: round things, whose edges slide along them, are no points.

use super::graph::Graph;

/// Bearings from which on a landmark is judged.
const BEARINGS: usize = 12;

/// The share of a landmark's residuals that are smaller than the one which tells its scatter, and that of a normal distribution.
const SHARE: f64 = 0.8;
const NORMAL: f64 = 1.2816;

/// Scatter, in standard deviations of a bearing, up to which it is that of noise.
const NOISE: f64 = 1.5;

/// Share of the landmarks that may scatter more; where there are more of them something else is wrong.
const FEW: f64 = 0.5;

/// Change of a scatter, relative, from which on it is worth solving again.
const CHANGE: f64 = 0.2;

impl Graph {
    /// Takes the scatter of each landmark's bearings from their residuals: as assumed, or more. Whether that changed anything.
    pub(super) fn weigh_landmarks(&mut self) -> bool {
        let mut all = vec![Vec::new(); self.landmarks.len()];
        let sights = self.nodes.iter().flat_map(|node| &node.sights);
        for (sight, residual) in sights.zip(self.residuals()) {
            all[sight.landmark].push(residual.abs() * self.spreads[sight.landmark]);
        }
        let mut spreads = vec![1.0; all.len()];
        for (residuals, spread) in all.iter_mut().zip(&mut spreads).filter(|(all, _)| all.len() >= BEARINGS) {
            let at = (SHARE * residuals.len() as f64) as usize;
            let scatter = *residuals.select_nth_unstable_by(at, f64::total_cmp).1 / NORMAL;
            if scatter > NOISE {
                *spread = scatter;
            }
        }
        let judged = all.iter().filter(|all| all.len() >= BEARINGS).count();
        let wide = spreads.iter().filter(|spread| **spread > 1.0).count();
        if wide as f64 > FEW * judged as f64 {
            return false;
        }
        let changed = spreads.iter().zip(&self.spreads).any(|(now, before)| (now / before).ln().abs() > CHANGE);
        if changed {
            self.spreads = spreads;
        }
        changed
    }

    /// What the scatters add to half the sum of squared residuals, so that solutions with others can be compared.
    pub(super) fn cost_of_spreads(&self) -> f64 {
        let logarithms: Vec<f64> = self.spreads.iter().map(|spread| spread.ln()).collect();
        self.nodes.iter().flat_map(|node| &node.sights).map(|sight| logarithms[sight.landmark]).sum()
    }
}
