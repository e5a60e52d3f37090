//! How sure an estimate is: a covariance that knows that pixels of one edge err together, and the chance of a small error.

use nalgebra::{Matrix2, Vector2};

use crate::filter::probability_within;
use crate::geometry::Tilt;
use crate::robust::{GROUPS, GroupSums, Rows};

/// Sectors of azimuth within which residuals are taken as one: an edge of a room rarely spans more.
pub(super) const SECTORS: usize = GROUPS;

/// Rows that are enough for a covariance: some 60 for each of the 64 sectors, whose pooled variance is then good to a fifth.
const ENOUGH: usize = 4000;

/// An error below two degrees counts as a good estimate: Fleer 2017 finds mean errors of one to two, and leans of up to four.
const GOOD_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Standard deviation in radians of what no image tells: bent lenses, walls out of plumb, blur. Set on images of known tilt, see
/// [`clustered_covariance`].
pub(super) const FLOOR_RAD: f64 = 0.17 * std::f64::consts::PI / 180.0;

/// Share of the pooled variance of the sectors' residuals that each sector brings into the estimate, set likewise.
const SECTOR_SHARE: f64 = 0.55;

/// Length in radians of a stretch of clutter that may lie unnoticed at the most misleading residual, set likewise.
const CLUTTER_RAD: f64 = 0.056;

/// The covariance of a gated linear fit whose errors are those of whole edges and not of pixels.
///
/// Residuals of one sector of azimuth err together: with the information `I_c = sum_(k in c) w (x, y)^T (x, y)` and the score
/// `g_c = sum_(k in c) w d (x, y)` of each sector, the pooled variance of the sectors is
/// `s^2 = (sum_c |g_c|^2 / tr I_c) / sum_c tr I_c`, of which a share comes through. Then
/// `C = H^-1 (s^2 sum_c I_c^2 + b^2) H^-1`, where `b` is the pull of a little clutter that agrees with itself, which is what
/// tells an image with few edges from one with many. `H = sum d(w d)/dd (x, y)^T (x, y)` has Huber's slope of the gate: with the
/// weights themselves, clutter that fills the gate would count as evidence. To it is added the square of `H^-1 sum_c g_c`, the
/// way from the model to where the gated rows would have it: none for the fit they made, but telling for a model that was
/// chosen otherwise. Weights are one where none are given; `sector_of` has the pixel of each row and the sector of each pixel. The share, the clutter and the floor were set on every second
/// location of 108 panoramas and 72 rendered rooms, as they are and darkened, blurred or half hidden, and checked on the others
/// (`tiltvp measure confidence`).
///
/// Where `H` is not positive, for as much lies on the falling side of the gate as on the rising one, a share of the information takes
/// its place in the directions that it is not.
///
/// `None` if fewer than three sectors hold anything.
pub(super) fn clustered_covariance(
    rows: &Rows<f32>,
    model: [f64; 3],
    scale: f64,
    weights: Option<&[f32]>,
    pixels_per_rad: f64,
    sector_of: (&[u32], &[u8]),
) -> Option<Matrix2<f64>> {
    // A sample of the rows is enough to tell how the sectors err: sums over it are proportional to sums over all.
    let stride = (rows.len() / ENOUGH).max(1);
    let GroupSums { groups: sectors, slopes: [xx, xy, yy] } =
        rows.sums_by_group(model, scale, weights, stride, sector_of);
    let held = || sectors.iter().filter(|[a, _, c, ..]| a + c > 0.0);
    if held().count() < 3 {
        return None;
    }
    let slopes = Matrix2::new(xx, xy, xy, yy);
    let inverse = inverse_of_positive(&slopes).or_else(|| {
        let information: f64 = held().map(|[a, _, c, ..]| a + c).sum();
        inverse_of_positive(&raised(&slopes, LEAST_SLOPE * information))
    })?;
    let total: f64 = held().map(|[a, _, c, ..]| a + c).sum();
    let pooled = held().map(|[a, _, c, x, y]| (x * x + y * y) / (a + c)).sum::<f64>() / total;
    let squares: Matrix2<f64> = held()
        .map(|[a, b, c, ..]| {
            let block = Matrix2::new(*a, *b, *b, *c);
            block * block
        })
        .sum();
    let own = weights.map_or(1.0, mean);
    let clutter = CLUTTER_RAD * pixels_per_rad / stride as f64 * own * scale;
    let spread = squares * (SECTOR_SHARE * pooled) + Matrix2::identity() * (clutter * clutter);
    let away = inverse * sectors.iter().map(|[.., x, y]| Vector2::new(*x, *y)).sum::<Vector2<f64>>();
    let covariance = inverse * spread * inverse + away * away.transpose();
    covariance.iter().all(|x| x.is_finite()).then_some(covariance)
}

/// Share of the information that `H` has at least: what the gate leaves of rows that fill it evenly, up to noise, which makes
/// confidences of nearly nothing.
const LEAST_SLOPE: f64 = 0.02;

/// A symmetric matrix with eigenvalues of at least a limit.
fn raised(matrix: &Matrix2<f64>, least: f64) -> Matrix2<f64> {
    let mut eigen = matrix.symmetric_eigen();
    eigen.eigenvalues.apply(|value| *value = value.max(least));
    eigen.recompose()
}

/// The mean, in lanes of single precision that are added up in double precision every now and then.
fn mean(values: &[f32]) -> f64 {
    let mut total = 0.0;
    for part in values.chunks(1024) {
        let mut lanes = [0.0f32; 16];
        let (whole, rest) = part.as_chunks::<16>();
        for values in whole {
            lanes.iter_mut().zip(values).for_each(|(lane, value)| *lane += value);
        }
        total += lanes.iter().chain(rest).map(|value| f64::from(*value)).sum::<f64>();
    }
    total / values.len().max(1) as f64
}

/// The inverse of a positive definite matrix.
pub(super) fn inverse_of_positive(matrix: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let (determinant, trace) = (matrix.determinant(), matrix.trace());
    if trace > 0.0 && determinant > 1e-12 * trace * trace { matrix.try_inverse() } else { None }
}

/// Share of the lean by which the methods that approximate the lens err beyond what their edges tell: with it their 90 %
/// regions hold about 90 % of the truths on 108 panoramas, the same ones on which it was chosen.
pub(super) const APPROXIMATE_SHARE: f64 = 0.2;

/// Near edges that do not agree for each one that does, at which the lean errs by itself, and how steeply the error grows with them.
/// They pass the prefilter about the upright robot and draw the fit to it, in noise by two thirds of the lean. Set on views of 108
/// panoramas, harmed in nine ways. Drawn anew, the 90 % regions of noisy, blurred and 320 x 240 views hold 88, 83 and 91 % where they
/// held 64, 77 and 82, those of unharmed ones 92 where they held 90.
const DILUTED_BY: f64 = 1.5;
const DILUTION: i32 = 7;

/// So many others for each that agrees are as good as any more: nothing is known.
const OTHERS_MAX: f64 = 4.0;

/// The share of a lean by which edges that passed the prefilter and do not agree may have drawn it to the upright robot. Of those
/// of a wider prefilter than that for ten degrees only a share is as near.
pub(super) fn diluted_share(agreeing: usize, near: usize, as_near: f64) -> f64 {
    // A few edges more of each kind, for few tell no ratio.
    let others = as_near * ((near as f64 + 50.0) / (agreeing as f64 + 5.0) - 1.0);
    (others.clamp(0.0, OTHERS_MAX) / DILUTED_BY).powi(DILUTION)
}

/// Adds the error of an angle that is right up to a share of itself, in the direction of the lean.
pub(super) fn with_lean_error(covariance: Matrix2<f64>, tilt: &Tilt, share: f64) -> Matrix2<f64> {
    let error = Vector2::new(tilt.beta_rad().cos(), tilt.beta_rad().sin()) * (share * tilt.alpha_rad());
    covariance + error * error.transpose()
}

/// Adds the error of a blurred image, of which the edges run into each other, by its standard deviation a side.
pub(super) fn with_blur(covariance: Matrix2<f64>, sigma_rad: f64) -> Matrix2<f64> {
    covariance + Matrix2::identity() * (sigma_rad * sigma_rad)
}

/// Adds the floor of what no image tells.
pub(super) fn with_floor(covariance: Matrix2<f64>) -> Matrix2<f64> {
    0.5 * (covariance + covariance.transpose()) + Matrix2::identity() * (FLOOR_RAD * FLOOR_RAD)
}

/// The probability that the error is below two degrees if it is normal with this covariance; 0 if that is not finite.
pub(super) fn confidence(covariance: &Matrix2<f64>) -> f64 {
    probability_within(covariance, GOOD_RAD)
}
