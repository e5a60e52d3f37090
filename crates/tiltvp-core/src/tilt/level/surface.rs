//! Places of a rectangle of pixels, as polynomials of their columns and rows.

use nalgebra::Vector2;

/// Pixels from one corner of a cell to the next: 336 corners are projected for a 640 x 480 image.
pub(super) const CELL: usize = 32;

/// The same in panoramas, in which places bend more beside the poles: with as many as in other images a map takes 1.6 times as long.
pub(super) const PANORAMA_CELL: usize = 16;

const _: () = assert!(CELL.is_multiple_of(PANORAMA_CELL), "strips are of whole cells");

/// A rectangle of pixels of the new image, and where they are in the old one: in its pixels, on one side of its seam.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    pub(super) first: [usize; 2],
    pub(super) size: [usize; 2],
    pub(super) places: Surface,
}

/// Places that are cubic along each row and each column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    /// For columns and rows of places: sums of these times 1, i, j, i j, i^2, j^2, i^2 j, i j^2, i^3, j^3, i^3 j, i j^3 for column i and
    /// row j.
    terms: [[f64; 12]; 2],
    /// What is beyond no place between the corners, on either side.
    pub(super) low: Vector2<f64>,
    pub(super) high: Vector2<f64>,
}

impl Surface {
    /// Through four corners (left above, right above, left below, right below) that are `reach` columns and rows apart, with the second
    /// differences over these distances: across, of each corner; and down.
    ///
    /// Between two corners it is Everett's interpolation formula, or where both have the same second difference Bessel's; between two such
    /// sides straight.
    pub(super) fn new(corners: [Vector2<f64>; 4], [across, down]: [[Vector2<f64>; 4]; 2], reach: [usize; 2]) -> Self {
        let [x, y] = reach.map(|reach| 1.0 / reach as f64);
        let (mut terms, mut low, mut high) = ([[0.0; 12]; 2], Vector2::zeros(), Vector2::zeros());
        for axis in 0..2 {
            let [[a, b, c, d], across, down] = [&corners, &across, &down].map(|four| four.map(|place| place[axis]));
            // How a side leaves its chord: factors of s, s^2 and s^3, from 0 to 1.
            let side = |from: f64, to: f64| [-(2.0 * from + to) / 6.0, 0.5 * from, (to - from) / 6.0];
            let (above, below) = (side(across[0], across[1]), side(across[2], across[3]));
            let (left, right) = (side(down[0], down[2]), side(down[1], down[3]));
            terms[axis] = [
                a,
                (b - a + above[0]) * x,
                (c - a + left[0]) * y,
                (d - c - b + a + (below[0] - above[0]) + (right[0] - left[0])) * (x * y),
                above[1] * (x * x),
                left[1] * (y * y),
                (below[1] - above[1]) * (x * x * y),
                (right[1] - left[1]) * (x * y * y),
                above[2] * (x * x * x),
                left[2] * (y * y * y),
                (below[2] - above[2]) * (x * x * x * y),
                (right[2] - left[2]) * (x * y * y * y),
            ];
            // A side leaves its chord by an eighth of the larger second difference at most.
            let largest = |four: [f64; 4]| four.into_iter().map(f64::abs).fold(0.0, f64::max);
            let beyond = 0.125 * (largest(across) + largest(down));
            low[axis] = a.min(b).min(c.min(d)) - beyond;
            high[axis] = a.max(b).max(c.max(d)) + beyond;
        }
        Self { terms, low, high }
    }

    /// The place of a column and row.
    pub(super) fn at(&self, [column, row]: [usize; 2]) -> Vector2<f64> {
        let (u, v) = (column as f64, row as f64);
        let along = |[one, i, j, ij, ii, jj, iij, ijj, iii, jjj, iiij, ijjj]: [f64; 12]| {
            let (linear, square, cube) = (j + (ij + (iij + iiij * u) * u) * u, jj + ijj * u, jjj + ijjj * u);
            one + (i + (ii + iii * u) * u) * u + (linear + (square + cube * v) * v) * v
        };
        Vector2::new(along(self.terms[0]), along(self.terms[1]))
    }

    /// The terms along an axis, of what is left of the places without an origin, so that 24 bits tell it.
    pub(super) fn along(&self, axis: usize) -> ([f32; 12], f32) {
        let mut terms = self.terms[axis];
        let origin = terms[0].floor();
        terms[0] -= origin;
        (terms.map(|term| term as f32), origin as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everett's formula is exact for cubics, and bounds are bounds.
    #[test]
    fn surfaces_pass_through_what_is_cubic_each_way() {
        let place = |u: f64, v: f64| {
            Vector2::new(
                3.0 + 0.9 * u - 0.2 * v + 0.05 * u * v + 0.03 * u * u - 0.02 * v * v + 0.004 * u * u * v
                    - 0.01 * u * u * u,
                7.0 + 0.1 * u + 1.1 * v - 0.04 * u * v - 0.05 * u * u + 0.01 * v * v - 0.003 * u * v * v * v,
            )
        };
        let (x, y) = (8.0, 5.0);
        let corners = [[0.0, 0.0], [x, 0.0], [0.0, y], [x, y]];
        let second = |before: Vector2<f64>, at: Vector2<f64>, after: Vector2<f64>| after - 2.0 * at + before;
        let across = corners.map(|[u, v]| second(place(u - x, v), place(u, v), place(u + x, v)));
        let down = corners.map(|[u, v]| second(place(u, v - y), place(u, v), place(u, v + y)));
        let surface = Surface::new(corners.map(|[u, v]| place(u, v)), [across, down], [8, 5]);
        let (low, high) = (surface.low, surface.high);
        for (column, row) in (0..9).flat_map(|column| (0..6).map(move |row| (column, row))) {
            let exact = place(column as f64, row as f64);
            assert!((surface.at([column, row]) - exact).norm() < 1e-12, "{column} {row}");
            assert!((exact - low).min() > -1e-12 && (high - exact).min() > -1e-12, "{column} {row}");
        }
    }
}
