//! How far the bearings of each landmark scatter: corners at a distance less than most, round things, which are no points, more.

use super::graph::{Graph, Sight};

/// Bearings from which on a landmark is judged.
const BEARINGS: usize = 12;

/// The share of a landmark's residuals that are smaller than the one which tells its scatter, and that of a normal distribution.
const SHARE: f64 = 0.8;
const NORMAL: f64 = 1.2816;

/// The median of the sizes of normally distributed numbers.
const MEDIAN: f64 = 0.6745;

/// Variance of the logarithm of a scatter that is told by that residual, times the number of bearings.
const VARIANCE: f64 = 0.79;

/// Median scatter, in standard deviations of a bearing, beyond which something else is wrong.
const NOISE: f64 = 1.5;

/// The smallest scatter that is believed, likewise: what the bearings of a landmark have in common its residuals do not show.
const LEAST: f64 = 0.45;

/// Change of a scatter, relative, from which on it is worth solving again.
const CHANGE: f64 = 0.2;

/// How far bearings are moved, in their standard deviations, to see how much of that the unknowns take up.
const PROBE: f64 = 0.1;

impl Graph {
    /// Takes the scatter of each landmark's bearings from their residuals. Whether that changed anything.
    ///
    /// The logarithms of the scatters are taken to be normally distributed about their median, as widely as they are beyond
    /// what chance explains, so that the scatter of a landmark is drawn to the others' the more the fewer bearings it has.
    pub(super) fn weigh_landmarks(&mut self) -> bool {
        let mut all = vec![Vec::new(); self.landmarks.len()];
        let sights = self.nodes.iter().flat_map(|node| &node.sights);
        for (sight, residual) in sights.zip(self.residuals()) {
            all[sight.landmark].push(residual.abs() * self.spreads[sight.landmark]);
        }
        // What the unknowns take up makes scatters look small; that is asked only where they do.
        let spreads = match spreads_of(&mut all, 1.0) {
            Some(spreads) if self.differ(&spreads) => spreads_of(&mut all, self.freedom()),
            _ => None,
        };
        let Some(spreads) = spreads.filter(|spreads| self.differ(spreads)) else { return false };
        self.spreads = spreads;
        true
    }

    fn differ(&self, spreads: &[f64]) -> bool {
        spreads.iter().zip(&self.spreads).any(|(now, before)| (now / before).ln().abs() > CHANGE)
    }

    /// Which share of the bearings' noise the residuals show, but for what the landmarks' own places take up: the others are
    /// moved to and fro, and the unknowns follow.
    fn freedom(&self) -> f64 {
        let mut moved = self.clone();
        let mut signs = Vec::new();
        // The signs of a fixed sequence without a pattern.
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        for sight in moved.nodes.iter_mut().flat_map(|node| &mut node.sights) {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            let sign = if state >> 63 == 0 { 1.0 } else { -1.0 };
            let by = sign * PROBE * self.bearing_sigma * self.spreads[sight.landmark];
            *sight = Sight::new(sight.landmark, sight.bearing + by);
            signs.push(sign);
        }
        let before = self.residuals();
        let last = self.nodes.len() - 1;
        if moved.eliminate(last, false, 0.0).and_then(|e| moved.step(&e)).is_none() {
            return 1.0;
        }
        let rows = moved.residuals().into_iter().zip(before).zip(&signs);
        let followed: f64 = rows.map(|((now, before), sign)| 1.0 + (now - before) * sign / PROBE).sum();
        let count = signs.len() as f64;
        let own = 2.0 * self.landmarks.len() as f64;
        (1.0 - (followed - own).max(0.0) / count).max(0.1)
    }

    /// What the scatters add to half the sum of squared residuals, so that solutions with others can be compared.
    pub(super) fn cost_of_spreads(&self) -> f64 {
        let logarithms: Vec<f64> = self.spreads.iter().map(|spread| spread.ln()).collect();
        self.nodes.iter().flat_map(|node| &node.sights).map(|sight| logarithms[sight.landmark]).sum()
    }
}

/// The scatter of each landmark from the sizes of its residuals, of whose freedom such a share is left; `None` if there are
/// none to judge by, or if something else is wrong.
fn spreads_of(all: &mut [Vec<f64>], freedom: f64) -> Option<Vec<f64>> {
    let judge = |residuals: &mut Vec<f64>| {
        let count = residuals.len() as f64;
        let at = (SHARE * count) as usize;
        let scatter = *residuals.select_nth_unstable_by(at, f64::total_cmp).1 / NORMAL;
        let free = count * freedom - 2.0;
        (free > 1.0).then(|| ((scatter * (count / free).sqrt()).max(1e-3).ln(), VARIANCE / free))
    };
    let judged: Vec<Option<(f64, f64)>> =
        all.iter_mut().map(|all| if all.len() >= BEARINGS { judge(all) } else { None }).collect();
    let known = || judged.iter().flatten();
    let middle = median(known().map(|(scatter, _)| *scatter)).filter(|middle| *middle <= NOISE.ln())?;
    let away = median(known().map(|(scatter, _)| (scatter - middle).abs()))? / MEDIAN;
    let chance = median(known().map(|(_, variance)| *variance))?;
    let width = (away * away - chance).max(0.0);
    let drawn = |(scatter, variance): (f64, f64)| middle + (scatter - middle) * width / (width + variance);
    Some(judged.iter().map(|judged| judged.map_or(1.0, |judged| drawn(judged).exp().max(LEAST))).collect())
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let at = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(at, f64::total_cmp).1)
}
