//! Which lines of two images are the same: the nearest descriptor, if three tests agree (Scaramuzza, Siegwart and Martinelli 2009, section 4).

use super::angles::wrap;
use super::description::dissimilarity::descriptor_distances;
use super::order::{Match, keep_cyclic_order};
use crate::error::{Error, Result};
use crate::interrupt::check;
use crate::options;
use crate::options::{Above, POSITIVE};

options! {
    /// Options of the matcher.
    #[derive(Copy)]
    pub struct MatchOptions {
        /// `F1`: the greatest distance of a match, eq. 8.
        [as "f1"] distance_max: f64 = 1.05 => POSITIVE, "a positive distance";
        /// `F2`: the greatest share of the mean distance to all lines of the other image, eq. 9.
        [as "f2"] mean_ratio_max: f64 = 0.75 => Above(0.0, 1.0), "a share above 0 and at most 1";
        /// `F3`: the greatest share of the second smallest distance, eq. 10.
        [as "f3"] second_ratio_max: f64 = 0.8 => Above(0.0, 1.0), "a share above 0 and at most 1";
        /// Whether both lines must be nearest to each other, so that no line is matched twice.
        mutual: bool = true;
        /// Whether matches must keep the cyclic order of the lines.
        ordered: bool = false;
    }
}

/// What is known of the bearings: only lines that are close to where they are expected may match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingGate<'a> {
    /// Bearings of the lines of the first image, where they are expected in the second, radians.
    pub expected_rad: &'a [f64],
    /// Bearings of the lines of the second image, radians.
    pub seen_rad: &'a [f64],
    /// The greatest difference, radians.
    pub gate_rad: f64,
}

/// Memory of the matcher.
#[derive(Debug, Clone, Default)]
pub struct MatchScratch {
    distances: Vec<f64>,
    nearest: Vec<usize>,
}

/// The matches of descriptors of `width` values, by rising place in the first image. Lines must be sorted by bearing for the
/// ordering constraint.
///
/// # Errors
/// [`Error::InvalidOption`], or [`Error::InvalidArgument`] unless both hold whole rows and a gate has a finite bearing for each
/// and is an angle from 0.
pub fn match_descriptors(
    a: &[f32],
    b: &[f32],
    width: usize,
    options: &MatchOptions,
    gate: Option<&BearingGate<'_>>,
    scratch: &mut MatchScratch,
    out: &mut Vec<Match>,
) -> Result<()> {
    options.validate()?;
    descriptor_distances(a, b, width, &mut scratch.distances)?;
    let (n, m) = (a.len() / width, b.len() / width);
    if let Some(gate) = gate {
        if gate.gate_rad.is_nan() || gate.gate_rad < 0.0 {
            return Err(Error::argument("gate_rad", gate.gate_rad, "an angle from 0"));
        }
        for (name, bearings, lines) in [("expected_rad", gate.expected_rad, n), ("seen_rad", gate.seen_rad, m)] {
            if bearings.len() != lines {
                return Err(Error::argument(name, format!("{} values", bearings.len()), format!("{lines}")));
            }
            if let Some(at) = bearings.iter().position(|bearing| !bearing.is_finite()) {
                return Err(Error::argument(name, format!("{} at {at}", bearings[at]), "finite angles in radians"));
            }
        }
    }
    let allowed = |i: usize, j: usize| {
        gate.is_none_or(|gate| wrap(gate.expected_rad[i] - gate.seen_rad[j]).abs() <= gate.gate_rad)
    };
    select(scratch, (n, m), allowed, options, out);
    Ok(())
}

impl MatchScratch {
    /// Fills in the distances of descriptors of equal width.
    pub(super) fn measure(&mut self, a: &[f32], b: &[f32], width: usize) -> Result<()> {
        descriptor_distances(a, b, width, &mut self.distances)
    }
}

/// The three tests and the constraints on distances already measured, among the pairs that are allowed.
///
/// A pair that is not allowed is neither nearest nor second nearest; the mean is over all lines, eq. 9. Where there is only
/// one line to choose from there is no second one to compare with, and where the other image has only one no mean.
pub(super) fn select(
    scratch: &mut MatchScratch,
    (n, m): (usize, usize),
    allowed: impl Fn(usize, usize) -> bool,
    options: &MatchOptions,
    out: &mut Vec<Match>,
) {
    out.clear();
    let MatchScratch { distances, nearest } = scratch;
    if options.mutual {
        nearest.clear();
        nearest.extend((0..m).map(|j| {
            check();
            let rows = (0..n).filter(|i| allowed(*i, j));
            rows.min_by(|x, y| distances[x * m + j].total_cmp(&distances[y * m + j])).unwrap_or(usize::MAX)
        }));
    }
    for i in 0..n {
        check();
        let row = &distances[i * m..(i + 1) * m];
        let (mut best, mut second) = (None, f64::INFINITY);
        for (j, distance) in row.iter().enumerate().filter(|(j, _)| allowed(i, *j)) {
            match best {
                Some((_, least)) if *distance >= least => second = second.min(*distance),
                Some((_, least)) => (best, second) = (Some((j, *distance)), least),
                None => best = Some((j, *distance)),
            }
        }
        let Some((j, least)) = best else { continue };
        let mean = row.iter().sum::<f64>() / m as f64;
        let passes = least <= options.distance_max
            && (m < 2 || least <= options.mean_ratio_max * mean)
            && (second.is_infinite() || least <= options.second_ratio_max * second);
        if passes && (!options.mutual || nearest[j] == i) {
            out.push(Match { a: i, b: j, distance: least });
        }
    }
    if options.ordered {
        keep_cyclic_order(out, m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matches(distances: &[f64], m: usize, options: &MatchOptions) -> Vec<(usize, usize)> {
        let mut scratch = MatchScratch { distances: distances.to_vec(), nearest: Vec::new() };
        let mut out = Vec::new();
        select(&mut scratch, (distances.len() / m, m), |_, _| true, options, &mut out);
        out.iter().map(|m| (m.a, m.b)).collect()
    }

    /// Table 1: the nearest passes tests 1 and 3 but not test 2.
    #[test]
    fn the_papers_example_fails_the_second_test_only() {
        let row = [0.57, 0.72, 0.74, 0.78, 0.83];
        let options = MatchOptions::default();
        assert!(matches(&row, 5, &options).is_empty());
        assert_eq!(matches(&row, 5, &MatchOptions { mean_ratio_max: 0.8, ..options }), [(0, 0)]);
        let looser = MatchOptions { mean_ratio_max: 0.8, ..options };
        assert!(matches(&row, 5, &MatchOptions { distance_max: 0.5, ..looser }).is_empty());
        assert!(matches(&row, 5, &MatchOptions { second_ratio_max: 0.7, ..looser }).is_empty());
    }

    #[test]
    fn mutual_lines_are_matched_once() {
        let distances = [0.2, 0.9, 0.9, 0.1, 0.9, 0.9];
        let options = MatchOptions::default();
        assert_eq!(matches(&distances, 3, &options), [(1, 0)]);
        assert_eq!(matches(&distances, 3, &MatchOptions { mutual: false, ..options }), [(0, 0), (1, 0)]);
    }
}
