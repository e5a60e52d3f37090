//! Places of a rectangle of pixels, as polynomials of their columns and rows.

use nalgebra::Vector2;

/// Pixels from one corner of a cell to the next: 1,271 corners are projected for a 640 x 480 image. With 8 pixels they are 4,941; with
/// 20 so many cells are split that a map takes one and a half times as long.
pub(super) const CELL: usize = 16;

/// A rectangle of pixels of the new image, and where they are in the old one: in its pixels, on one side of its seam.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    pub(super) first: [usize; 2],
    pub(super) size: [usize; 2],
    pub(super) places: Surface,
}

/// Places that are a parabola along each row and each column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    /// For columns and rows of places: sums of these times 1, i, j, i j, i^2, j^2, i^2 j, i j^2 for column i and row j.
    terms: [[f64; 8]; 2],
    /// What is beyond no place between the corners, on either side.
    pub(super) low: Vector2<f64>,
    pub(super) high: Vector2<f64>,
}

impl Surface {
    /// Through four corners (left above, right above, left below, right below) that are `reach` columns and rows apart, with the second
    /// differences over these distances: across, above and below; and down, left and right.
    ///
    /// With means of those at both ends this is Bessel's interpolation formula.
    pub(super) fn new(
        corners: [Vector2<f64>; 4],
        across: [Vector2<f64>; 2],
        down: [Vector2<f64>; 2],
        reach: [usize; 2],
    ) -> Self {
        let [x, y] = reach.map(|reach| 1.0 / reach as f64);
        let (mut terms, mut low, mut high) = ([[0.0; 8]; 2], Vector2::zeros(), Vector2::zeros());
        for axis in 0..2 {
            let [a, b, c, d] = corners.map(|corner| corner[axis]);
            let [above, below, left, right] = [across[0], across[1], down[0], down[1]].map(|second| 0.5 * second[axis]);
            terms[axis] = [
                a,
                (b - a - above) * x,
                (c - a - left) * y,
                (d - c - b + a - (below - above) - (right - left)) * (x * y),
                above * (x * x),
                left * (y * y),
                (below - above) * (x * x * y),
                (right - left) * (x * y * y),
            ];
            // A parabola a s^2 leaves its chord of length l by a l^2 / 4 at most.
            let beyond = 0.25 * (above.abs().max(below.abs()) + left.abs().max(right.abs()));
            low[axis] = a.min(b).min(c.min(d)) - beyond;
            high[axis] = a.max(b).max(c.max(d)) + beyond;
        }
        Self { terms, low, high }
    }

    /// The place of a column and row.
    pub(super) fn at(&self, [column, row]: [usize; 2]) -> Vector2<f64> {
        let (u, v) = (column as f64, row as f64);
        let along = |[one, i, j, ij, ii, jj, iij, ijj]: [f64; 8]| {
            one + (i + ii * u) * u + (j + (ij + iij * u) * u + (jj + ijj * u) * v) * v
        };
        Vector2::new(along(self.terms[0]), along(self.terms[1]))
    }

    /// The terms along an axis, of what is left of the places without an origin, so that 24 bits tell it.
    pub(super) fn along(&self, axis: usize) -> ([f32; 8], f32) {
        let mut terms = self.terms[axis];
        let origin = terms[0].floor();
        terms[0] -= origin;
        (terms.map(|term| term as f32), origin as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bessel's formula is exact for parabolas, and bounds are bounds.
    #[test]
    fn surfaces_pass_through_what_is_a_parabola_each_way() {
        let place = |u: f64, v: f64| {
            Vector2::new(
                3.0 + 0.9 * u - 0.2 * v + 0.05 * u * v + 0.03 * u * u - 0.02 * v * v + 0.004 * u * u * v,
                7.0 + 0.1 * u + 1.1 * v - 0.04 * u * v - 0.05 * u * u + 0.01 * v * v - 0.003 * u * v * v,
            )
        };
        let (x, y) = (8.0, 5.0);
        let second = |before: Vector2<f64>, at: Vector2<f64>, after: Vector2<f64>| after - 2.0 * at + before;
        let across = [0.0, y].map(|v| second(place(-x, v), place(0.0, v), place(x, v)));
        let down = [0.0, x].map(|u| second(place(u, -y), place(u, 0.0), place(u, y)));
        let corners = [place(0.0, 0.0), place(x, 0.0), place(0.0, y), place(x, y)];
        let surface = Surface::new(corners, across, down, [8, 5]);
        let (low, high) = (surface.low, surface.high);
        for (column, row) in (0..9).flat_map(|column| (0..6).map(move |row| (column, row))) {
            let exact = place(column as f64, row as f64);
            assert!((surface.at([column, row]) - exact).norm() < 1e-12, "{column} {row}");
            assert!((exact - low).min() > -1e-12 && (high - exact).min() > -1e-12, "{column} {row}");
        }
    }
}
