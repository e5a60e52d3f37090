//! Observations that are linear in the model: rows `(x, y, z)` with residual `x h0 + y h1 + z h2`, and their one-pass kernels.

use multiversion::multiversion;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::loss::{Gate, Shape};
use super::sampling::Score;
use super::score::{DEGREE, MARGINAL, cell, marginal_gain};

/// Rows in structure-of-arrays form, in single precision for pixels or double for the user's own numbers.
#[derive(Debug, Clone, Default)]
pub struct Rows<T> {
    /// Columns `x`, `y`, `z`, each longer than the number of rows in use.
    columns: [Vec<T>; 3],
    len: usize,
}

/// Weighted moments of `(x, y, d)`, where `d` is the residual of the model at which they were taken.
///
/// Because `d` is small, nothing cancels when a nearby model is fitted or its residuals are summed, even in single precision.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    /// Rows with a weight above zero.
    pub count: usize,
    /// Sum of the weights.
    pub weight: f64,
    sums: [f64; 6],
    /// The model `(h0, h1, h2)` at which the moments were taken.
    at: [f64; 3],
}

impl<T: Real> Rows<T> {
    /// No rows, with room for `capacity` of them.
    pub fn with_capacity(capacity: usize) -> Self {
        let column = || vec![T::default(); capacity];
        Self { columns: [column(), column(), column()], len: 0 }
    }

    /// Removes all rows and keeps the memory.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends a row.
    pub fn push(&mut self, x: T, y: T, z: T) {
        for (column, value) in self.columns.iter_mut().zip([x, y, z]) {
            match column.get_mut(self.len) {
                Some(place) => *place = value,
                None => column.push(value),
            }
        }
        self.len += 1;
    }

    /// Appends every `stride`-th row of another set.
    pub fn extend(&mut self, other: &Self, stride: usize) {
        let [x, y, z] = other.columns();
        for ((x, y), z) in x.iter().zip(y).zip(z).step_by(stride.max(1)) {
            self.push(*x, *y, *z);
        }
    }

    /// Replaces all rows: `write` fills the columns, which have room for `capacity` rows, and returns how many it wrote.
    pub fn refill(&mut self, capacity: usize, write: impl FnOnce([&mut [T]; 3]) -> usize) {
        for column in &mut self.columns {
            if column.len() < capacity {
                column.resize(capacity, T::default());
            }
        }
        self.len = write(self.columns.each_mut().map(Vec::as_mut_slice)).min(capacity);
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Row `index` in double precision.
    pub fn get(&self, index: usize) -> Option<Vector3<f64>> {
        let [x, y, z] = self.columns();
        Some(Vector3::new(x.get(index)?.to_f64(), y.get(index)?.to_f64(), z.get(index)?.to_f64()))
    }

    /// All rows in double precision.
    pub fn iter(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let [x, y, z] = self.columns();
        x.iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(x.to_f64(), y.to_f64(), z.to_f64()))
    }

    fn columns(&self) -> [&[T]; 3] {
        self.columns.each_ref().map(|column| &column[..self.len])
    }

    /// How many rows have a residual of at most `threshold`.
    pub fn count_within(&self, model: [f64; 3], threshold: f64) -> usize {
        self.count_to_beat(model, threshold, 0)
    }

    /// [`count_within`](Self::count_within) that stops as soon as it cannot exceed `to_beat`, with some count up to that.
    pub fn count_to_beat(&self, model: [f64; 3], threshold: f64, to_beat: usize) -> usize {
        let (model, limit) = (model.map(T::from_f64), T::from_f64(threshold * threshold));
        let mut count = 0;
        for start in (0..self.len).step_by(COUNTED) {
            let end = (start + COUNTED).min(self.len);
            count += T::count(self.columns().map(|column| &column[start..end]), model, limit);
            if count + (self.len - end) <= to_beat {
                break;
            }
        }
        count
    }

    /// How many of the listed rows have a residual of at most `threshold`.
    pub fn count_among(&self, rows: &[u32], model: [f64; 3], threshold: f64) -> usize {
        let ([h0, h1, h2], limit) = (model.map(T::from_f64), T::from_f64(threshold * threshold));
        let [x, y, z] = self.columns();
        let within = |row: &u32| {
            let place = *row as usize;
            let (Some(x), Some(y), Some(z)) = (x.get(place), y.get(place), z.get(place)) else { return 0 };
            let d = *x * h0 + *y * h1 + *z * h2;
            usize::from(d * d <= limit)
        };
        rows.iter().map(within).sum()
    }

    /// The sum of [`Score::gain`] over all rows, or some number up to `to_beat` where it cannot exceed that.
    pub fn support(&self, model: [f64; 3], threshold: f64, score: Score, to_beat: f64) -> f64 {
        if score == Score::Count {
            return self.count_to_beat(model, threshold, to_beat as usize) as f64;
        }
        let marginal = matches!(score, Score::Magsac { .. }).then(|| &MARGINAL.gain);
        let (model, inverse) = (model.map(T::from_f64), T::from_f64(1.0 / threshold));
        let mut total = 0.0;
        for start in (0..self.len).step_by(BLOCK) {
            let end = (start + BLOCK).min(self.len);
            total += T::gain(self.columns().map(|column| &column[start..end]), model, inverse, marginal);
            // No row gains more than one.
            if total + (self.len - end) as f64 <= to_beat {
                break;
            }
        }
        total
    }

    /// Whether row `index` has a residual of at most `threshold`, in the arithmetic of [`count_within`](Self::count_within).
    pub fn is_within(&self, index: usize, model: [f64; 3], threshold: f64) -> bool {
        let row = self.columns().map(|column| column.get(index..=index).unwrap_or(&[]));
        T::count(row, model.map(T::from_f64), T::from_f64(threshold * threshold)) == 1
    }

    /// Calls `visit(row, [weight, slope, x, y, residual])` for every `stride`-th row whose weight (one where none are given),
    /// multiplied by the gate about a model, is above zero; `slope` is the weight multiplied by [`Gate::slope`].
    pub fn for_each_gated(
        &self,
        model: [f64; 3],
        gate: Gate,
        weights: Option<&[f32]>,
        stride: usize,
        mut visit: impl FnMut(usize, [f64; 5]),
    ) {
        let [x, y, z] = self.columns();
        let (limit, inverse) = gate.coefficients();
        let tabulated = gate.shape() == Shape::Marginal;
        for row in (0..self.len).step_by(stride.max(1)) {
            let (x, y, z) = (x[row].to_f64(), y[row].to_f64(), z[row].to_f64());
            let d = x * model[0] + y * model[1] + z * model[2];
            let own = weights.map_or(1.0, |weights| weights.get(row).copied().map_or(0.0, f64::from));
            let t = 1.0 - d * d * inverse;
            if own > 0.0 && t > 0.0 && d * d <= limit {
                if tabulated {
                    visit(row, [own * gate.weight(d), own * gate.slope(d), x, y, d]);
                    continue;
                }
                let t2 = t * t;
                let t4 = t2 * t2;
                visit(row, [own * (t4 * t4), own * (t4 * t2 * t) * (17.0 * t - 16.0), x, y, d]);
            }
        }
    }

    /// Applies a gate about a model to the weights and takes the moments of what is left.
    pub fn moments(&self, model: [f64; 3], gate: Gate, weights: &mut [f32]) -> Moments {
        let (limit, inverse) = gate.coefficients();
        let gains = (T::from_f64(limit), T::from_f64(inverse));
        let mut total = Total::default();
        let n = self.len().min(weights.len());
        for start in (0..n).step_by(BLOCK) {
            let part = start..(start + BLOCK).min(n);
            let rows = self.columns().map(|column| &column[part.clone()]);
            T::gather(rows, &mut weights[part], model.map(T::from_f64), gains, gate.shape(), &mut total);
        }
        Moments {
            count: total.count,
            weight: total.sums[0],
            sums: std::array::from_fn(|i| total.sums[i + 1]),
            at: model,
        }
    }
}

impl Moments {
    /// The change `(dh0, dh1)` of the model that minimises the weighted sum of squares, `h2` held; `None` if undetermined.
    pub fn step(&self) -> Option<Vector2<f64>> {
        let [xx, xy, yy, xd, yd, _] = self.sums;
        let (determinant, trace) = (xx * yy - xy * xy, xx + yy);
        let determined = determinant > 1e-12 * trace * trace;
        determined.then(|| Vector2::new(xy * yd - yy * xd, xy * xd - xx * yd) / determinant)
    }

    /// The model at which the moments were taken.
    pub fn model(&self) -> [f64; 3] {
        self.at
    }

    /// Sum of the weighted squared residuals of the model `(h0 + dh0, h1 + dh1, h2)`.
    pub fn sum_of_squares(&self, step: &Vector2<f64>) -> f64 {
        let [xx, xy, yy, xd, yd, dd] = self.sums;
        let (a, b) = (step.x, step.y);
        (dd + 2.0 * (a * xd + b * yd) + a * a * xx + 2.0 * a * b * xy + b * b * yy).max(0.0)
    }

    /// The information `sum w (x, y)^T (x, y)` about `(h0, h1)`.
    pub fn information(&self) -> Matrix2<f64> {
        let [xx, xy, yy, ..] = self.sums;
        Matrix2::new(xx, xy, xy, yy)
    }

    /// The moments of the rows themselves, `sum w (x, y, z)^T (x, y, z)`; needs `h2 != 0`.
    pub fn second_moments(&self) -> Matrix3<f64> {
        // z = (d - h0 x - h1 y) / h2, a linear map of (x, y, d).
        let [xx, xy, yy, xd, yd, dd] = self.sums;
        let [h0, h1, h2] = self.at;
        let map = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -h0 / h2, -h1 / h2, 1.0 / h2);
        map * Matrix3::new(xx, xy, xd, xy, yy, yd, xd, yd, dd) * map.transpose()
    }
}

/// Rows that are counted before looking whether the count can still matter.
const COUNTED: usize = 2048;

/// Rows added up in the rows' own precision before they are added in double precision.
const BLOCK: usize = 512;

/// Independent sums that are added up side by side, in the same order on every machine.
const LANES: usize = 16;

/// The shapes of gates as the kernels' parameters.
const HARD: u8 = 0;
const WITHIN: u8 = 1;
const MARGINALS: u8 = 2;
const SOFT: u8 = 3;

/// Totals in double precision: weight, then the six moments.
#[derive(Default)]
pub struct Total {
    count: usize,
    sums: [f64; 7],
}

/// The arithmetic that rows are stored in: `f32` or `f64`.
pub trait Real:
    Copy + Default + PartialOrd + std::ops::Add<Output = Self> + std::ops::Sub<Output = Self> + std::ops::Mul<Output = Self>
{
    /// Rounds from double precision.
    fn from_f64(value: f64) -> Self;
    /// Widens a weight.
    fn from_f32(value: f32) -> Self;
    /// Widens to double precision.
    fn to_f64(self) -> f64;
    /// Rounds to single precision.
    fn to_f32(self) -> f32;
    #[doc(hidden)]
    fn count(rows: [&[Self]; 3], model: [Self; 3], limit: Self) -> usize;
    #[doc(hidden)]
    fn gather(
        rows: [&[Self]; 3],
        weights: &mut [f32],
        model: [Self; 3],
        gains: (Self, Self),
        shape: Shape,
        total: &mut Total,
    );
    #[doc(hidden)]
    fn gain(rows: [&[Self]; 3], model: [Self; 3], inverse: Self, marginal: Option<&[f32; DEGREE + 1]>) -> f64;
}

#[inline(always)]
fn count_body<T: Real>([x, y, z]: [&[T]; 3], [h0, h1, h2]: [T; 3], limit: T) -> usize {
    let within = |((x, y), z): ((&T, &T), &T)| {
        let d = *x * h0 + *y * h1 + *z * h2;
        u32::from(d * d <= limit)
    };
    x.iter().zip(y).zip(z).map(within).sum::<u32>() as usize
}

/// One block: residuals and gated weights first, then each sum in lanes of its own, all of it in the first-level cache.
#[inline(always)]
fn gather_body<T: Real, const SHAPE: u8>(
    [x, y, z]: [&[T]; 3],
    weights: &mut [f32],
    [h0, h1, h2]: [T; 3],
    (limit, inverse): (T, T),
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
        if SHAPE == HARD {
            weights[i] = if dd <= limit { weights[i] } else { 0.0 };
            w[i] = T::from_f32(weights[i]);
        } else if SHAPE == WITHIN {
            w[i] = T::from_f32(if dd <= limit { weights[i] } else { 0.0 });
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
    ($float:ty, $module:ident) => {
        mod $module {
            use super::*;

            #[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
            pub(super) fn count(rows: [&[$float]; 3], model: [$float; 3], limit: $float) -> usize {
                count_body(rows, model, limit)
            }

            #[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
            pub(super) fn gather(
                rows: [&[$float]; 3],
                weights: &mut [f32],
                model: [$float; 3],
                gains: ($float, $float),
                shape: Shape,
                total: &mut Total,
            ) {
                match shape {
                    Shape::Hard => gather_body::<$float, HARD>(rows, weights, model, gains, total),
                    Shape::Within => gather_body::<$float, WITHIN>(rows, weights, model, gains, total),
                    Shape::Marginal => gather_body::<$float, MARGINALS>(rows, weights, model, gains, total),
                    Shape::Soft => gather_body::<$float, SOFT>(rows, weights, model, gains, total),
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
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            fn from_f32(value: f32) -> Self {
                Self::from(value)
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            fn count(rows: [&[Self]; 3], model: [Self; 3], limit: Self) -> usize {
                $module::count(rows, model, limit)
            }
            fn gather(
                rows: [&[Self]; 3],
                weights: &mut [f32],
                model: [Self; 3],
                gains: (Self, Self),
                shape: Shape,
                total: &mut Total,
            ) {
                $module::gather(rows, weights, model, gains, shape, total);
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

real!(f32, single);
real!(f64, double);

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn rows() -> Rows<f64> {
        let mut rows = Rows::with_capacity(100);
        for i in 0..101 {
            let t = f64::from(i) * 0.37;
            rows.push(t.cos(), t.sin(), 0.01 * (3.0 * t).sin());
        }
        rows
    }

    #[test]
    fn moments_equal_plain_sums() {
        let rows = rows();
        let model = [0.1, -0.2, 0.9];
        let mut weights = vec![0.5f32; rows.len()];
        let moments = rows.moments(model, Gate::Open, &mut weights);
        let plain = rows.iter().map(|r| 0.5 * r * r.transpose()).sum::<Matrix3<f64>>();
        assert_relative_eq!(moments.second_moments(), plain, epsilon = 1e-12);
        assert_eq!(moments.count, rows.len());
        let step = moments.step().unwrap();
        let at = |s: Vector2<f64>| {
            rows.iter().map(|r| 0.5 * r.dot(&Vector3::new(0.1 + s.x, -0.2 + s.y, 0.9)).powi(2)).sum::<f64>()
        };
        assert_relative_eq!(moments.sum_of_squares(&step), at(step), epsilon = 1e-12);
        assert!(at(step) < at(step + Vector2::new(1e-4, 0.0)) && at(step) < at(step - Vector2::new(0.0, 1e-4)));
    }

    /// Numbers of rows about multiples of the lanes and of the blocks, in both precisions, through every gate.
    #[test]
    fn any_number_of_rows_is_summed_once() {
        fn check<T: Real>(len: usize, gate: Gate, tolerance: f64) {
            // The weights of a table jump, by less than this from its second cell on.
            let tolerance = if matches!(gate, Gate::Marginal { .. }) { tolerance.max(2e-3) } else { tolerance };
            let mut rows = Rows::<T>::default();
            for i in 0..len {
                let t = 0.37 * i as f64;
                rows.push(T::from_f64(t.cos()), T::from_f64(t.sin()), T::from_f64(0.1 * (3.1 * t).sin()));
            }
            let model = [0.02, -0.03, 0.9];
            let mut weights: Vec<f32> = (0..len).map(|i| (i % 5) as f32).collect();
            let before = weights.clone();
            let found = rows.moments(model, gate, &mut weights);
            let (mut count, mut weight, mut sum) = (0, 0.0, Matrix3::zeros());
            for ((row, own), after) in rows.iter().zip(&before).zip(&weights) {
                let gated = gate.weight(row.dot(&Vector3::from(model)));
                let w = f64::from(*own) * gated;
                count += usize::from(w > 0.0);
                weight += w;
                sum += w * row * row.transpose();
                assert_eq!(*after, if matches!(gate, Gate::Hard { .. }) && gated == 0.0 { 0.0 } else { *own });
            }
            let scale = 1.0 + len as f64;
            assert_eq!(found.count, count, "{len} rows, {gate:?}");
            assert!((found.weight - weight).abs() < tolerance * scale, "{len} rows, {gate:?}");
            assert!((found.second_moments() - sum).norm() < tolerance * scale, "{len} rows, {gate:?}");
            let mut visited = 0;
            rows.for_each_gated(model, gate, Some(&before), 1, |i, [weight, slope, x, y, d]| {
                let row = rows.get(i).unwrap();
                let own = f64::from(before[i]);
                assert_eq!((x, y, d), (row.x, row.y, row.x * model[0] + row.y * model[1] + row.z * model[2]));
                assert!((weight - own * gate.weight(d)).abs() < 1e-9 && (slope - own * gate.slope(d)).abs() < 1e-9);
                visited += 1;
            });
            assert_eq!(visited, count, "{len} rows, {gate:?}");
            if let Gate::Hard { threshold } = gate {
                let within = rows.iter().filter(|row| gate.weight(row.dot(&Vector3::from(model))) > 0.0).count();
                assert_eq!(rows.count_within(model, threshold), within, "{len} rows");
                assert_eq!((0..len + 3).filter(|i| rows.is_within(*i, model, threshold)).count(), within);
            }
        }
        for len in (0..=35).chain(500..530).chain([1023, 1024, 1025, 2 * BLOCK + LANES + 1]) {
            for gate in [
                Gate::Open,
                Gate::Hard { threshold: 0.05 },
                Gate::Within { threshold: 0.05 },
                Gate::Marginal { threshold: 0.1 },
                Gate::Soft { scale: 0.02 },
            ] {
                check::<f64>(len, gate, 1e-12);
                check::<f32>(len, gate, 1e-5);
            }
        }
    }

    #[test]
    fn hard_gate_rejects_for_good_and_agrees_with_the_count() {
        let rows = rows();
        let mut weights = vec![1.0f32; rows.len()];
        let kept = rows.moments([0.0, 0.0, 1.0], Gate::Hard { threshold: 0.005 }, &mut weights).count;
        assert_eq!(kept, rows.count_within([0.0, 0.0, 1.0], 0.005));
        assert!(kept > 0 && kept < rows.len());
        assert_eq!(rows.moments([0.0, 0.0, 1.0], Gate::Open, &mut weights).count, kept);
    }
}
