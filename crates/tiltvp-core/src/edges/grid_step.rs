//! Edges that follow the pixel grid as no lens draws them: of what is burnt in, of borders, blocks and broken columns.

use crate::image::ImageView;

/// Pixels along an edge that are looked at: the side of a block of JPEG. Noise of their sums is a third of one pixel's.
const ALONG: usize = 8;

/// Pixels across it.
const ACROSS: usize = 6;

/// Largest slope against the grid: a fifth of a pixel for each, so that the edge may be along it.
const SLOPE_MAX: f32 = 0.2;

/// The changes beside the largest one, together, as a share of that, below which an edge is a step between two pixels: 0.6 and more where
/// optics blur by half a pixel. Less than none beside a line of one pixel and where columns have offsets of their own.
const BESIDE_MAX: f64 = 0.2;

/// Whether an edge is along the columns (`true`) or the rows (`false`), if it may be along the grid at all.
fn along_columns([gx, gy]: [f32; 2]) -> Option<bool> {
    let is_column = gx.abs() >= gy.abs();
    let (steep, flat) = if is_column { (gx, gy) } else { (gy, gx) };
    (flat.abs() <= SLOPE_MAX * steep.abs()).then_some(is_column)
}

/// Whether the edge at a pixel, with its gradient, is a step between two columns or two rows over several pixels, or the same in all of
/// them to the last level, as where a decoder repeats the last row it has.
pub(crate) fn is_grid_step(image: &ImageView<'_>, [u, v]: [usize; 2], gradient: [f32; 2]) -> bool {
    let Some(is_column) = along_columns(gradient) else { return false };
    let Some(lines) = across(image, [u, v], is_column) else { return false };
    let mut steps = [0i32; ACROSS - 1];
    for line in &lines {
        for (step, pair) in steps.iter_mut().zip(line.windows(2)) {
            *step += i32::from(pair[1]) - i32::from(pair[0]);
        }
    }
    let inner = |line: &[u8; ACROSS]| [line[1], line[2], line[3], line[4]];
    let repeats = lines.windows(2).all(|pair| inner(&pair[0]) == inner(&pair[1]));
    let [far, left, right, beyond, _] = steps;
    let (largest, beside) = if left.abs() > right.abs() { (left, far + right) } else { (right, left + beyond) };
    repeats || f64::from(beside * largest.signum()) < BESIDE_MAX * f64::from(largest.abs())
}

/// The levels on lines across an edge along the columns or the rows, about a pixel; `None` where they are not all in the image.
fn across(image: &ImageView<'_>, [u, v]: [usize; 2], is_column: bool) -> Option<[[u8; ACROSS]; ALONG]> {
    let mut lines = [[0; ACROSS]; ALONG];
    if is_column {
        let (first, start) = (u.checked_sub(2)?, v.checked_sub(ALONG / 2)?);
        for (k, line) in lines.iter_mut().enumerate() {
            line.copy_from_slice(image.row(start + k).get(first..first + ACROSS)?);
        }
    } else {
        let (first, start) = (v.checked_sub(2)?, u.checked_sub(ALONG / 2)?);
        for k in 0..ACROSS {
            let row = image.row(first + k).get(start..start + ALONG)?;
            lines.iter_mut().zip(row).for_each(|(line, level)| line[k] = *level);
        }
    }
    Some(lines)
}

/// Where steps of the pixel grid are in an image, and what is beside them: noise hides a part of each.
#[derive(Debug, Clone)]
pub(crate) struct StepMap {
    /// For each pixel whether there is a step along a column (1), a row (2), or both.
    beside: Vec<u8>,
    width: usize,
}

impl StepMap {
    /// Of images of so many columns and rows, without steps.
    pub(crate) fn new([width, height]: [usize; 2]) -> Self {
        Self { beside: vec![0; width * height], width }
    }

    /// Forgets all steps.
    pub(crate) fn clear(&mut self) {
        self.beside.fill(0);
    }

    /// Notes a step, and the pixels that it may go on to: a block's side along it, and its own width across.
    pub(crate) fn insert(&mut self, [u, v]: [usize; 2], gradient: [f32; 2]) {
        let Some(is_column) = along_columns(gradient) else { return };
        let (du, dv) = if is_column { (1, ALONG) } else { (ALONG, 1) };
        let columns = u.saturating_sub(du)..(u + du + 1).min(self.width);
        for row in self.beside.chunks_exact_mut(self.width).skip(v.saturating_sub(dv)).take(v.min(dv) + dv + 1) {
            row[columns.clone()].iter_mut().for_each(|here| *here |= bit(is_column));
        }
    }

    /// Whether an edge at a pixel is a step or what one may go on to.
    pub(crate) fn has(&self, [u, v]: [usize; 2], gradient: [f32; 2]) -> bool {
        along_columns(gradient).is_some_and(|is_column| self.beside[v * self.width + u] & bit(is_column) != 0)
    }
}

fn bit(is_column: bool) -> u8 {
    if is_column { 1 } else { 2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of an image of 16 x 16 pixels by a level for each column, at (8, 8), turned by a quarter too.
    fn is_step(level: impl Fn(usize, usize) -> u8) -> bool {
        let columns: Vec<u8> = (0..256).map(|i| level(i % 16, i / 16)).collect();
        let rows: Vec<u8> = (0..256).map(|i| level(i / 16, i % 16)).collect();
        let [a, b] = [(columns, [300.0, 10.0]), (rows, [10.0, 300.0])].map(|(data, gradient)| {
            let image = ImageView::new(&data, 16, 16, 16).unwrap();
            assert!(!is_grid_step(&image, [8, 8], [200.0, 200.0]));
            assert!(!is_grid_step(&image, [1, 8], gradient) && !is_grid_step(&image, [8, 14], gradient));
            is_grid_step(&image, [8, 8], gradient)
        });
        assert_eq!(a, b);
        a
    }

    #[test]
    fn steps_between_pixels_are_told_from_edges_that_a_lens_draws() {
        let noise = |u: usize, v: usize| (u * 7 + v * 13) as u8 % 5;
        assert!(is_step(|u, v| if u < 8 { 40 } else { 120 } + noise(u, v)));
        assert!(is_step(|u, v| if u == 8 { 200 } else { 100 } + noise(u, v)));
        let blurred = |u: usize| [40, 40, 40, 40, 40, 40, 42, 58, 102, 118, 120, 120, 120, 120, 120, 120][u];
        assert!(!is_step(|u, v| blurred(u) + noise(u, v)));
        assert!(is_step(|u, _| blurred(u)));
        // One that leans by a pixel in four.
        assert!(!is_step(|u, v| if u + v / 4 < 10 { 40 } else { 120 } + noise(u, v)));
    }

    #[test]
    fn what_a_step_may_go_on_to_is_as_it_is_along_it() {
        let (column, row, slanted) = ([10.0, 0.0], [0.0, -10.0], [10.0, 10.0]);
        let mut map = StepMap::new([40, 30]);
        for _ in 0..2 {
            map.clear();
            assert!(!map.has([20, 15], column));
            map.insert([20, 15], column);
            map.insert([0, 29], row);
            map.insert([30, 10], slanted);
        }
        for (at, along, expected) in [
            ([20, 15], column, true),
            ([20, 15], row, false),
            ([20, 15], slanted, false),
            ([21, 23], column, true),
            ([19, 7], column, true),
            ([21, 24], column, false),
            ([19, 6], column, false),
            ([22, 15], column, false),
            ([8, 28], row, true),
            ([9, 29], row, false),
            ([0, 27], row, false),
            ([30, 10], column, false),
        ] {
            assert_eq!(map.has(at, along), expected, "{at:?} {along:?}");
        }
    }
}
