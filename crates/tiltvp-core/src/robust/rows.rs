//! Observations that are linear in the model: rows `(x, y, z)` with residual `x h0 + y h1 + z h2`, counted and added up.

use nalgebra::Vector3;
use tiltvp_kernels::aligned::Aligned;
use tiltvp_kernels::rows::{self, ConsensusBound, GAINS, GroupSums, Real, Sums, Weights, sums_by_group};

use super::loss::{Gate, inverse_square};
use super::moments::Moments;
use super::sampling::Score;

/// Rows in structure-of-arrays form, in single precision for pixels or double for the user's own numbers.
#[derive(Debug, Clone, Default)]
pub struct Rows<T> {
    /// Columns `x`, `y`, `z`, each longer than the number of rows in use.
    columns: [Aligned<T>; 3],
    len: usize,
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

    /// Writes one row over another.
    pub fn put(&mut self, row: usize, over: usize) {
        self.columns.iter_mut().for_each(|column| column.as_mut_slice().copy_within(row..=row, over));
    }

    /// Keeps the first so many rows.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
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

    /// Fills the tables that bound the consensus of models for a threshold and an `h2` of at least some number above zero.
    pub(super) fn tabulate(&self, bound: &mut ConsensusBound, threshold: f64, h2_min: f64) {
        bound.tabulate(self.columns(), threshold, h2_min);
    }

    /// The sum of [`Score::gain`] over all rows, or some number up to `to_beat` where it cannot exceed that.
    pub fn support(&self, model: [f64; 3], threshold: f64, score: Score, to_beat: f64) -> f64 {
        if score == Score::Count {
            return self.count_to_beat(model, threshold, to_beat as usize) as f64;
        }
        let (model, inverse) = (model.map(T::from_f64), T::from_f64(1.0 / threshold));
        let mut total = 0.0;
        for start in (0..self.len).step_by(GAINS) {
            let end = (start + GAINS).min(self.len);
            total += T::gains(self.columns().map(|column| &column[start..end]), model, inverse);
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
        self.moments_of(model, gate, (weights, Weights::Any))
    }

    /// [`moments`](Self::moments) with weights of a kind.
    pub fn moments_of(&self, model: [f64; 3], gate: Gate, weights: (&mut [f32], Weights)) -> Moments {
        let Sums { count, sums: [weight, sums @ ..] } = self.sums(model, gate.of_rows(), weights);
        Moments { count, weight, whole: weight, sums, at: model }
    }

    fn sums(&self, model: [f64; 3], gate: rows::Gate<T>, (weights, kind): (&mut [f32], Weights)) -> Sums {
        let (mut sums, model) = (Sums::default(), model.map(T::from_f64));
        let n = self.len().min(weights.len());
        for start in (0..n).step_by(T::BLOCK) {
            let part = start..(start + T::BLOCK).min(n);
            let rows = self.columns().map(|column| &column[part.clone()]);
            T::accumulate(rows, (&mut weights[part], kind), model, gate, &mut sums);
        }
        sums
    }

    /// The moments after a hard gate about a model, given those before it: of the rows whose weights it sets to zero, their
    /// moments are taken away. That takes less time than to add up the others, which happens where little would be left.
    pub fn trim(
        &self,
        before: &Moments,
        model: [f64; 3],
        threshold: f64,
        (weights, kind): (&mut [f32], Weights),
    ) -> Moments {
        let gate = Gate::Hard { threshold };
        let Some(mut moments) = before.about(model).filter(|_| T::TRIMS) else {
            return self.moments_of(model, gate, (weights, kind));
        };
        let rejected = rows::Gate::Rejected { reach: T::reach(threshold) };
        let Sums { count, sums: [weight, sums @ ..] } = self.sums(model, rejected, (&mut *weights, kind));
        moments.count -= count.min(moments.count);
        moments.weight -= weight;
        for (sum, gone) in moments.sums.iter_mut().zip(sums) {
            *sum -= gone;
        }
        if moments.weight < LEFT * moments.whole {
            return self.moments_of(model, gate, (weights, kind));
        }
        moments
    }
}

impl Rows<f32> {
    /// Sums over every `stride`-th row, with a soft gate of this scale about a model. Weights are one where none are given. Row `i`
    /// is of the group `group_of[members[i]]`, the last one where there is none.
    pub fn sums_by_group(
        &self,
        model: [f64; 3],
        scale: f64,
        weights: Option<&[f32]>,
        stride: usize,
        groups: (&[u32], &[u8]),
    ) -> GroupSums {
        let inverse = inverse_square(scale) as f32;
        sums_by_group(self.columns(), (model.map(|h| h as f32), inverse), weights, stride, groups)
    }
}

/// Share of the weight below which moments are added up anew: sums of single precision are good to about 1e-6 of the whole, which is
/// 5e-6 of this share. `trimmed_moments_are_those_of_what_is_left` shows what is lost.
const LEFT: f64 = 0.2;

/// Rows that are counted before looking whether the count can still matter: 12 KB, which stay in the nearest cache for all models.
/// Only time depends on it.
const COUNTED: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{Matrix3, Vector2};

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

    /// Numbers of rows about multiples of sixteen and of the blocks, in both precisions, through every gate.
    #[test]
    fn any_number_of_rows_is_summed_once() {
        fn check<T: Real>(len: usize, gate: Gate, tolerance: f64) {
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
        for len in (0..=35).chain(500..530).chain([1023, 1024, 1025, 4096, 4113]) {
            for gate in [
                Gate::Open,
                Gate::Hard { threshold: 0.05 },
                Gate::Within { threshold: 0.05 },
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
            trimmed = rows.trim(&trimmed, model, threshold, (&mut weights, Weights::Any));
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
