//! Places of a rectangle of pixels, as a polynomial of their columns and rows.

use nalgebra::Vector2;

/// Places that are a parabola along each row and each column: sums of `terms` times 1, i, j, i j, i^2, j^2, i^2 j, i j^2 for column i and
/// row j.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    terms: [Vector2<f64>; 8],
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
        let [a, b, c, d] = corners;
        let ([above, below], [left, right]) = (across.map(|second| 0.5 * second), down.map(|second| 0.5 * second));
        let [x, y] = reach.map(|reach| 1.0 / reach as f64);
        let terms = [
            a,
            (b - a - above) * x,
            (c - a - left) * y,
            (d - c - b + a - (below - above) - (right - left)) * (x * y),
            above * (x * x),
            left * (y * y),
            (below - above) * (x * x * y),
            (right - left) * (x * y * y),
        ];
        Self { terms }
    }

    /// The same from another column on.
    pub(super) fn starting_at(&self, column: usize) -> Self {
        let [one, i, j, ij, ii, jj, iij, ijj] = self.terms;
        let by = column as f64;
        let terms = [
            one + (i + ii * by) * by,
            i + ii * (2.0 * by),
            j + (ij + iij * by) * by,
            ij + iij * (2.0 * by),
            ii,
            jj + ijj * by,
            iij,
            ijj,
        ];
        Self { terms }
    }

    /// The place of a column and row.
    pub(super) fn at(&self, [column, row]: [usize; 2]) -> Vector2<f64> {
        let [one, i, j, ij, ii, jj, iij, ijj] = self.terms;
        let (u, v) = (column as f64, row as f64);
        one + (i + ii * u) * u + (j + (ij + iij * u) * u + (jj + ijj * u) * v) * v
    }

    /// What is beyond no place of so many columns and rows, on either side.
    pub(super) fn bounds(&self, size: [usize; 2]) -> (Vector2<f64>, Vector2<f64>) {
        let last = size.map(|side| side - 1);
        let corners = [[0, 0], [last[0], 0], [0, last[1]], last].map(|corner| self.at(corner));
        let (low, high) = corners[1..]
            .iter()
            .fold((corners[0], corners[0]), |(low, high), corner| (low.inf(corner), high.sup(corner)));
        // A parabola a s^2 leaves its chord of length l by a l^2 / 4 at most.
        let [_, _, _, _, ii, jj, iij, ijj] = self.terms.map(|term| term.abs());
        let [u, v] = last.map(|side| side as f64);
        let beyond = (ii + iij * v) * (0.25 * u * u) + (jj + ijj * u) * (0.25 * v * v);
        (low - beyond, high + beyond)
    }

    /// Along an axis, less those of an origin.
    pub(super) fn along(&self, axis: usize, origin: f64) -> [f32; 8] {
        let mut terms = self.terms.map(|term| term[axis]);
        terms[0] -= origin;
        terms.map(|term| term as f32)
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
        let (low, high) = surface.bounds([9, 6]);
        for (column, row) in (0..9).flat_map(|column| (0..6).map(move |row| (column, row))) {
            let exact = place(column as f64, row as f64);
            assert!((surface.at([column, row]) - exact).norm() < 1e-12, "{column} {row}");
            assert!((exact - low).min() > -1e-12 && (high - exact).min() > -1e-12, "{column} {row}");
            if column >= 3 {
                assert!((surface.starting_at(3).at([column - 3, row]) - exact).norm() < 1e-12, "{column} {row}");
            }
        }
    }
}
