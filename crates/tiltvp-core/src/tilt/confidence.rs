//! How sure an estimate is: a covariance that knows that pixels of one edge err together, and the chance of a small error.

use nalgebra::{Matrix2, Vector2};

use crate::robust::{Gate, Real, Rows};

/// Sectors of azimuth within which residuals are taken as one: an edge of a room rarely spans more.
pub(super) const SECTORS: usize = 64;

/// An error below this many radians counts as a good estimate.
const GOOD_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Standard deviation in radians of what no image tells: bent lenses, walls out of plumb, blur.
const FLOOR_RAD: f64 = 0.25 * std::f64::consts::PI / 180.0;

/// The sandwich covariance `H^-1 (sum_c g_c g_c^T) H^-1` of a linear fit, with scores `g_c` summed over sectors of azimuth.
///
/// `H = sum w (x, y)^T (x, y)` and `g_c = sum_(k in c) w d (x, y)`. `sectors` gives the sector of each row. `None` if
/// fewer than three sectors hold anything or the fit is degenerate.
pub(super) fn clustered_covariance<T: Real>(
    rows: &Rows<T>,
    model: [f64; 3],
    gate: Gate,
    weights: &[f32],
    sector: impl Fn(usize) -> u8,
) -> Option<Matrix2<f64>> {
    let mut scores = [Vector2::<f64>::zeros(); SECTORS];
    let mut held = [false; SECTORS];
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    rows.for_each_gated(model, gate, weights, |row, [weight, x, y, d]| {
        let (wx, wy) = (weight * x, weight * y);
        (xx, xy, yy) = (xx + wx * x, xy + wx * y, yy + wy * y);
        let sector = usize::from(sector(row)) % SECTORS;
        scores[sector] += Vector2::new(wx, wy) * d;
        held[sector] = true;
    });
    let occupied = held.iter().filter(|held| **held).count() as f64;
    if occupied < 3.0 {
        return None;
    }
    let inverse = Matrix2::new(xx, xy, xy, yy).try_inverse()?;
    let spread: Matrix2<f64> = scores.iter().map(|g| g * g.transpose()).sum();
    let covariance = inverse * spread * inverse * (occupied / (occupied - 2.0));
    covariance.iter().all(|x| x.is_finite()).then_some(covariance)
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
