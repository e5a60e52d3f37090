//! Gain and weight of MAGSAC++, marginalised over noise of any scale, as tables and polynomials.

use std::sync::LazyLock;

/// Cells of the marginal tables between a residual of zero and the threshold; a power of two.
pub(super) const CELLS: usize = 1024;

/// The quantile `k` of the normal distribution below whose absolute value 99 % lies: the threshold over the largest scale.
const QUANTILE: f64 = 2.575_829_303_548_901;

/// Degree of the polynomial that stands for the gain of MAGSAC++.
pub(super) const DEGREE: usize = 10;

/// Gain and weight of MAGSAC++ by `|residual| / threshold`.
pub(super) struct Marginal {
    /// Coefficients of the gain's polynomial in `2 |residual| / threshold - 1`, the constant first; off by less than 1e-3.
    pub(super) gain: [f32; DEGREE + 1],
    /// The weight at the middles of cells, one in the first; zero from the threshold on.
    pub(super) weight: [f32; 2 * CELLS],
}

/// The tables: the same numbers for every threshold.
pub(super) static MARGINAL: LazyLock<Marginal> = LazyLock::new(|| {
    let mut weight = [0.0; 2 * CELLS];
    for (cell, weight) in weight.iter_mut().take(CELLS).enumerate() {
        *weight = (weight_at((cell as f64 + 0.5) / CELLS as f64) / weight_most()) as f32;
    }
    Marginal { gain: gain_polynomial(), weight }
});

/// Interpolation at Chebyshev's points, by Newton's divided differences multiplied out.
fn gain_polynomial() -> [f32; DEGREE + 1] {
    let count = (DEGREE + 1) as f64;
    let points: [f64; DEGREE + 1] = std::array::from_fn(|i| (std::f64::consts::PI * (i as f64 + 0.5) / count).cos());
    let mut differences = points.map(|point| gain_at(0.5 * (point + 1.0)));
    for order in 1..=DEGREE {
        for i in (order..=DEGREE).rev() {
            differences[i] = (differences[i] - differences[i - 1]) / (points[i] - points[i - order]);
        }
    }
    let mut coefficients = [0.0; DEGREE + 1];
    for i in (0..=DEGREE).rev() {
        // Multiplied by (x - point), then the difference added.
        for power in (0..=DEGREE).rev() {
            let below = if power > 0 { coefficients[power - 1] } else { differences[i] };
            coefficients[power] = below - points[i] * coefficients[power];
        }
    }
    coefficients.map(|coefficient| coefficient as f32)
}

/// The gain of MAGSAC++ for a residual, given as a share of the threshold that is not negative.
#[inline(always)]
pub(super) fn marginal_gain(coefficients: &[f32; DEGREE + 1], part: f32) -> f32 {
    let x = 2.0 * part - 1.0;
    let mut gain = coefficients[DEGREE];
    for power in (0..DEGREE).rev() {
        gain = gain * x + coefficients[power];
    }
    let gain = if gain < 1.0 { gain } else { 1.0 };
    if part < 1.0 && gain > 0.0 { gain } else { 0.0 }
}

/// The cell of a residual, given as a share of the threshold that is not negative.
#[inline(always)]
pub(super) fn cell(part: f32) -> usize {
    // Beyond the threshold every cell of the second half is zero.
    let scaled = (part * CELLS as f32).min((2 * CELLS - 1) as f32);
    (scaled as i32 as usize) & (2 * CELLS - 1)
}

/// `w(r)` of MAGSAC++ for one degree of freedom but for a factor: `E1(r^2 / 2 s^2) - E1(k^2 / 2)`, `s = threshold / k`.
pub(super) fn weight_at(part: f64) -> f64 {
    let end = 0.5 * QUANTILE * QUANTILE;
    exponential_integral(end * part * part) - exponential_integral(end)
}

/// The slope `d (r w) / d r` on the same scale as [`weight_at`].
pub(super) fn slope_at(part: f64) -> f64 {
    weight_at(part) - 2.0 * (-0.5 * QUANTILE * QUANTILE * part * part).exp()
}

/// The largest value of the weight's table on the scale of [`weight_at`].
pub(super) fn weight_most() -> f64 {
    weight_at(0.5 / CELLS as f64)
}

/// `1 - rho(r) / rho(threshold)` with `rho(r)` the integral of `x w(x)`: `1 - e^-x + x (E1(x) - E1(k^2 / 2))`,
/// `x = r^2 / 2 s^2`.
pub(super) fn gain_at(part: f64) -> f64 {
    let end = 0.5 * QUANTILE * QUANTILE;
    let x = end * part * part;
    let loss = 1.0 - (-x).exp() + x * weight_at(part);
    1.0 - loss / (1.0 - (-end).exp())
}

/// `E1(x)`, the integral of `e^-t / t` from `x` on, by its series, for `x` in (0, 4).
fn exponential_integral(x: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    let (mut term, mut sum) = (-1.0, 0.0);
    for n in 1..60 {
        let n = f64::from(n);
        term *= -x / n;
        sum += term / n;
    }
    sum - x.ln() - EULER
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The weight is the integral over scales of the half-normal density, its gain that of the weight.
    #[test]
    fn marginals_are_the_integrals_of_the_paper() {
        let scale_max = 1.0 / QUANTILE;
        let steps = 200_000;
        let marginal = |r: f64| {
            let from = r / QUANTILE;
            let width = (scale_max - from) / f64::from(steps);
            let at = |i| {
                let scale = from + (f64::from(i) + 0.5) * width;
                (-0.5 * (r / scale).powi(2)).exp() / scale * width
            };
            2.0 * (0..steps).map(at).sum::<f64>()
        };
        for r in [0.05, 0.3, 0.7, 0.95] {
            assert!((weight_at(r) - marginal(r)).abs() < 1e-6, "{r}: {} {}", weight_at(r), marginal(r));
            let h = 1e-5;
            let numeric = ((r + h) * weight_at(r + h) - (r - h) * weight_at(r - h)) / (2.0 * h);
            assert!((slope_at(r) - numeric).abs() < 1e-5);
            // d gain / d r is proportional to -r w(r).
            let ratio = |r: f64| (gain_at(r + h) - gain_at(r - h)) / (2.0 * h) / (r * weight_at(r));
            assert!((ratio(r) / ratio(0.5) - 1.0).abs() < 1e-4);
        }
        assert!((gain_at(1e-9) - 1.0).abs() < 1e-9 && gain_at(1.0).abs() < 1e-12);
    }
}
