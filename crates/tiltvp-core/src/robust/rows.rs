//! Observations that are linear in the model: rows `(x, y, z)` with residual `x h0 + y h1 + z h2`, and their one-pass kernels.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::aligned::Aligned;
use super::loss::{Gate, Shape};
use super::marginal::MARGINAL;
use super::real::{BLOCK, Real};
use super::sampling::Score;
use super::total::Total;

/// Rows in structure-of-arrays form, in single precision for pixels or double for the user's own numbers.
#[derive(Debug, Clone, Default)]
pub struct Rows<T> {
    /// Columns `x`, `y`, `z`, each longer than the number of rows in use.
    columns: [Aligned<T>; 3],
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
    /// The weight when they were last added up row by row.
    whole: f64,
    sums: [f64; 6],
    /// The model `(h0, h1, h2)` at which the moments were taken.
    at: [f64; 3],
}

impl<T: Real> Rows<T> {
    /// No rows, with room for `capacity` of them.
    pub fn with_capacity(capacity: usize) -> Self {
        let column = || Aligned::zeros(capacity);
        Self { columns: [column(), column(), column()], len: 0 }
    }

    /// Removes all rows and keeps the memory.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends a row.
    pub fn push(&mut self, x: T, y: T, z: T) {
        let room = if self.columns[0].len() > self.len { 0 } else { 2 * self.len + 1 };
        for (column, value) in self.columns.iter_mut().zip([x, y, z]) {
            column.grow(room);
            column.as_mut_slice()[self.len] = value;
        }
        self.len += 1;
    }

    /// Appends every `stride`-th row of another set.
    pub fn extend(&mut self, other: &Self, stride: usize) {
        let (first, stride) = (self.len, stride.max(1));
        let end = first + other.len.div_ceil(stride);
        for (own, column) in self.columns.iter_mut().zip(other.columns()) {
            own.grow(end);
            for (place, from) in own.as_mut_slice()[first..end].iter_mut().zip((0..column.len()).step_by(stride)) {
                *place = column[from];
            }
        }
        self.len = end;
    }

    /// Replaces all rows: `write` fills the columns, which have room for `capacity` rows, and returns how many it wrote.
    pub fn refill(&mut self, capacity: usize, write: impl FnOnce([&mut [T]; 3]) -> usize) {
        self.columns.iter_mut().for_each(|column| column.grow(capacity));
        self.len = write(self.columns.each_mut().map(Aligned::as_mut_slice)).min(capacity);
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

    pub(super) fn columns(&self) -> [&[T]; 3] {
        self.columns.each_ref().map(|column| &column.as_slice()[..self.len])
    }

    /// How many rows have a residual of at most `threshold`.
    pub fn count_within(&self, model: [f64; 3], threshold: f64) -> usize {
        self.count_to_beat(model, threshold, 0)
    }

    /// [`count_within`](Self::count_within) that stops as soon as it cannot exceed `to_beat`, with some count up to that.
    pub fn count_to_beat(&self, model: [f64; 3], threshold: f64, to_beat: usize) -> usize {
        let (model, reach) = (model.map(T::from_f64), T::reach(threshold));
        let mut count = 0;
        for start in (0..self.len).step_by(COUNTED) {
            let end = (start + COUNTED).min(self.len);
            count += T::count(self.columns().map(|column| &column[start..end]), model, reach);
            if count + (self.len - end) <= to_beat {
                break;
            }
        }
        count
    }

    /// [`count_to_beat`](Self::count_to_beat) of several models at once, of none where there is none: rows come from further
    /// caches once for all.
    pub fn count_each_to_beat(
        &self,
        models: &(impl Iterator<Item = Option<[f64; 3]>> + Clone),
        threshold: f64,
        to_beat: usize,
        counts: &mut [usize],
    ) {
        let reach = T::reach(threshold);
        counts.fill(0);
        for start in (0..self.len).step_by(COUNTED) {
            let end = (start + COUNTED).min(self.len);
            let rows = self.columns().map(|column| &column[start..end]);
            for (model, count) in models.clone().zip(&mut *counts) {
                if let Some(model) = model.filter(|_| *count + (self.len - start) > to_beat) {
                    *count += T::count(rows, model.map(T::from_f64), reach);
                }
            }
        }
    }

    /// How many of the listed rows have a residual of at most `threshold`.
    pub fn count_among(&self, rows: &[u32], model: [f64; 3], threshold: f64) -> usize {
        let ([h0, h1, h2], reach) = (model.map(T::from_f64), T::reach(threshold));
        let [x, y, z] = self.columns();
        let within = |row: &u32| {
            let place = *row as usize;
            let (Some(x), Some(y), Some(z)) = (x.get(place), y.get(place), z.get(place)) else { return 0 };
            let d = *x * h0 + *y * h1 + *z * h2;
            usize::from(d.magnitude() <= reach)
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
        T::count(row, model.map(T::from_f64), T::reach(threshold)) == 1
    }

    /// Applies a gate about a model to the weights and takes the moments of what is left.
    pub fn moments(&self, model: [f64; 3], gate: Gate, weights: &mut [f32]) -> Moments {
        self.moments_of(model, gate, false, weights)
    }

    /// [`moments`](Self::moments) where all weights are ones and zeros, which takes less time.
    pub fn moments_of_ones(&self, model: [f64; 3], gate: Gate, weights: &mut [f32]) -> Moments {
        self.moments_of(model, gate, true, weights)
    }

    fn moments_of(&self, model: [f64; 3], gate: Gate, ones: bool, weights: &mut [f32]) -> Moments {
        let total = self.total(model, gate, (gate.shape(), ones), weights);
        Moments {
            count: total.count,
            weight: total.sums[0],
            whole: total.sums[0],
            sums: std::array::from_fn(|i| total.sums[i + 1]),
            at: model,
        }
    }

    fn total(&self, model: [f64; 3], gate: Gate, (shape, ones): (Shape, bool), weights: &mut [f32]) -> Total {
        let (limit, inverse) = gate.coefficients();
        let gains = (T::reach(limit), T::from_f64(inverse));
        let mut total = Total::default();
        let n = self.len().min(weights.len());
        let block = if shape == Shape::Marginal { BLOCK } else { T::BLOCK };
        for start in (0..n).step_by(block) {
            let part = start..(start + block).min(n);
            let rows = self.columns().map(|column| &column[part.clone()]);
            T::gather(rows, &mut weights[part], model.map(T::from_f64), gains, shape, ones, &mut total);
        }
        total
    }
}

impl<T: Real> Rows<T> {
    /// The moments after a hard gate about a model, given those before it: of the rows whose weights it sets to zero, their
    /// moments are taken away. That takes less time than to add up the others, which happens where little would be left.
    pub fn trim(&self, before: &Moments, model: [f64; 3], threshold: f64, weights: &mut [f32]) -> Moments {
        self.trim_of(before, (model, threshold), false, weights)
    }

    /// [`trim`](Self::trim) where all weights are ones and zeros, which takes less time.
    pub fn trim_ones(&self, before: &Moments, model: [f64; 3], threshold: f64, weights: &mut [f32]) -> Moments {
        self.trim_of(before, (model, threshold), true, weights)
    }

    fn trim_of(
        &self,
        before: &Moments,
        (model, threshold): ([f64; 3], f64),
        ones: bool,
        weights: &mut [f32],
    ) -> Moments {
        let gate = Gate::Hard { threshold };
        let Some(mut moments) = before.about(model).filter(|_| T::TRIMS) else {
            return self.moments_of(model, gate, ones, weights);
        };
        let gone = self.total(model, gate, (Shape::Rejected, ones), weights);
        moments.count -= gone.count.min(moments.count);
        moments.weight -= gone.sums[0];
        for (sum, gone) in moments.sums.iter_mut().zip(&gone.sums[1..]) {
            *sum -= gone;
        }
        if moments.weight < LEFT * moments.whole {
            return self.moments_of(model, gate, ones, weights);
        }
        moments
    }
}

/// Share of the weight below which moments are added up anew, so that what was rounded off the others does not show.
const LEFT: f64 = 0.2;

impl Moments {
    /// The same moments with the residuals of another model; `None` if `h2` is zero.
    fn about(&self, model: [f64; 3]) -> Option<Self> {
        let ([xx, xy, yy, xd, yd, dd], [h0, h1, h2]) = (self.sums, self.at);
        // d' = a x + b y + k d.
        let k = model[2] / h2;
        let (a, b) = (model[0] - k * h0, model[1] - k * h1);
        let sums = [
            xx,
            xy,
            yy,
            a * xx + b * xy + k * xd,
            a * xy + b * yy + k * yd,
            a * (a * xx + 2.0 * (b * xy + k * xd)) + b * (b * yy + 2.0 * k * yd) + k * k * dd,
        ];
        k.is_finite().then_some(Self { sums, at: model, ..*self })
    }

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
const COUNTED: usize = 1024;

#[cfg(test)]
mod tests {
    use super::super::vectors::LANES;
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
            if let Gate::Hard { threshold } = gate {
                let within = rows.iter().filter(|row| gate.weight(row.dot(&Vector3::from(model))) > 0.0).count();
                assert_eq!(rows.count_within(model, threshold), within, "{len} rows");
                let other = [0.3, 0.1, 0.8];
                for to_beat in [0, within / 2, len] {
                    let mut counts = [7; 3];
                    rows.count_each_to_beat(
                        &[model, other, model].into_iter().map(Some),
                        threshold,
                        to_beat,
                        &mut counts,
                    );
                    for (count, model) in counts.iter().zip([model, other, model]) {
                        let alone = rows.count_to_beat(model, threshold, 0);
                        assert!(*count == alone || (*count <= to_beat && alone <= to_beat), "{len} rows");
                    }
                }
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

    /// Trimming step by step, to ever less, is gating at once.
    #[test]
    fn trimmed_moments_are_those_of_what_is_left() {
        let mut rows = Rows::<f32>::default();
        for i in 0..5000 {
            let t = 0.37 * f64::from(i);
            rows.push(t.cos() as f32, t.sin() as f32, (20.0 * (3.1 * t).sin()) as f32);
        }
        let own: Vec<f32> = (0..5000).map(|i| (i % 5) as f32).collect();
        let mut weights = own.clone();
        let mut trimmed = rows.moments([0.0, 0.0, 1.0], Gate::Open, &mut weights);
        for (i, threshold) in [30.0, 15.0, 14.0, 9.0, 3.0, 0.5, 0.4].into_iter().enumerate() {
            let model = [0.1 * i as f64, -0.2 * i as f64, 1.0];
            trimmed = rows.trim(&trimmed, model, threshold, &mut weights);
            let mut left = weights.clone();
            let whole = rows.moments(model, Gate::Hard { threshold }, &mut left);
            assert_eq!((trimmed.count, &left), (whole.count, &weights));
            assert_relative_eq!(trimmed.weight, whole.weight, max_relative = 1e-5);
            let (a, b) = (trimmed.step().unwrap(), whole.step().unwrap());
            assert!((a - b).norm() < 1e-3 && a.norm() > 1e-3, "{a} {b}");
            assert_relative_eq!(trimmed.sum_of_squares(&a), whole.sum_of_squares(&b), max_relative = 1e-4);
        }
        assert!(trimmed.count > 10 && trimmed.count < 200, "{}", trimmed.count);
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
