//! The chi-square distribution of any number of degrees of freedom: cumulative probability and quantile.

/// Most terms of a series or a continued fraction. They converge in six times `sqrt(dof)` terms, 330 for 3000 degrees of freedom
/// (`the_quantile_undoes_the_probability`); the limit only bounds the time for absurd arguments.
const MAX_TERMS: u32 = 10_000;

/// The probability that a chi-square variable of `dof` degrees of freedom is at most `x`: `P(dof / 2, x / 2)`, the
/// regularised lower incomplete gamma function. 0 for `x <= 0`; NaN for NaN.
pub fn chi_square_cdf(x: f64, dof: u32) -> f64 {
    let (a, x) = (0.5 * f64::from(dof), 0.5 * x);
    if x.is_nan() || dof == 0 {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 0.0;
    }
    if x.is_infinite() {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 { front * lower_series(a, x) } else { 1.0 - front * upper_fraction(a, x) }
}

/// The value that a chi-square variable of `dof` degrees of freedom stays below with a probability in (0, 1), by bisection
/// to the last bits; NaN outside.
pub fn chi_square_quantile(probability: f64, dof: u32) -> f64 {
    if !(probability > 0.0 && probability < 1.0) || dof == 0 {
        return f64::NAN;
    }
    let (mut low, mut high) = (0.0, f64::from(dof) + 1.0);
    while chi_square_cdf(high, dof) < probability && high < 1e9 {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if chi_square_cdf(middle, dof) < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// `sum_k x^k / (a (a + 1) .. (a + k))`.
fn lower_series(a: f64, x: f64) -> f64 {
    let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
    for _ in 0..MAX_TERMS {
        n += 1.0;
        term *= x / n;
        sum += term;
        if term < sum * f64::EPSILON {
            break;
        }
    }
    sum
}

/// The continued fraction of the upper incomplete gamma function, by Lentz's method.
fn upper_fraction(a: f64, x: f64) -> f64 {
    let tiny = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / tiny;
    let mut d = 1.0 / b;
    let mut value = d;
    for i in 1..MAX_TERMS {
        let i = f64::from(i);
        let factor = -i * (i - a);
        b += 2.0;
        d = factor * d + b;
        d = 1.0 / if d.abs() < tiny { tiny } else { d };
        c = b + factor / c;
        c = if c.abs() < tiny { tiny } else { c };
        value *= d * c;
        if (d * c - 1.0).abs() < 4.0 * f64::EPSILON {
            break;
        }
    }
    value
}

/// `ln Gamma(a)` for whole and half `a > 0`: Stirling's series beyond 10, the recurrence below.
fn ln_gamma(a: f64) -> f64 {
    let (mut a, mut product) = (a, 1.0);
    while a < 10.0 {
        product *= a;
        a += 1.0;
    }
    let series = [1.0 / 12.0, -1.0 / 360.0, 1.0 / 1260.0, -1.0 / 1680.0, 1.0 / 1188.0, -691.0 / 360_360.0];
    let inverse = 1.0 / a;
    let tail: f64 = series.iter().rev().fold(0.0, |sum, c| sum * inverse * inverse + c) * inverse;
    (a - 0.5) * a.ln() - a + 0.5 * (2.0 * std::f64::consts::PI).ln() + tail - f64::ln(product)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    #[test]
    fn quantiles_of_the_tables() {
        for (probability, dof, value) in [
            (0.95, 1, 3.841_458_820_694_124),
            (0.95, 2, 5.991_464_547_107_979),
            (0.95, 3, 7.814_727_903_251_179),
            (0.99, 1, 6.634_896_601_021_214),
            (0.999, 2, 13.815_510_557_964_274),
            (0.025, 10, 3.246_972_780_236_842),
            (0.975, 100, 129.561_197_185_834_4),
        ] {
            assert_relative_eq!(chi_square_quantile(probability, dof), value, max_relative = 1e-9);
        }
        assert!(chi_square_quantile(1.0, 2).is_nan() && chi_square_quantile(0.5, 0).is_nan());
    }

    proptest! {
        #[test]
        fn two_degrees_are_an_exponential(x in 0.0..60.0f64) {
            prop_assert!((chi_square_cdf(x, 2) + (-0.5 * x).exp_m1()).abs() < 1e-12);
        }

        #[test]
        fn the_quantile_undoes_the_probability(p in 1e-6..0.999_999f64, dof in 1u32..3000) {
            prop_assert!((chi_square_cdf(chi_square_quantile(p, dof), dof) - p).abs() < 1e-9);
        }
    }
}
