//! Where along a profile across an edge the edge is, between samples.

/// Samples of a profile on each side beyond those that are searched, so that an edge at the end of the search is seen
/// whole: [`REACH`] and one more for the difference.
pub(super) const SHOULDER: usize = 4;

/// Longest profile, in samples: the largest search of 15 pixels and the shoulders, on both sides of the middle.
pub(super) const PROFILE_MAX: usize = 41;

/// How far from its steepest place an edge's own gradient reaches, in samples: three standard deviations of the blur of
/// a focused lens (1 pixel). The test of blurred steps covers 0.5 to 1.2 pixels.
const REACH: usize = 3;

/// The share of the steepest gradient at which an edge's own gradient ends: a Gaussian blur has fallen to it at 2.1
/// standard deviations.
const FADED: f64 = 0.1;

/// An edge across a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EdgePlace {
    /// Distance from the middle of the profile, in samples.
    pub(super) shift: f64,
    /// The step of the profile's value, with its sign.
    pub(super) step: f64,
}

/// Where in profiles of one length the edge is looked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct SearchWindow {
    /// What gradients count in the choice of the edge: less far from the middle, nothing outside the search.
    weights: [f64; PROFILE_MAX],
    search: f64,
}

impl SearchWindow {
    /// For profiles of `samples`, an odd number, at most `search` samples from the middle.
    pub(super) fn new(samples: usize, search: f64) -> Self {
        let middle = (samples / 2) as f64;
        let weights = std::array::from_fn(|i| {
            let distance = (i as f64 + 0.5 - middle) / (search + 0.5);
            if distance.abs() <= 1.0 { 1.0 - 0.5 * distance * distance } else { 0.0 }
        });
        Self { weights, search }
    }
}

/// The edge nearest to the middle of a profile with an odd number of samples, within the window.
///
/// The place is the centroid of the profile's gradient: that of a step seen through any symmetric blur, whatever its width.
/// None without a step of `step_min`.
pub(super) fn edge_place(profile: &[f64], window: &SearchWindow, step_min: f64) -> Option<EdgePlace> {
    let middle = (profile.len() / 2) as f64;
    let gradient = |i: usize| profile[i + 1] - profile[i];
    let offset = |i: usize| i as f64 + 0.5 - middle;
    let count = profile.len().checked_sub(1)?;
    let mut strengths = [0.0; PROFILE_MAX];
    for ((strength, pair), weight) in strengths.iter_mut().zip(profile.windows(2)).zip(&window.weights) {
        *strength = (pair[1] - pair[0]).abs() * weight;
    }
    let (mut peak, mut most) = (None, 0.0);
    for (i, strength) in strengths.iter().take(count).enumerate() {
        if *strength > most {
            (peak, most) = (Some(i), *strength);
        }
    }
    let peak = peak?;
    let steepest = gradient(peak);
    // The flank of a steeper edge beyond the reach of the search is no edge.
    let is_steeper = |i: usize| i < count && gradient(i) * steepest > steepest * steepest;
    let beyond = |i: usize| offset(i).abs() > window.search + 0.5;
    if [peak.wrapping_sub(1), peak + 1].into_iter().any(|i| is_steeper(i) && beyond(i)) {
        return None;
    }
    let belongs = |i: usize| gradient(i) * steepest > FADED * steepest * steepest;
    let first = (peak.saturating_sub(REACH)..peak).rev().take_while(|i| belongs(*i)).last().unwrap_or(peak);
    let last = (peak + 1..(peak + 1 + REACH).min(count)).take_while(|i| belongs(*i)).last().unwrap_or(peak);
    let (mut step, mut moment) = (0.0, 0.0);
    for i in first..=last {
        step += gradient(i);
        moment += gradient(i) * offset(i);
    }
    (step.abs() >= step_min).then(|| EdgePlace { shift: moment / step, step })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step at `place` seen through a Gaussian blur, integrated over each sample.
    fn blurred(place: f64, sigma: f64, step: f64) -> Vec<f64> {
        let at = |x: f64| 1.0 / (1.0 + (-1.702 * x / sigma).exp());
        (-8..=8).map(|i| 40.0 + step * at(f64::from(i) - place)).collect()
    }

    #[test]
    fn a_blurred_step_is_found_between_samples() {
        for sigma in [0.5, 0.8, 1.2] {
            for place in [-2.3, -0.5, 0.0, 0.21, 1.77] {
                for step in [-80.0, 25.0] {
                    let found = edge_place(&blurred(place, sigma, step), &SearchWindow::new(17, 4.0), 5.0).unwrap();
                    assert!(
                        (found.shift - place).abs() < if sigma > 1.0 { 0.08 } else { 0.06 },
                        "{sigma} {place}: {found:?}"
                    );
                    assert!((found.step / step - 1.0).abs() < 0.2);
                }
            }
        }
    }

    #[test]
    fn flat_profiles_have_no_edge_and_far_ones_are_not_looked_at() {
        assert_eq!(edge_place(&[50.0; 17], &SearchWindow::new(17, 4.0), 5.0), None);
        assert_eq!(edge_place(&blurred(6.5, 0.5, 80.0), &SearchWindow::new(17, 3.0), 5.0), None);
        assert_eq!(edge_place(&[], &SearchWindow::new(0, 3.0), 5.0), None);
    }
}
