//! Vertical lines as great circles through the vertical: a histogram over azimuth, its peaks, and a fit at each.

use std::f64::consts::{PI, TAU};

use super::candidates::Candidates;
use super::line_fit::{FitScratch, LineFit, fit_line, joined, take};
use crate::edges::RidgePixels;
use crate::lines::angles::wrap;
use crate::lines::line::{Line, LineFrame, Lines};
use crate::lines::options::GreatCircleOptions;
use crate::lines::tables::LineTables;

/// Memory of the search.
#[derive(Debug, Clone, Default)]
pub(crate) struct GreatCircleScratch {
    candidates: Candidates,
    votes: [Vec<f32>; 2],
    smooth: [Vec<f32>; 2],
    peaks: Vec<Peak>,
    fits: Vec<LineFit>,
    fit: FitScratch,
}

/// A local maximum of the histogram of one polarity.
#[derive(Debug, Clone, Copy)]
struct Peak {
    height: f32,
    azimuth: f64,
    rising: bool,
}

/// Lines closer than this, in pixels, whose polarities differ are one line that changes polarity: two edges so close
/// blend.
const ONE_LINE_PX: f64 = 0.8;

/// Finds the lines among the ridge pixels of an image.
pub(crate) fn find(
    tables: &LineTables,
    ridge: &RidgePixels,
    frame: LineFrame,
    options: &GreatCircleOptions,
    scratch: &mut GreatCircleScratch,
    out: &mut Lines,
) {
    let GreatCircleScratch { candidates, votes, smooth, peaks, fits, fit } = scratch;
    candidates.refill(tables, ridge, &frame.robot_from_upright(), options.plane_max_rad, options.bins);
    vote(candidates, options.bins, votes);
    peaks.clear();
    for (rising, (votes, smooth)) in [false, true].into_iter().zip(votes.iter().zip(smooth)) {
        find_peaks(votes, smooth, options, rising, peaks);
    }
    peaks.sort_by(|a, b| b.height.total_cmp(&a.height).then(a.azimuth.total_cmp(&b.azimuth)));
    fits.clear();
    for peak in peaks.iter() {
        let Some(found) = fit_line(candidates, peak.azimuth, peak.rising, options, fit) else { continue };
        // Either half of a line of both polarities may be short.
        if 2 * found.support >= options.support_min_px && 2.0 * found.length >= options.length_min_rad {
            take(candidates, fit);
            fits.push(found);
        }
    }
    join(fits);
    fits.retain(|fit| fit.is_one_line(options));
    keep_apart(fits, options.separation_rad);
    if let Some(most) = options.lines_max {
        fits.truncate(most);
    }
    out.frame = frame;
    out.lines.clear();
    out.lines.extend(fits.iter().map(|fit| Line {
        bearing_rad: fit.azimuth,
        sigma_rad: fit.sigma,
        support_px: fit.support,
        elevation_min_rad: fit.slopes.0.atan(),
        elevation_max_rad: fit.slopes.1.atan(),
        polarity: 2.0 * f64::from(fit.rising) / f64::from(fit.support) - 1.0,
    }));
    out.lines.sort_by(|a, b| a.bearing_rad.total_cmp(&b.bearing_rad));
}

/// Each candidate votes for the two bins next to its azimuth.
fn vote(candidates: &Candidates, bins: usize, votes: &mut [Vec<f32>; 2]) {
    for votes in votes.iter_mut() {
        votes.clear();
        votes.resize(bins, 0.0);
    }
    for pixel in &candidates.pixels {
        let place = (f64::from(pixel.azimuth) + PI) / TAU * bins as f64 - 0.5;
        let (low, share) = (place.floor(), (place - place.floor()) as f32);
        let low = (low as i64).rem_euclid(bins as i64) as usize;
        let votes = &mut votes[usize::from(pixel.rising)];
        votes[low] += 1.0 - share;
        votes[(low + 1) % bins] += share;
    }
}

/// The local maxima of the smoothed histogram that are no neighbour of a higher one.
fn find_peaks(votes: &[f32], smooth: &mut Vec<f32>, options: &GreatCircleOptions, rising: bool, peaks: &mut Vec<Peak>) {
    let bins = votes.len();
    smooth.clear();
    smooth
        .extend((0..bins).map(|b| 0.25 * votes[(b + bins - 1) % bins] + 0.5 * votes[b] + 0.25 * votes[(b + 1) % bins]));
    let reach = ((0.5 * options.separation_rad / TAU * bins as f64) as usize).clamp(1, bins / 4);
    // A line of the least support that falls between bins, or has half of its pixels in the other polarity.
    let least = 0.25 * options.support_min_px as f32;
    for b in 0..bins {
        let here = smooth[b];
        let higher = |offset: usize| smooth[(b + bins - offset) % bins] >= here || smooth[(b + offset) % bins] > here;
        if here < least || (1..=reach).any(higher) {
            continue;
        }
        let (before, after) = (smooth[(b + bins - 1) % bins], smooth[(b + 1) % bins]);
        let bend = 2.0 * here - before - after;
        let shift = if bend > 0.0 { 0.5 * (after - before) / bend } else { 0.0 };
        let azimuth = wrap((b as f64 + 0.5 + f64::from(shift)) / bins as f64 * TAU - PI);
        peaks.push(Peak { height: here, azimuth, rising });
    }
}

/// Joins lines of opposite polarity at the same azimuth.
fn join(fits: &mut Vec<LineFit>) {
    let mut first = 0;
    while first < fits.len() {
        let a = fits[first];
        let partner = (first + 1..fits.len()).find(|second| {
            let b = fits[*second];
            let opposite = (a.rising == 0) != (b.rising == 0);
            opposite && wrap(a.azimuth - b.azimuth).abs() < ONE_LINE_PX * 0.5 * (a.per_px + b.per_px)
        });
        match partner {
            Some(second) => {
                fits[first] = joined(&a, &fits[second]);
                fits.remove(second);
            }
            None => first += 1,
        }
    }
}

/// Sorts by length, the longest first, and drops lines beside a longer one of the same polarity.
fn keep_apart(fits: &mut Vec<LineFit>, separation: f64) {
    fits.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.azimuth.total_cmp(&b.azimuth)));
    let mut kept = 0;
    for i in 0..fits.len() {
        let (fit, mostly) = (fits[i], |fit: &LineFit| 2 * fit.rising > fit.support);
        let beside =
            |other: &LineFit| mostly(other) == mostly(&fit) && wrap(other.azimuth - fit.azimuth).abs() < separation;
        if !fits[..kept].iter().any(beside) {
            fits[kept] = fit;
            kept += 1;
        }
    }
    fits.truncate(kept);
}
