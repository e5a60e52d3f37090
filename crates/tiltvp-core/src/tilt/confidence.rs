//! How sure an estimate is: a covariance that knows that pixels of one edge err together, and the chance of a small error.

use nalgebra::{Matrix2, Vector2};

use crate::robust::{Gate, Real, Rows};

/// Sectors of azimuth within which residuals are taken as one: an edge of a room rarely spans more.
pub(super) const SECTORS: usize = 64;

/// Rows that are enough for a covariance.
const ENOUGH: usize = 4000;

/// An error below this many radians counts as a good estimate.
const GOOD_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Standard deviation in radians of what no image tells: bent lenses, walls out of plumb, blur.
const FLOOR_RAD: f64 = 0.25 * std::f64::consts::PI / 180.0;

/// The sandwich covariance `H^-1 (sum_c g_c g_c^T) H^-1` of a linear fit, with scores `g_c` summed over sectors of azimuth.
///
/// `H = sum d(w d)/dd (x, y)^T (x, y)` and `g_c = sum_(k in c) w d (x, y)` (Huber's covariance of an M-estimate): with the weights
/// themselves in `H`, clutter that fills the gate would count as evidence. To it is added the square of `H^-1 sum_c g_c`, the
/// way from the model to where the gated rows would have it: none for the fit they made, but telling for a model that was
/// chosen otherwise. Weights are one where none are given. `None` if fewer than three sectors hold anything or the model is
/// near no minimum.
pub(super) fn clustered_covariance<T: Real>(
    rows: &Rows<T>,
    model: [f64; 3],
    gate: Gate,
    weights: Option<&[f32]>,
    sector: impl Fn(usize) -> u8,
) -> Option<Matrix2<f64>> {
    let mut scores = [Vector2::<f64>::zeros(); SECTORS];
    let mut held = [false; SECTORS];
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    // A sample of the rows is enough to tell how the sectors err: sums over it are proportional to sums over all.
    let stride = rows.len() / ENOUGH;
    rows.for_each_gated(model, gate, weights, stride, |row, [weight, slope, x, y, d]| {
        (xx, xy, yy) = (xx + slope * x * x, xy + slope * x * y, yy + slope * y * y);
        let sector = usize::from(sector(row)) % SECTORS;
        scores[sector] += Vector2::new(x, y) * (weight * d);
        held[sector] = true;
    });
    let occupied = held.iter().filter(|held| **held).count() as f64;
    if occupied < 3.0 {
        return None;
    }
    let inverse = inverse_of_positive(&Matrix2::new(xx, xy, xy, yy))?;
    let spread: Matrix2<f64> = scores.iter().map(|g| g * g.transpose()).sum();
    let away = inverse * scores.iter().sum::<Vector2<f64>>();
    let covariance = inverse * spread * inverse * (occupied / (occupied - 2.0)) + away * away.transpose();
    covariance.iter().all(|x| x.is_finite()).then_some(covariance)
}

/// The inverse of a positive definite matrix.
pub(super) fn inverse_of_positive(matrix: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let (determinant, trace) = (matrix.determinant(), matrix.trace());
    if trace > 0.0 && determinant > 1e-12 * trace * trace { matrix.try_inverse() } else { None }
}

/// Adds the floor of what no image tells.
pub(super) fn with_floor(covariance: Matrix2<f64>) -> Matrix2<f64> {
    0.5 * (covariance + covariance.transpose()) + Matrix2::identity() * (FLOOR_RAD * FLOOR_RAD)
}

/// The probability that the error is below two degrees if it is normal with this covariance, taken as round.
pub(super) fn confidence(covariance: &Matrix2<f64>) -> f64 {
    let variance = 0.5 * covariance.trace();
    if variance.is_finite() && variance > 0.0 { -(-0.5 * GOOD_RAD * GOOD_RAD / variance).exp_m1() } else { 0.0 }
}
