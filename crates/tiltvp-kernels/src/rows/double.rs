//! Rows in double precision: counting, and sums of gated products in loops that the compiler makes vectors of.

use crate::vectorised;

use super::simd::WIDTH;
use super::{Gate, HARD, OPEN, REJECTED, SOFT, Sums, WITHIN};

/// Rows that are added up together: five columns of as many are 20 KB, which the nearest cache holds.
pub(super) const BLOCK: usize = 512;

/// Rows of a small problem, for which a tenth of that memory is cleared: the places along a ray of a corner.
const FEW: usize = 64;

vectorised! {
    /// Counts rows with `|d| <= reach`.
    pub(super) fn count([x, y, z]: [&[f64]; 3], [h0, h1, h2]: [f64; 3], reach: f64) -> usize {
        let within = |((x, y), z): ((&f64, &f64), &f64)| {
            let d = x * h0 + y * h1 + z * h2;
            u32::from(d.abs() <= reach)
        };
        x.iter().zip(y).zip(z).map(within).sum::<u32>() as usize
    }
}

vectorised! {
    /// Adds a block of rows to the sums and applies the gate to their weights.
    pub(super) fn accumulate(rows: [&[f64]; 3], weights: &mut [f32], model: [f64; 3], gate: Gate<f64>, sums: &mut Sums) {
        if weights.len() <= FEW {
            accumulate_gated::<FEW>(rows, weights, model, gate, sums);
        } else {
            accumulate_gated::<BLOCK>(rows, weights, model, gate, sums);
        }
    }
}

/// The same for at most `ROOM` rows.
#[inline(always)]
fn accumulate_gated<const ROOM: usize>(
    rows: [&[f64]; 3],
    weights: &mut [f32],
    model: [f64; 3],
    gate: Gate<f64>,
    sums: &mut Sums,
) {
    match gate {
        Gate::Open => accumulate_body::<OPEN, ROOM>(rows, weights, model, 0.0, sums),
        Gate::Hard { reach } => accumulate_body::<HARD, ROOM>(rows, weights, model, reach, sums),
        Gate::Rejected { reach } => accumulate_body::<REJECTED, ROOM>(rows, weights, model, reach, sums),
        Gate::Within { reach } => accumulate_body::<WITHIN, ROOM>(rows, weights, model, reach, sums),
        Gate::Soft { inverse } => accumulate_body::<SOFT, ROOM>(rows, weights, model, inverse, sums),
    }
}

/// Residuals and gated weights first, then each sum, all of it in the first-level cache. `limit` is the number of the gate.
#[inline(always)]
fn accumulate_body<const GATE: u8, const ROOM: usize>(
    [x, y, z]: [&[f64]; 3],
    weights: &mut [f32],
    [h0, h1, h2]: [f64; 3],
    limit: f64,
    sums: &mut Sums,
) {
    let (mut d, mut w) = ([0.0f64; ROOM], [0.0f64; ROOM]);
    let (mut wx, mut wy, mut wd) = ([0.0f64; ROOM], [0.0f64; ROOM], [0.0f64; ROOM]);
    let n = weights.len().min(ROOM);
    let (x, y, z, weights) = (&x[..n], &y[..n], &z[..n], &mut weights[..n]);
    let mut count = 0u32;
    for i in 0..n {
        d[i] = x[i] * h0 + y[i] * h1 + z[i] * h2;
        if GATE == OPEN {
            w[i] = f64::from(weights[i]);
        } else if GATE == SOFT {
            let t = 1.0 - d[i] * d[i] * limit;
            let t = if t > 0.0 { t } else { 0.0 };
            let t = t * t;
            let t = t * t;
            w[i] = f64::from(weights[i]) * (t * t);
        } else {
            let kept = if d[i].abs() <= limit { weights[i] } else { 0.0 };
            w[i] = f64::from(if GATE == REJECTED { weights[i] - kept } else { kept });
            weights[i] = if GATE == WITHIN { weights[i] } else { kept };
        }
        count += u32::from(w[i] > 0.0);
        wx[i] = w[i] * x[i];
        wy[i] = w[i] * y[i];
        wd[i] = w[i] * d[i];
    }
    let [d, w, wx, wy, wd] = [&d[..n], &w[..n], &wx[..n], &wy[..n], &wd[..n]];
    sums.count += count as usize;
    sums.sums[0] += sum(w);
    sums.sums[1] += dot(wx, x);
    sums.sums[2] += dot(wx, y);
    sums.sums[3] += dot(wy, y);
    sums.sums[4] += dot(wx, d);
    sums.sums[5] += dot(wy, d);
    sums.sums[6] += dot(wd, d);
}

/// The sum of `a`, in [`WIDTH`] partial sums.
#[inline(always)]
fn sum(a: &[f64]) -> f64 {
    let mut partial = [0.0; WIDTH];
    let (whole, rest) = a.as_chunks::<WIDTH>();
    for a in whole {
        for i in 0..WIDTH {
            partial[i] += a[i];
        }
    }
    for (sum, a) in partial.iter_mut().zip(rest) {
        *sum += a;
    }
    partial.iter().sum()
}

/// The sum of `a b`.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut partial = [0.0; WIDTH];
    let ((whole_a, rest_a), (whole_b, rest_b)) = (a.as_chunks::<WIDTH>(), b.as_chunks::<WIDTH>());
    for (a, b) in whole_a.iter().zip(whole_b) {
        for i in 0..WIDTH {
            partial[i] += a[i] * b[i];
        }
    }
    for ((sum, a), b) in partial.iter_mut().zip(rest_a).zip(rest_b) {
        *sum += a * b;
    }
    partial.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_sums_are_those_of_the_plain_loop_to_the_last_bit() {
        let model = [0.02, -0.03, 0.9];
        for n in (0..40).chain([FEW, FEW + 1, BLOCK - 1, BLOCK]) {
            let column = |k: usize| -> Vec<f64> { (0..n).map(|i| ((i * (3 + k)) as f64 * 0.37).sin()).collect() };
            let (x, y, z) = (column(0), column(1), column(2));
            let rows = [&x[..], &y, &z];
            let d = |i: usize| x[i] * model[0] + y[i] * model[1] + z[i] * model[2];
            assert_eq!(count(rows, model, 0.3), (0..n).filter(|i| d(*i).abs() <= 0.3).count());
            let own: Vec<f32> = (0..n).map(|i| (i % 5) as f32).collect();
            let gates =
                [Gate::Open, Gate::Hard { reach: 0.3 }, Gate::Rejected { reach: 0.3 }, Gate::Within { reach: 0.3 }];
            for gate in gates.into_iter().chain([Gate::Soft { inverse: 2.0 }]) {
                let (mut found, mut plain) = ((own.clone(), Sums::default()), (own.clone(), Sums::default()));
                accumulate(rows, &mut found.0, model, gate, &mut found.1);
                accumulate_gated::<BLOCK>(rows, &mut plain.0, model, gate, &mut plain.1);
                assert_eq!((found.0, found.1.count), (plain.0, plain.1.count), "{n} rows, {gate:?}");
                assert_eq!(found.1.sums.map(f64::to_bits), plain.1.sums.map(f64::to_bits), "{n} rows, {gate:?}");
            }
        }
    }
}
