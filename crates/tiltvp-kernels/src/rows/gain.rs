//! The truncated quadratic of residuals: `max(0, 1 - d^2 / threshold^2)`, added up.

use crate::vectorised;

use super::double::BLOCK;
use super::simd::WIDTH;

/// The gain of each row of a block, then their sum, in [`WIDTH`] partial sums. `gain` has the residual and the inverse threshold.
macro_rules! sum_of_gains {
    ($name:ident, $body:ident, $float:ty) => {
        vectorised! {
            pub(super) fn $name(rows: [&[$float]; 3], model: [$float; 3], inverse: $float) -> f64 {
                $body(rows, model, inverse)
            }
        }

        #[inline(always)]
        fn $body([x, y, z]: [&[$float]; 3], [h0, h1, h2]: [$float; 3], inverse: $float) -> f64 {
            let mut gains = [0.0f32; BLOCK];
            let n = x.len().min(BLOCK);
            let (x, y, z, gains) = (&x[..n], &y[..n], &z[..n], &mut gains[..n]);
            for i in 0..n {
                let part = (x[i] * h0 + y[i] * h1 + z[i] * h2) * inverse;
                gains[i] = (1.0 - part * part).max(0.0) as f32;
            }
            sum(gains)
        }
    };
}

sum_of_gains!(single, single_body, f32);
sum_of_gains!(double, double_body, f64);

#[inline(always)]
fn sum(gains: &[f32]) -> f64 {
    let mut partial = [0.0f32; WIDTH];
    let (whole, rest) = gains.as_chunks::<WIDTH>();
    for gains in whole {
        for i in 0..WIDTH {
            partial[i] += gains[i];
        }
    }
    for (sum, gain) in partial.iter_mut().zip(rest) {
        *sum += gain;
    }
    partial.iter().map(|part| f64::from(*part)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_are_those_of_the_plain_loop_to_the_last_bit() {
        for n in (0..40).chain([100, BLOCK]) {
            let column = |k: usize| -> Vec<f32> { (0..n).map(|i| ((i * (3 + k)) as f32 * 0.37).sin()).collect() };
            let rows = [&column(0)[..], &column(1), &column(2)];
            let model = [0.02, -0.03, 0.9];
            assert_eq!(single(rows, model, 1.3).to_bits(), single_body(rows, model, 1.3).to_bits());
            let wide = rows.map(|column| column.iter().map(|x| f64::from(*x)).collect::<Vec<_>>());
            let (rows, model) = (wide.each_ref().map(|column| &column[..]), model.map(f64::from));
            let found = double(rows, model, 1.3);
            assert_eq!(found.to_bits(), double_body(rows, model, 1.3).to_bits());
            let gain = |i: usize| {
                let d: f64 = (0..3).map(|k| rows[k][i] * model[k]).sum();
                (1.0 - (1.3 * d).powi(2)).max(0.0)
            };
            assert!((found - (0..n).map(gain).sum::<f64>()).abs() < 1e-5 * (1.0 + n as f64));
        }
    }
}
