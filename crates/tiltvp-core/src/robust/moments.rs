//! Weighted moments of rows and residuals, from which a nearby model is fitted without another look at the rows.

use nalgebra::{Matrix2, Matrix3, Vector2};

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
    pub(super) whole: f64,
    /// `w (xx, xy, yy, xd, yd, dd)`.
    pub(super) sums: [f64; 6],
    /// The model `(h0, h1, h2)` at which the moments were taken.
    pub(super) at: [f64; 3],
}

impl Moments {
    /// The same moments with the residuals of another model; `None` if `h2` is zero.
    pub(super) fn about(&self, model: [f64; 3]) -> Option<Self> {
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

    /// Root of the weighted mean square residual of a model.
    pub fn rms(&self, model: [f64; 3]) -> f64 {
        // In the chart of the moments' model the other one is (h0, h1, h2) times the scale.
        let scale = self.at[2] / model[2];
        let step = Vector2::new(model[0] * scale - self.at[0], model[1] * scale - self.at[1]);
        (self.sum_of_squares(&step) / self.weight).sqrt() / scale.abs()
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
