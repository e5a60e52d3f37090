//! Numbers over a rectangle of pixels that are cubic along its columns and rows.

use fearless_simd::{Simd, SimdBase as _, dispatch, f32x16};

use crate::level::loops;
use crate::vectorised;

/// Columns that are worked on together.
const TOGETHER: usize = 16;

/// A number at each of a few pixels.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    /// Column i and row j have the sum of these times 1, i, j, i j, i^2, j^2, i^2 j, i j^2, i^3, j^3, i^3 j, i j^3.
    pub terms: [f32; 12],
    /// What is added to that in the end, so that the terms need not tell large numbers.
    pub origin: f32,
}

/// Writes down a surface over `size` columns and rows, with `stride` numbers from one row to the next, by sums that lead from row to row:
/// after 32 rows of numbers below 100 they are off by 2e-4 at most.
///
/// # Panics
/// If `out` ends within it.
pub fn write(surface: &Surface, size: [usize; 2], out: &mut [f32], stride: usize) {
    dispatch!(loops(), simd => write_by(simd, surface, size, out, stride));
}

#[inline(always)]
fn write_by<S: Simd>(simd: S, surface: &Surface, size: [usize; 2], out: &mut [f32], stride: usize) {
    let splat = |number: f32| f32x16::splat(simd, number);
    let [one, i, j, ij, ii, jj, iij, ijj, iii, jjj, iiij, ijjj] = surface.terms.map(splat);
    let origin = splat(surface.origin);
    for first in (0..size[0]).step_by(TOGETHER) {
        let columns = TOGETHER.min(size[0] - first);
        let column = f32x16::from_slice(simd, &std::array::from_fn::<f32, TOGETHER, _>(|k| (first + k) as f32));
        let square = jj + ijj * column;
        let cube = jjj + ijjj * column;
        let mut row = one + (i + (ii + iii * column) * column) * column;
        let mut down = j + (ij + (iij + iiij * column) * column) * column + square + cube;
        let mut bend = splat(2.0) * square + splat(6.0) * cube;
        let twist = splat(6.0) * cube;
        for number in 0..size[1] {
            let into = &mut out[number * stride + first..][..columns];
            let numbers = row + origin;
            if columns == TOGETHER {
                numbers.store_slice(into);
            } else {
                into.copy_from_slice(&numbers.as_slice()[..columns]);
            }
            row += down;
            down += bend;
            bend += twist;
        }
    }
}

/// What is in an image.
#[derive(Debug, Clone, Copy)]
pub struct Inside {
    /// The last column and row.
    pub last: [f32; 2],
    /// Columns after which the image begins anew; 0 if it does not.
    pub period: f32,
    /// Instead of what is farther than half a pixel outside of it.
    pub unseen: f32,
}

vectorised! {
    /// Brings places, column and row, into an image: those beyond its sides by its period, those up to half a pixel outside to its
    /// edge.
    ///
    /// # Panics
    /// If either of `places` ends within `size`, with `stride` numbers from one row to the next.
    pub fn keep_inside(image: &Inside, size: [usize; 2], places: [&mut [f32]; 2], stride: usize) {
        let ([width, height], [columns, rows]) = (image.last, places);
        for number in 0..size[1] {
            let u = &mut columns[number * stride..][..size[0]];
            let v = &mut rows[number * stride..][..size[0]];
            if image.period > 0.0 {
                for u in &mut *u {
                    let left = if *u < 0.0 { *u + image.period } else { *u };
                    *u = if left > width { left - image.period } else { left };
                }
            }
            for (u, v) in u.iter_mut().zip(v) {
                let (inner_column, inner_row) = (u.clamp(0.0, width), v.clamp(0.0, height));
                // Both are looked at, so that no pixel takes a branch.
                let seen = ((*u - inner_column).abs() <= 0.5) & ((*v - inner_row).abs() <= 0.5);
                *u = if seen { inner_column } else { image.unseen };
                *v = if seen { inner_row } else { image.unseen };
            }
        }
    }
}

vectorised! {
    /// Leaves of places, column and row, those whose rays are within a field of view: they have at least such a component along an
    /// axis. The others, and those whose rays are NaN, become twice `unseen`.
    ///
    /// # Panics
    /// If rays or places end within `size`, with `stride` and `step` numbers from one row to the next.
    pub fn keep_seen(
        rays: [&[f32]; 3],
        stride: usize,
        size: [usize; 2],
        view: ([f32; 3], f32),
        places: [&mut [f32]; 2],
        step: usize,
        unseen: f32,
    ) {
        let ([x, y, z], [columns, rows], (axis, least)) = (rays, places, view);
        let n = size[0];
        for row in 0..size[1] {
            let (from, to) = (row * stride, row * step);
            let (x, y, z) = (&x[from..from + n], &y[from..from + n], &z[from..from + n]);
            let (columns, rows) = (&mut columns[to..to + n], &mut rows[to..to + n]);
            for i in 0..n {
                let along = axis[0] * x[i] + axis[1] * y[i] + axis[2] * z[i];
                let is_seen = along >= least;
                columns[i] = if is_seen { columns[i] } else { unseen };
                rows[i] = if is_seen { rows[i] } else { unseen };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_is_its_sum_at_every_pixel_and_nothing_beside_it() {
        let terms = [3.0, 0.9, -0.2, 0.02, 0.01, -0.02, 4e-4, -3e-4, -2e-4, 3e-4, 6e-6, -5e-6];
        let surface = Surface { terms, origin: 400.0 };
        for size in [[32, 32], [16, 16], [17, 5], [1, 1]] {
            let stride = 40;
            let mut out = vec![f32::NAN; stride * 32];
            write(&surface, size, &mut out, stride);
            for (at, number) in out.iter().enumerate() {
                let [i, j] = [at % stride, at / stride];
                if i >= size[0] || j >= size[1] {
                    assert!(number.is_nan());
                    continue;
                }
                let (u, v) = (i as f64, j as f64);
                let cubes = [u * u * u, v * v * v, u * u * u * v, u * v * v * v];
                let products = [1.0, u, v, u * v, u * u, v * v, u * u * v, u * v * v].into_iter().chain(cubes);
                let expected: f64 = terms.iter().zip(products).map(|(term, product)| f64::from(*term) * product).sum();
                assert!((f64::from(*number) - 400.0 - expected).abs() < 2e-4, "{i} {j}");
            }
        }
    }

    #[test]
    fn places_stay_where_rays_are_within_the_field_of_view() {
        // Rays turn away from the axis from column to column; of the last one nothing is known.
        let ray = |at: usize| if at % 20 == 18 { f64::NAN } else { 0.1 * (at % 20) as f64 };
        let rays =
            [f64::sin, |_| 0.0, f64::cos].map(|along| (0..40).map(|at| along(ray(at)) as f32).collect::<Vec<_>>());
        let rays = rays.each_ref().map(|values| &values[..]);
        let (mut columns, mut rows) = (vec![3.0; 50], vec![5.0; 50]);
        keep_seen(rays, 20, [19, 2], ([0.0, 0.0, 1.0], 0.55_f32.cos()), [&mut columns, &mut rows], 25, -7.0);
        for at in 0..50 {
            let (is_written, is_seen) = (at % 25 < 19, at % 25 <= 5);
            let expected = if is_written && !is_seen { [-7.0; 2] } else { [3.0, 5.0] };
            assert_eq!([columns[at], rows[at]], expected, "{at}");
        }
    }

    #[test]
    fn places_beyond_the_edge_by_up_to_half_a_pixel_are_at_it_and_a_panorama_begins_anew() {
        let inside = |image: &Inside, place: [f32; 2]| {
            // The same place in every column of rows that are as long as they are far apart, or longer.
            let (mut columns, mut rows) = (vec![place[0]; 40], vec![place[1]; 40]);
            keep_inside(image, [19, 2], [&mut columns, &mut rows], 20);
            assert_eq!([columns[19], rows[39]].map(f32::to_bits), place.map(f32::to_bits), "beside the size");
            assert!((0..19).all(|k| [columns[k], rows[k + 20]] == [columns[0], rows[0]]));
            [columns[0], rows[0]]
        };
        let image = Inside { last: [9.0, 5.0], period: 0.0, unseen: -7.0 };
        for (place, expected) in [
            ([3.0, 2.0], [3.0, 2.0]),
            ([-0.5, 2.0], [0.0, 2.0]),
            ([9.5, 5.25], [9.0, 5.0]),
            ([-0.75, 2.0], [-7.0; 2]),
            ([3.0, 5.75], [-7.0; 2]),
            ([f32::NAN, 2.0], [-7.0; 2]),
        ] {
            assert_eq!(inside(&image, place), expected, "{place:?}");
        }
        let panorama = Inside { last: [10.0, 5.0], period: 10.0, unseen: -7.0 };
        for (place, expected) in [([-3.0, 2.0], [7.0, 2.0]), ([12.5, -0.25], [2.5, 0.0]), ([9.75, 1.0], [9.75, 1.0])] {
            assert_eq!(inside(&panorama, place), expected, "{place:?}");
        }
    }
}
