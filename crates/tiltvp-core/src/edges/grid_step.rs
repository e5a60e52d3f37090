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

/// Whether the edge at a pixel, with its gradient, is a step between two columns or two rows over several pixels, or the same in all of
/// them to the last level, as where a decoder repeats the last row it has.
pub(crate) fn is_grid_step(image: &ImageView<'_>, [u, v]: [usize; 2], [gx, gy]: [f32; 2]) -> bool {
    let is_column = gx.abs() >= gy.abs();
    let (steep, flat) = if is_column { (gx, gy) } else { (gy, gx) };
    if flat.abs() > SLOPE_MAX * steep.abs() {
        return false;
    }
    let (across, along) = if is_column { (u, v) } else { (v, u) };
    let (Some(first), Some(start)) = (across.checked_sub(2), along.checked_sub(ALONG / 2)) else { return false };
    let (mut steps, mut repeats, mut before) = ([0i32; ACROSS - 1], true, None);
    for along in start..start + ALONG {
        let mut levels = [0u8; ACROSS];
        for (k, level) in levels.iter_mut().enumerate() {
            let (u, v) = if is_column { (first + k, along) } else { (along, first + k) };
            let Some(here) = image.row(v).get(u) else { return false };
            *level = *here;
        }
        for (step, pair) in steps.iter_mut().zip(levels.windows(2)) {
            *step += i32::from(pair[1]) - i32::from(pair[0]);
        }
        let [_, inner @ .., _] = levels;
        repeats &= before.replace(inner).is_none_or(|before| before == inner);
    }
    let [far, left, right, beyond, _] = steps;
    let (largest, beside) = if left.abs() > right.abs() { (left, far + right) } else { (right, left + beyond) };
    repeats || f64::from(beside * largest.signum()) < BESIDE_MAX * f64::from(largest.abs())
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
}
