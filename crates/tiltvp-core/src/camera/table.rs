//! Where an inverse starts: a growing function tabulated at equal steps, with its slopes.

/// Cells of a table: cubic pieces over this many leave Newton's method one or two steps.
const CELLS: usize = 128;

/// A growing function on `[0, end]`: bracket and guess for its value.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    cells_per_unit: f64,
    /// `(value, slope times the width of a cell)`.
    knots: Vec<[f64; 2]>,
}

impl Table {
    /// Tabulates `x -> (y, dy/dx)`.
    pub(super) fn new(end: f64, function: impl Fn(f64) -> (f64, f64)) -> Self {
        let width = end / CELLS as f64;
        let knots = (0..=CELLS)
            .map(|i| {
                let (value, slope) = function(if i == CELLS { end } else { width * i as f64 });
                [value, slope * width]
            })
            .collect();
        Self { cells_per_unit: CELLS as f64 / end, knots }
    }

    /// Whether every value and slope is a number: of a function that rounding has left without, nothing can be told.
    pub(super) fn is_finite(&self) -> bool {
        self.knots.iter().flatten().all(|x| x.is_finite())
    }

    /// The value at the end.
    pub(super) fn last(&self) -> f64 {
        self.knots.last().map_or(0.0, |knot| knot[0])
    }

    /// `(low, high, guess)` for the value at a place in `[0, end]`; the bracket is some bits wider than the cell, as the
    /// knots are rounded, but ends with the table.
    #[inline]
    pub(super) fn around(&self, x: f64) -> (f64, f64, f64) {
        let at = x * self.cells_per_unit;
        let cell = (at as usize).min(CELLS - 1);
        let t = at - cell as f64;
        let ([y0, m0], [y1, m1]) = (self.knots[cell], self.knots[cell + 1]);
        let rise = y1 - y0;
        let guess = y0 + t * (m0 + t * ((3.0 * rise - 2.0 * m0 - m1) + t * (m0 + m1 - 2.0 * rise)));
        (y0 * (1.0 - 1e-12), (y1 * (1.0 + 1e-12)).min(self.last()), guess)
    }
}
