//! The upper bound of the consensus of a model, without a look at every row: tables of the rows by direction and place.

use crate::vectorised;

use super::real::Real;

/// Directions that are told apart: half a turn has so many parts. With [`PLACES`] both tables take 512 KB, which a second-level cache
/// holds. Only time depends on either.
const DIRECTIONS: usize = 128;

/// Places along a direction that are told apart.
const PLACES: usize = 512;

/// Rows that are placed together: 5 KB with their cells.
const BLOCK: usize = 256;

/// Places beyond this many thresholds are not told apart: the finer ones are of about a fifth of a threshold. Only time depends on it.
const REACH: f32 = 48.0;

/// Relative allowance for what single precision rounds, here and where rows are counted one by one: over a hundred times the 6e-8 of
/// one operation.
const ROUNDED: f32 = 1e-5;

/// Tables of rows `(x, y, z)` for one threshold on `|x h0 + y h1 + z h2|`.
///
/// With `(x, y) = r (cos phi, sin phi)` a row agrees with a model of `h2 > 0` if the point
/// `p(phi) = -(h0 cos phi + h1 sin phi) / h2` lies in the interval of half the width `threshold / (r h2)` about `z / r`. Of the
/// intervals of all rows with nearly the same direction, those that hold a point are those that begin before it, less those
/// that end before it. Both numbers are kept for every part of half a turn and every place, so that a bound for all rows takes
/// two look-ups for each part: with the last place at which `p` can be within the part, and with the first.
#[derive(Debug, Clone, Default)]
pub struct ConsensusBound {
    /// For each direction and place, how many intervals begin there or before.
    begun: Vec<u32>,
    /// How many end before.
    ended: Vec<u32>,
    /// The first place, and places per unit.
    first: f32,
    per_unit: f32,
    /// Of models below this `h2` the tables tell nothing.
    h2_min: f64,
    /// Rows without a direction.
    always: usize,
    rows: usize,
    parts: Parts,
}

/// The middles of the parts of half a turn, and their widths.
#[derive(Debug, Clone, PartialEq)]
struct Parts {
    cos: [f32; DIRECTIONS],
    sin: [f32; DIRECTIONS],
    /// Half the width in radians, a little more than it is.
    half: [f32; DIRECTIONS],
}

impl Default for Parts {
    fn default() -> Self {
        // Parts are even in x / (|x| + y), which grows with the direction as its angle does.
        let angle = |i: usize| {
            let x = 1.0 - 2.0 * i as f64 / DIRECTIONS as f64;
            (1.0 - x.abs()).atan2(x)
        };
        let part = |i: usize| (0.5 * (angle(i) + angle(i + 1)), 0.5 * (angle(i + 1) - angle(i)));
        Self {
            cos: std::array::from_fn(|i| part(i).0.cos() as f32),
            sin: std::array::from_fn(|i| part(i).0.sin() as f32),
            half: std::array::from_fn(|i| part(i).1 as f32 + ROUNDED),
        }
    }
}

impl ConsensusBound {
    /// Makes room, so that [`tabulate`](Self::tabulate) allocates nothing.
    pub fn reserve(&mut self) {
        for table in [&mut self.begun, &mut self.ended] {
            table.clear();
            table.reserve(DIRECTIONS * PLACES);
        }
    }

    /// Whether the tables save time where so many models are still to be counted over so many rows. Times are in rows that are
    /// counted for one model; answers do not depend on them.
    pub fn pays(rows: usize, models: u32) -> bool {
        const BOUND: u64 = 3000;
        const TABLES: u64 = 400_000;
        const PLACING: u64 = 50;
        let rows = rows as u64;
        u64::from(models).saturating_mul(rows.saturating_sub(BOUND)) > 2 * (PLACING * rows + TABLES)
    }

    /// Fills the tables for rows, a threshold, and models of at least some `h2`, which is above zero. Columns must be of one length.
    pub fn tabulate<T: Real>(&mut self, columns: [&[T]; 3], threshold: f64, h2_min: f64) {
        let len = columns[0].len();
        let threshold = (threshold / h2_min) as f32;
        let mut part = [[0.0f32; BLOCK]; 3];
        let mut reach = 0.0f32;
        for start in (0..len).step_by(BLOCK) {
            let count = copy(columns, start, &mut part);
            reach = furthest(&part.each_ref().map(|column| &column[..count]), threshold).max(reach);
        }
        let reach = reach.min(REACH * threshold).max(f32::MIN_POSITIVE);
        (self.first, self.per_unit, self.h2_min) = (-reach, PLACES as f32 / (2.0 * reach), h2_min);
        (self.always, self.rows) = (0, len);
        for table in [&mut self.begun, &mut self.ended] {
            table.clear();
            table.resize(DIRECTIONS * PLACES, 0);
        }
        self.count_ends(columns, threshold);
        for (begun, ended) in self.begun.chunks_mut(PLACES).zip(self.ended.chunks_mut(PLACES)) {
            let (mut all_begun, mut all_ended) = (0, 0);
            for (begun, ended) in begun.iter_mut().zip(ended) {
                all_begun += *begun;
                *begun = all_begun;
                // What ends at a place has not ended before it.
                (*ended, all_ended) = (all_ended, all_ended + *ended);
            }
        }
    }

    /// Counts the intervals that begin and end at each place.
    fn count_ends<T: Real>(&mut self, columns: [&[T]; 3], threshold: f32) {
        let (mut part, mut cells) = ([[0.0f32; BLOCK]; 3], [[0u32; BLOCK]; 2]);
        for start in (0..columns[0].len()).step_by(BLOCK) {
            let count = copy(columns, start, &mut part);
            let [begin, past] = &mut cells;
            let columns = part.each_ref().map(|column| &column[..count]);
            place_all(&columns, threshold, (self.first, self.per_unit), begin, past);
            for (begin, past) in begin.iter().zip(past.iter()).take(count) {
                match (self.begun.get_mut(*begin as usize), self.ended.get_mut(*past as usize)) {
                    (Some(begun), Some(ended)) => {
                        *begun += 1;
                        *ended += 1;
                    }
                    _ => self.always += 1,
                }
            }
        }
    }

    /// No fewer rows than those within the threshold of a model.
    pub fn at_most(&self, [h0, h1, h2]: [f64; 3]) -> usize {
        if h2 < self.h2_min {
            return self.rows;
        }
        let model = [(h0 / h2) as f32, (h1 / h2) as f32];
        let mut places = [[0u16; DIRECTIONS]; 2];
        reached(&self.parts, model, (self.first, self.per_unit), &mut places);
        let [lowest, highest] = &places;
        let mut count = self.always;
        let tables = self.begun.chunks_exact(PLACES).zip(self.ended.chunks_exact(PLACES));
        for ((lowest, highest), (begun, ended)) in lowest.iter().zip(highest).zip(tables) {
            let (begun, ended) = (begun[usize::from(*highest) % PLACES], ended[usize::from(*lowest) % PLACES]);
            count += (begun - ended.min(begun)) as usize;
        }
        count
    }
}

/// Copies some rows from a first one on, at most [`BLOCK`], in single precision; how many.
fn copy<T: Real>(columns: [&[T]; 3], start: usize, to: &mut [[f32; BLOCK]; 3]) -> usize {
    let end = (start + BLOCK).min(columns[0].len());
    for (column, to) in columns.into_iter().zip(to) {
        to.iter_mut().zip(&column[start..end]).for_each(|(to, from)| *to = from.to_f32());
    }
    end - start
}

vectorised! {
    /// The largest end of an interval, infinite or none if there is a row without a direction.
    fn furthest(rows: &[&[f32]; 3], threshold: f32) -> f32 {
        let [x, y, z] = rows;
        let mut most = [0.0f32; 16];
        let whole = x.as_chunks::<16>().0.iter().zip(y.as_chunks::<16>().0).zip(z.as_chunks::<16>().0);
        for ((x, y), z) in whole {
            for i in 0..16 {
                let end = (z[i].abs() + threshold) / (x[i] * x[i] + y[i] * y[i]).sqrt();
                most[i] = if end > most[i] { end } else { most[i] };
            }
        }
        most.iter().fold(0.0, |most, end| if *end > most { *end } else { most })
    }
}

/// The place of a point, with everything beyond the first and the last taken for those; what is no number is at the first.
#[inline(always)]
fn place_of(point: f32, (first, per_unit): (f32, f32)) -> f32 {
    let place = (point - first) * per_unit;
    let place = if place > 0.0 { place } else { 0.0 };
    if place < (PLACES - 1) as f32 { place } else { (PLACES - 1) as f32 }
}

vectorised! {
    /// For each row, in which cell its interval begins and in which it ends; beyond the tables for rows without a direction.
    fn place_all(
        rows: &[&[f32]; 3],
        threshold: f32,
        scale: (f32, f32),
        begin: &mut [u32; BLOCK],
        past: &mut [u32; BLOCK],
    ) {
        let [x, y, z] = rows;
        let n = x.len().min(BLOCK);
        let (x, y, z, begin, past) = (&x[..n], &y[..n], &z[..n], &mut begin[..n], &mut past[..n]);
        for i in 0..n {
            // Both signs of a row are the same.
            let sign = if y[i] < 0.0 { -1.0 } else { 1.0 };
            let (x, y, z) = (sign * x[i], sign * y[i], sign * z[i]);
            let inverse = 1.0 / (x * x + y * y).sqrt();
            let direction = (1.0 - x / (x.abs() + y)) * (0.5 * DIRECTIONS as f32);
            let (middle, half) = (z * inverse, threshold * inverse);
            let half = half + ROUNDED * (middle.abs() + half);
            let (from, to) = (place_of(middle - half, scale), place_of(middle + half, scale));
            let last = (DIRECTIONS - 1) as f32;
            let direction = if direction < last { direction } else { last };
            let row = (direction as i32 as u32) * PLACES as u32;
            let known = inverse < 1e18;
            begin[i] = if known { row + from as i32 as u32 } else { u32::MAX };
            past[i] = if known { row + to as i32 as u32 } else { u32::MAX };
        }
    }
}

vectorised! {
    /// The first and the last place that the point of a model has within each part.
    fn reached(parts: &Parts, [a, b]: [f32; 2], scale: (f32, f32), out: &mut [[u16; DIRECTIONS]; 2]) {
        let [lowest, highest] = out;
        let size = a.abs() + b.abs();
        for i in 0..DIRECTIONS {
            let (cos, sin, half) = (parts.cos[i], parts.sin[i], parts.half[i]);
            let point = -(a * cos + b * sin);
            // The slope in the middle, and the most that it can change by.
            let away = half * (a * sin - b * cos).abs() + (0.5 * half * half + ROUNDED) * size;
            let place = (point + away - scale.0) * scale.1;
            let last = (PLACES - 1) as f32;
            // What is no number, of a model beyond all bounds, is at the last.
            let place = if place < last { place } else { last };
            highest[i] = if place > 0.0 { place as i32 as u16 } else { 0 };
            lowest[i] = place_of(point - away, scale) as i32 as u16;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::{any, prop_assert, proptest};
    use rand::Rng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng as _;

    /// Rows of which a share agrees with a model, of lengths up to a factor of three apart.
    fn rows(seed: u64, len: usize, model: [f64; 2], noise: f64) -> [Vec<f32>; 3] {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut share = move || f64::from(rng.next_u32()) / f64::from(u32::MAX);
        let mut rows = [(); 3].map(|()| Vec::with_capacity(len));
        for _ in 0..len {
            let (turn, length) = (std::f64::consts::TAU * share(), 0.5 + share());
            let (x, y) = (length * turn.cos(), length * turn.sin());
            let inlier = share() < 0.2;
            let z =
                if inlier { -(x * model[0] + y * model[1]) + noise * (share() - 0.5) } else { 80.0 * (share() - 0.5) };
            rows.iter_mut().zip([x, y, z]).for_each(|(column, value)| column.push(value as f32));
        }
        rows
    }

    fn columns<T>(rows: &[Vec<T>; 3]) -> [&[T]; 3] {
        rows.each_ref().map(|column| &column[..])
    }

    fn count(rows: &[Vec<f32>; 3], model: [f64; 3], threshold: f64) -> usize {
        f32::count(columns(rows), model.map(f32::from_f64), f32::reach(threshold))
    }

    proptest! {
        /// Never fewer than there are, whatever the model, and for likely ones not many more.
        #[test]
        fn bounds_hold(seed in any::<u64>(), a in -30.0..30.0f64, b in -30.0..30.0f64, threshold in 0.01..30.0f64) {
            let rows = rows(seed, 3000, [a, b], 2.0 * threshold);
            for h2_min in [1.0, 0.8] {
                let mut bound = ConsensusBound::default();
                bound.tabulate(columns(&rows), threshold, h2_min);
                for k in 0..40 {
                    let far = 1.5f64.powi(k - 20);
                    let model = [a + far * f64::from(k).cos(), b - far * f64::from(k).sin(), h2_min.max(1.0 - far)];
                    let (most, count) = (bound.at_most(model), count(&rows, model, threshold));
                    prop_assert!(most >= count && most <= 3000, "{most} of {count}");
                }
                let most = bound.at_most([a, b, 1.0]) as f64;
                let wider = count(&rows, [a, b, 1.0], 1.5 * threshold / h2_min + 2.0) as f64;
                // Places beyond the tables' reach are not told apart.
                prop_assert!(threshold < 1.0 || most <= 1.05 * wider + 100.0, "{most} of {wider}");
            }
        }
    }

    #[test]
    fn rows_and_models_without_a_place_are_counted() {
        let mut rows = rows(1, 100, [3.0, 4.0], 1.0);
        for row in [[0.0, 0.0, 0.5], [f32::MIN_POSITIVE, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1e10, 1e12]] {
            rows.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        }
        let mut bound = ConsensusBound::default();
        bound.tabulate(columns(&rows), 1.0, 1.0);
        for model in [[3.0, 4.0, 1.0], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 1.0, 1.0], [1e300, -1e300, 1.0], [0.0; 3]]
        {
            assert!(bound.at_most(model) >= count(&rows, model, 1.0));
        }
        bound.tabulate::<f64>([&[]; 3], 1.0, 1.0);
        assert_eq!(bound.at_most([0.0, 0.0, 1.0]), 0);
    }

    /// The vector loops against their own bodies, one number after the other.
    #[test]
    fn places_are_those_of_single_rows() {
        let rows = rows(3, BLOCK, [3.0, 4.0], 1.0);
        let (mut begin, mut past, mut one) = ([0; BLOCK], [0; BLOCK], ([0; BLOCK], [0; BLOCK]));
        let scale = (-40.0, 6.4);
        place_all(&columns(&rows), 1.0, scale, &mut begin, &mut past);
        for i in 0..BLOCK {
            place_all(&columns(&rows).map(|column| &column[i..=i]), 1.0, scale, &mut one.0, &mut one.1);
            assert_eq!((begin[i], past[i]), (one.0[0], one.1[0]), "row {i}");
        }
        let end = |i: usize| (rows[2][i].abs() + 1.0) / (rows[0][i] * rows[0][i] + rows[1][i] * rows[1][i]).sqrt();
        assert_eq!(furthest(&columns(&rows), 1.0), (0..BLOCK).map(end).fold(0.0, f32::max));
    }
}
