//! Landmarks that are no points: round things, whose edges slide along them, and names that mean several things.

use super::graph::Graph;
use super::loss::LIMIT;

/// Bearings from which on a landmark is judged.
const BEARINGS: usize = 8;

/// Share of its bearings beyond the limit from which on a landmark is no point.
const SHARE: f64 = 0.3;

/// Share of all landmarks that may be found to be none at once; where there are more something else is wrong.
const FEW: f64 = 0.34;

impl Graph {
    /// Takes away all bearings of the landmarks that are no points: part of their bearings agree with any mounting, and pull
    /// it. The landmarks' places in the dense block, and how many bearings went.
    pub(super) fn distrust(&mut self) -> (Vec<usize>, usize) {
        let mut counts = vec![(0, 0); self.landmarks.len()];
        let sights = self.nodes.iter().flat_map(|node| &node.sights);
        for (sight, residual) in sights.zip(self.residuals()) {
            let (all, beyond) = &mut counts[sight.landmark];
            *all += 1;
            *beyond += usize::from(residual.abs() > LIMIT);
        }
        let seen = counts.iter().filter(|(all, _)| *all >= BEARINGS).count();
        let wrong = |(all, beyond): (usize, usize)| all >= BEARINGS && beyond as f64 > SHARE * all as f64;
        let slots: Vec<usize> = (0..counts.len()).filter(|slot| wrong(counts[*slot])).collect();
        if slots.is_empty() || slots.len() as f64 > FEW * seen as f64 {
            return (Vec::new(), 0);
        }
        for node in &mut self.nodes {
            node.sights.retain(|sight| !wrong(counts[sight.landmark]));
        }
        let (dense, fixed) = (self.dense(), self.free.width());
        for slot in &slots {
            // Nothing else tells where it is.
            let at = fixed + 2 * slot;
            self.prior_mean[at] = dense[at];
            self.prior_information[(at, at)] += 1.0;
        }
        let gone = slots.iter().map(|slot| counts[*slot].0).sum();
        (slots, gone)
    }
}
