//! The azimuth of one line, by weighted least squares over its pixels, and what of the line is seen.

use super::candidates::{Candidate, Candidates, bin_of};
use crate::lines::angles::{difference, wrap};
use crate::lines::options::GreatCircleOptions;

/// Gates about the line in pixels, from the first fit to the last, which is three standard deviations of a good pixel
/// (`scatter_max_px`).
const GATES_PX: [f64; 4] = [3.0, 2.0, 1.5, 1.2];

/// Pixels that count as one against the prior of the slant: neighbours share the grid's phase and the edge's
/// crookedness.
const ERRING_TOGETHER: f64 = 8.0;

/// Pixels that count as one in the covariance: an edge beside the line pulls at most of its length.
const PULLED_TOGETHER: f64 = 40.0;

/// The least standard deviation of a pixel's place across the edge, in pixels, however well the pixels agree: that of
/// the interpolation of a ridge.
const PIXEL_SIGMA_MIN_PX: f64 = 0.06;

/// Standard deviation of the whole line, in pixels, which no pixel of it shows: blur and neighbouring edges pull all of
/// them.
const LINE_SIGMA_PX: f64 = 0.12;

/// A line under work.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LineFit {
    pub(crate) azimuth: f64,
    /// How the azimuth turns with the tangent of the elevation.
    slant: f64,
    pub(crate) sigma: f64,
    /// Standard deviation of the pixels about the line, pixels.
    pub(crate) scatter_px: f64,
    pub(crate) support: u32,
    pub(crate) rising: u32,
    /// Lowest and highest tangent of the elevation.
    pub(crate) slopes: (f64, f64),
    /// Elevation that the runs of pixels cover, radians.
    pub(crate) length: f64,
    /// Radians per pixel across the line, in the mean.
    pub(crate) per_px: f64,
}

/// Scratch of the fits: the pixels of a line and their residuals, by elevation.
#[derive(Debug, Clone, Default)]
pub(crate) struct FitScratch {
    /// Places among the candidates.
    members: Vec<u32>,
    runs: Vec<u32>,
}

/// Fits a line of one polarity near an azimuth to the candidates that no line has yet; none if too little is left.
pub(crate) fn fit_line(
    candidates: &Candidates,
    near: f64,
    rising: bool,
    options: &GreatCircleOptions,
    scratch: &mut FitScratch,
) -> Option<LineFit> {
    let bins = candidates.starts.len() - 1;
    let reach = (options.separation_rad / std::f64::consts::TAU * bins as f64).ceil() as usize + 1;
    let middle = bin_of(near, bins);
    let mut fit = LineFit { azimuth: near, ..LineFit::default() };
    for (i, gate_px) in GATES_PX.into_iter().enumerate() {
        let last = i + 1 == GATES_PX.len();
        if !last {
            scratch.members.clear();
            for offset in 0..=(2 * reach).min(bins - 1) {
                let bin = (middle + bins + offset - reach.min((bins - 1) / 2)) % bins;
                for at in candidates.starts[bin]..candidates.starts[bin + 1] {
                    let pixel = &candidates.pixels[at as usize];
                    if pixel.rising == rising && !pixel.taken && residual_px(&fit, pixel).abs() < gate_px {
                        scratch.members.push(at);
                    }
                }
            }
            if i == 1 {
                keep_runs(candidates, options, scratch);
            }
        }
        fit = solve(candidates, &scratch.members, &fit, gate_px, options)?;
    }
    let fit_ = fit;
    scratch.members.retain(|at| residual_px(&fit_, &candidates.pixels[*at as usize]).abs() < GATES_PX[3]);
    fit.length = keep_runs(candidates, options, scratch);
    fit.support = scratch.members.len() as u32;
    fit.rising = if rising { fit.support } else { 0 };
    let slopes = |at: &u32| f64::from(candidates.pixels[*at as usize].slope);
    fit.slopes = (scratch.members.first().map_or(0.0, slopes), scratch.members.last().map_or(0.0, slopes));
    (fit.support > 0).then_some(fit)
}

/// Marks the pixels of the line that was fitted last, and those beside it that are its own.
pub(crate) fn take(candidates: &mut Candidates, scratch: &FitScratch) {
    for at in &scratch.members {
        candidates.pixels[*at as usize].taken = true;
    }
}

/// How far a pixel's edge is from the line, in pixels across it.
#[inline]
fn residual_px(fit: &LineFit, pixel: &Candidate) -> f64 {
    let slant = fit.slant * f64::from(pixel.slope);
    (difference(f64::from(pixel.azimuth), fit.azimuth) - slant) * f64::from(pixel.px_per_rad)
}

/// One step of iteratively reweighted least squares of `azimuth + slant tan(elevation)`, with a prior on the slant.
fn solve(
    candidates: &Candidates,
    members: &[u32],
    at: &LineFit,
    gate_px: f64,
    options: &GreatCircleOptions,
) -> Option<LineFit> {
    let (mut n, mut squares, mut wide) = (0.0, 0.0, 0.0);
    let (mut s0, mut s1, mut s2, mut r0, mut r1) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let narrow = gate_px.powi(-2);
    for member in members {
        let pixel = &candidates.pixels[*member as usize];
        let residual = residual_px(at, pixel);
        let share = 1.0 - residual * residual * narrow;
        if share <= 0.0 {
            continue;
        }
        let trust = share * share;
        let (per_px, slope) = (f64::from(pixel.per_px), f64::from(pixel.slope));
        let weight = trust * f64::from(pixel.px_per_rad).powi(2);
        let turned = residual * per_px;
        n += trust;
        squares += trust * residual * residual;
        wide += trust * per_px;
        s0 += weight;
        s1 += weight * slope;
        s2 += weight * slope * slope;
        r0 += weight * turned;
        r1 += weight * slope * turned;
    }
    if n < 2.0 {
        return None;
    }
    let variance = (squares / (n - 1.0).max(1.0)).max(PIXEL_SIGMA_MIN_PX.powi(2));
    let information = 1.0 / (variance * ERRING_TOGETHER.min(n));
    let prior = 1.0 / options.tilt_sigma_rad.powi(2);
    let (a, b, c) = (information * s0, information * s1, information * s2 + prior);
    let (x, y) = (information * r0, information * r1 - prior * at.slant);
    let determinant = a * c - b * b;
    if determinant.is_nan() || determinant <= 0.0 {
        return None;
    }
    let per_px = wide / n;
    let known = 1.0 / (variance * PULLED_TOGETHER.min(n));
    let (ka, kb, kc) = (known * s0, known * s1, known * s2 + prior);
    Some(LineFit {
        azimuth: wrap(at.azimuth + (c * x - b * y) / determinant),
        slant: at.slant + (a * y - b * x) / determinant,
        sigma: (kc / (ka * kc - kb * kb) + (LINE_SIGMA_PX * per_px).powi(2)).sqrt(),
        scatter_px: variance.sqrt(),
        per_px,
        ..*at
    })
}

/// Sorts the members by elevation, drops those in runs that are too short, and returns the elevation that the others cover.
fn keep_runs(candidates: &Candidates, options: &GreatCircleOptions, scratch: &mut FitScratch) -> f64 {
    let FitScratch { members, runs } = scratch;
    let slope = |at: &u32| candidates.pixels[*at as usize].slope;
    members.sort_unstable_by(|a, b| slope(a).total_cmp(&slope(b)).then(a.cmp(b)));
    let elevation = |at: &u32| f64::from(slope(at)).atan();
    // tan(a - b) = (tan a - tan b) / (1 + tan a tan b), for angles less than a right one apart.
    let gap = if options.gap_max_rad < 1.5 { options.gap_max_rad.tan() as f32 } else { f32::INFINITY };
    let is_near = |a: f32, b: f32| b - a <= gap * (1.0 + a * b).max(1e-6);
    runs.clear();
    let (mut first, mut length) = (0, 0.0);
    for end in 1..=members.len() {
        if end < members.len() && is_near(slope(&members[end - 1]), slope(&members[end])) {
            continue;
        }
        let run = &members[first..end];
        if run.len() >= options.run_min_px as usize {
            length += elevation(&run[run.len() - 1]) - elevation(&run[0]);
            runs.extend_from_slice(run);
        }
        first = end;
    }
    std::mem::swap(members, runs);
    length
}

impl LineFit {
    /// Whether it is long enough, and one edge rather than two that blend or several short ones that happen to be in line.
    pub(crate) fn is_one_line(&self, options: &GreatCircleOptions) -> bool {
        let extent = self.slopes.1.atan() - self.slopes.0.atan();
        self.support >= options.support_min_px
            && self.length >= options.length_min_rad
            && self.length >= options.covered_min * extent
            && self.scatter_px <= options.scatter_max_px
    }
}

/// Two fits of one line that is brighter on one side here and on the other there, as one.
pub(crate) fn joined(a: &LineFit, b: &LineFit) -> LineFit {
    let (wa, wb) = (a.sigma.powi(-2), b.sigma.powi(-2));
    let (na, nb) = (f64::from(a.support), f64::from(b.support));
    LineFit {
        azimuth: wrap(a.azimuth + wb / (wa + wb) * wrap(b.azimuth - a.azimuth)),
        slant: a.slant,
        sigma: (wa + wb).powf(-0.5),
        scatter_px: ((na * a.scatter_px.powi(2) + nb * b.scatter_px.powi(2)) / (na + nb)).sqrt(),
        support: a.support + b.support,
        rising: a.rising + b.rising,
        slopes: (a.slopes.0.min(b.slopes.0), a.slopes.1.max(b.slopes.1)),
        length: (a.length + b.length).min(a.slopes.1.max(b.slopes.1).atan() - a.slopes.0.min(b.slopes.0).atan()),
        per_px: 0.5 * (a.per_px + b.per_px),
    }
}
