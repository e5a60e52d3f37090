//! The arithmetic that rows are stored in, and the kernels that pass over them, for the machine's widest vectors.

use multiversion::multiversion;

use super::aligned::Dense;
use super::lanes::{self, HARD, ONES, OPEN, REJECTED, SOFT, WITHIN};
use super::loss::Shape;
use super::marginal::{DEGREE, MARGINAL, cell, marginal_gain};
use super::total::Total;
use super::vectors::LANES;

/// Rows added up in the rows' own precision before they are added in double precision.
pub(super) const BLOCK: usize = 512;

/// The table of a gate as the kernels' parameter, beside those of [`lanes`].
const MARGINALS: u8 = 2;

/// The arithmetic that rows are stored in: `f32` or `f64`.
#[expect(private_bounds, reason = "what numbers are dense is told by the two that there are")]
pub trait Real:
    Dense + PartialOrd + std::ops::Add<Output = Self> + std::ops::Sub<Output = Self> + std::ops::Mul<Output = Self>
{
    /// Whether there is a kernel for [`Shape::Rejected`].
    #[doc(hidden)]
    const TRIMS: bool;
    /// Rows added up in their own precision before they are added in double precision.
    #[doc(hidden)]
    const BLOCK: usize;
    /// Rounds from double precision.
    fn from_f64(value: f64) -> Self;
    /// Widens a weight.
    fn from_f32(value: f32) -> Self;
    /// Widens to double precision.
    fn to_f64(self) -> f64;
    /// Rounds to single precision.
    fn to_f32(self) -> f32;
    /// Without its sign.
    #[must_use]
    fn magnitude(self) -> Self;
    /// The largest number whose square, rounded, is at most the square of a threshold.
    fn reach(threshold: f64) -> Self;
    #[doc(hidden)]
    fn count(rows: [&[Self]; 3], model: [Self; 3], reach: Self) -> usize;
    #[doc(hidden)]
    fn gather(
        rows: [&[Self]; 3],
        weights: &mut [f32],
        model: [Self; 3],
        gains: (Self, Self),
        shape: Shape,
        ones: bool,
        total: &mut Total,
    );
    #[doc(hidden)]
    fn gain(rows: [&[Self]; 3], model: [Self; 3], inverse: Self, marginal: Option<&[f32; DEGREE + 1]>) -> f64;
}

/// One block: residuals and gated weights first, then each sum in lanes of its own, all of it in the first-level cache.
#[inline(always)]
fn gather_body<T: Real, const SHAPE: u8>(
    [x, y, z]: [&[T]; 3],
    weights: &mut [f32],
    [h0, h1, h2]: [T; 3],
    (reach, inverse): (T, T),
    total: &mut Total,
) {
    let (one, zero) = (T::from_f64(1.0), T::default());
    let [mut d, mut w, mut wx, mut wy, mut wd] = [[zero; BLOCK]; 5];
    let n = weights.len().min(BLOCK);
    let (x, y, z, weights) = (&x[..n], &y[..n], &z[..n], &mut weights[..n]);
    let mut count = 0u32;
    let table = &*MARGINAL;
    for i in 0..n {
        d[i] = x[i] * h0 + y[i] * h1 + z[i] * h2;
        let dd = d[i] * d[i];
        if SHAPE == OPEN {
            w[i] = T::from_f32(weights[i]);
        } else if SHAPE == HARD {
            weights[i] = if d[i].magnitude() <= reach { weights[i] } else { 0.0 };
            w[i] = T::from_f32(weights[i]);
        } else if SHAPE == WITHIN {
            w[i] = T::from_f32(if d[i].magnitude() <= reach { weights[i] } else { 0.0 });
        } else if SHAPE == MARGINALS {
            w[i] = T::from_f32(weights[i] * table.weight[cell((dd * inverse).to_f32().sqrt())]);
        } else {
            let t = one - dd * inverse;
            let t = if t > zero { t } else { zero };
            let t = t * t;
            let t = t * t;
            w[i] = T::from_f32(weights[i]) * (t * t);
        }
        count += u32::from(w[i] > zero);
        wx[i] = w[i] * x[i];
        wy[i] = w[i] * y[i];
        wd[i] = w[i] * d[i];
    }
    let [d, w, wx, wy, wd] = [&d[..n], &w[..n], &wx[..n], &wy[..n], &wd[..n]];
    total.count += count as usize;
    total.sums[0] += sum(w);
    total.sums[1] += dot(wx, x);
    total.sums[2] += dot(wx, y);
    total.sums[3] += dot(wy, y);
    total.sums[4] += dot(wx, d);
    total.sums[5] += dot(wy, d);
    total.sums[6] += dot(wd, d);
}

/// One block: the gain of each residual, then their sum.
#[inline(always)]
fn gain_body<T: Real>([x, y, z]: [&[T]; 3], [h0, h1, h2]: [T; 3], gain: impl Fn(T) -> f32) -> f64 {
    let mut gains = [0.0f32; BLOCK];
    let n = x.len().min(BLOCK);
    let (x, y, z, gains) = (&x[..n], &y[..n], &z[..n], &mut gains[..n]);
    for i in 0..n {
        gains[i] = gain(x[i] * h0 + y[i] * h1 + z[i] * h2);
    }
    sum(gains)
}

/// The sum of `a`, in [`LANES`] partial sums that are then added up in double precision.
#[inline(always)]
fn sum<T: Real>(a: &[T]) -> f64 {
    let mut lanes = [T::default(); LANES];
    let (whole, rest) = a.as_chunks::<LANES>();
    for a in whole {
        for i in 0..LANES {
            lanes[i] = lanes[i] + a[i];
        }
    }
    finish(lanes, rest.iter().copied())
}

/// The sum of `a b`.
#[inline(always)]
fn dot<T: Real>(a: &[T], b: &[T]) -> f64 {
    let mut lanes = [T::default(); LANES];
    let ((whole_a, rest_a), (whole_b, rest_b)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in whole_a.iter().zip(whole_b) {
        for i in 0..LANES {
            lanes[i] = lanes[i] + a[i] * b[i];
        }
    }
    finish(lanes, rest_a.iter().zip(rest_b).map(|(a, b)| *a * *b))
}

#[inline(always)]
fn finish<T: Real>(mut lanes: [T; LANES], rest: impl Iterator<Item = T>) -> f64 {
    for (lane, term) in lanes.iter_mut().zip(rest) {
        *lane = *lane + term;
    }
    lanes.iter().map(|lane| lane.to_f64()).sum()
}

/// Implements [`Real`] for one float type, with run-time dispatch to the machine's widest vectors.
macro_rules! real {
    ($float:ty, $module:ident, $block:expr, $count:path, $gather:path) => {
        mod $module {
            use super::*;

            #[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
            pub(super) fn gather(
                rows: [&[$float]; 3],
                weights: &mut [f32],
                model: [$float; 3],
                gains: ($float, $float),
                shape: Shape,
                _ones: bool,
                total: &mut Total,
            ) {
                match shape {
                    Shape::Hard | Shape::Rejected => gather_body::<$float, HARD>(rows, weights, model, gains, total),
                    Shape::Within => gather_body::<$float, WITHIN>(rows, weights, model, gains, total),
                    Shape::Marginal => gather_body::<$float, MARGINALS>(rows, weights, model, gains, total),
                    Shape::Soft => gather_body::<$float, SOFT>(rows, weights, model, gains, total),
                    Shape::Open => gather_body::<$float, OPEN>(rows, weights, model, gains, total),
                }
            }

            #[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
            pub(super) fn gain(
                rows: [&[$float]; 3],
                model: [$float; 3],
                inverse: $float,
                marginal: Option<&[f32; DEGREE + 1]>,
            ) -> f64 {
                match marginal {
                    Some(marginal) => gain_body(rows, model, |d| marginal_gain(marginal, (d * inverse).abs() as f32)),
                    None => gain_body(rows, model, |d| (1.0 - (d * inverse) * (d * inverse)).max(0.0) as f32),
                }
            }
        }

        impl Real for $float {
            const BLOCK: usize = $block;
            const TRIMS: bool = $block == LONG;

            fn from_f64(value: f64) -> Self {
                value as Self
            }
            fn from_f32(value: f32) -> Self {
                Self::from(value)
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            fn magnitude(self) -> Self {
                self.abs()
            }
            fn reach(threshold: f64) -> Self {
                let limit = (threshold * threshold) as Self;
                // Near the root of the number half-way to the next; a few steps mend what is rounded.
                let mut reach = (0.5 * (f64::from(limit) + f64::from(limit.next_up()))).sqrt() as Self;
                for _ in 0..4 {
                    reach = if reach * reach > limit { reach.next_down() } else { reach };
                }
                for _ in 0..4 {
                    let next = reach.next_up();
                    reach = if next * next <= limit { next } else { reach };
                }
                reach
            }
            fn count(rows: [&[Self]; 3], model: [Self; 3], reach: Self) -> usize {
                $count(rows, model, reach)
            }
            fn gather(
                rows: [&[Self]; 3],
                weights: &mut [f32],
                model: [Self; 3],
                gains: (Self, Self),
                shape: Shape,
                ones: bool,
                total: &mut Total,
            ) {
                $gather(rows, weights, model, gains, shape, ones, total);
            }
            fn gain(rows: [&[Self]; 3], model: [Self; 3], inverse: Self, marginal: Option<&[f32; DEGREE + 1]>) -> f64 {
                $module::gain(rows, model, inverse, marginal)
            }
            fn to_f32(self) -> f32 {
                self as f32
            }
        }
    };
}

real!(f32, single, LONG, lanes::count, gather_single);
real!(f64, double, BLOCK, count_double, double::gather);

#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn count_double([x, y, z]: [&[f64]; 3], [h0, h1, h2]: [f64; 3], reach: f64) -> usize {
    let within = |((x, y), z): ((&f64, &f64), &f64)| {
        let d = x * h0 + y * h1 + z * h2;
        u32::from(d.abs() <= reach)
    };
    x.iter().zip(y).zip(z).map(within).sum::<u32>() as usize
}

/// [`BLOCK`] of sums in lanes.
const LONG: usize = 2048;

/// The kernel of a gate: by lanes, but for the table.
fn gather_single(
    rows: [&[f32]; 3],
    weights: &mut [f32],
    model: [f32; 3],
    gains: (f32, f32),
    shape: Shape,
    ones: bool,
    total: &mut Total,
) {
    let gate = match shape {
        Shape::Hard => HARD,
        Shape::Within => WITHIN,
        Shape::Soft => SOFT,
        Shape::Rejected => REJECTED,
        Shape::Open => OPEN,
        Shape::Marginal => return single::gather(rows, weights, model, gains, shape, ones, total),
    };
    let gate = if ones && matches!(gate, HARD | REJECTED | OPEN) { ONES + gate } else { gate };
    lanes::gather(rows, weights, model, [gains.0, gains.1], gate, total);
}
