//! Polynomials with real coefficients, lowest power first: values, slopes and the first place where one falls to zero.

use std::f64::consts::PI;

/// `(p(x), p'(x))` by Horner's rule.
#[inline]
pub(super) fn evaluate(coefficients: &[f64], x: f64) -> (f64, f64) {
    let (mut value, mut slope) = (0.0, 0.0);
    for &c in coefficients.iter().rev() {
        slope = slope * x + value;
        value = value * x + c;
    }
    (value, slope)
}

/// The coefficients of `a b`.
pub(super) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; (a.len() + b.len()).saturating_sub(1)];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

/// The coefficients of `a + s b`.
pub(super) fn sum(a: &[f64], s: f64, b: &[f64]) -> Vec<f64> {
    let term = |c: &[f64], i: usize| c.get(i).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).map(|i| term(a, i) + s * term(b, i)).collect()
}

/// The coefficients of `p'`.
pub(super) fn derivative(coefficients: &[f64]) -> Vec<f64> {
    coefficients.iter().enumerate().skip(1).map(|(i, c)| i as f64 * c).collect()
}

/// No root has a larger magnitude than this (Fujiwara 1916): `2 max |c_(n-i) / c_n|^(1/i)`.
pub(super) fn root_bound(coefficients: &[f64]) -> f64 {
    let c = trimmed(coefficients);
    let Some((&last, rest)) = c.split_last() else { return 0.0 };
    2.0 * rest.iter().rev().enumerate().map(|(i, x)| (x / last).abs().powf(1.0 / (i + 1) as f64)).fold(0.0, f64::max)
}

/// The smallest `x` in `(0, end]` where a polynomial that is positive at 0 stops being so.
///
/// Between the roots of its derivative a polynomial is monotone, so every change of sign is bracketed and none is missed.
pub(super) fn first_fall(coefficients: &[f64], end: f64) -> Option<f64> {
    let c = trimmed(coefficients);
    let mut low = 0.0;
    for knot in roots(&derivative(c), end).into_iter().chain([end]) {
        if evaluate(c, knot).0 <= 0.0 {
            return Some(bisect(c, low, knot));
        }
        low = knot;
    }
    None
}

/// How far from the axis a profile grows: to where its slope, a polynomial in `theta` less that of the fold, falls to zero, or to pi.
pub(super) fn fold_rad(slope: &[f64]) -> f64 {
    first_fall(slope, PI).unwrap_or(PI)
}

/// Every real root in `(0, end)` where the sign changes, in order.
fn roots(coefficients: &[f64], end: f64) -> Vec<f64> {
    let c = trimmed(coefficients);
    if c.len() < 2 {
        return Vec::new();
    }
    let mut out = Vec::with_capacity(c.len());
    let mut low = 0.0;
    for knot in roots(&derivative(c), end).into_iter().chain([end]) {
        if (evaluate(c, low).0 > 0.0) != (evaluate(c, knot).0 > 0.0) {
            out.push(bisect(c, low, knot));
        }
        low = knot;
    }
    out
}

/// The end of a bracket of a change of sign that has the sign of `low`, halved until it is as tight as `f64` can say.
fn bisect(c: &[f64], mut low: f64, mut high: f64) -> f64 {
    let positive = evaluate(c, low).0 > 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (evaluate(c, middle).0 > 0.0) == positive { low = middle } else { high = middle }
    }
    low
}

fn trimmed(coefficients: &[f64]) -> &[f64] {
    let degree = coefficients.iter().rposition(|&c| c != 0.0).map_or(0, |i| i + 1);
    &coefficients[..degree]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_fall_is_found_between_close_roots() {
        // (1 - x)(1.001 - x)(3 - x): positive, negative for a thousandth, positive, negative.
        let p = product(&product(&[1.0, -1.0], &[1.001, -1.0]), &[3.0, -1.0]);
        let fall = first_fall(&p, root_bound(&p)).unwrap_or(f64::NAN);
        assert!((fall - 1.0).abs() < 1e-11, "{fall}");
    }

    #[test]
    fn no_fall_is_none() {
        assert_eq!(first_fall(&[1.0, 0.0, 2.0], 1e6), None);
        assert_eq!(first_fall(&[1.0], 1e6), None);
    }

    #[test]
    fn bound_covers_the_roots() {
        let p = product(&product(&[-7.0, 1.0], &[2.0, 1.0]), &[0.5, 1.0]);
        assert!(root_bound(&p) >= 7.0 && root_bound(&p) < 30.0);
    }
}
