//! The direction that is most nearly orthogonal to many unit normals: a common vanishing point.

use nalgebra::{Matrix3, Vector3};

use super::Real;
use super::moments::Moments;
use super::problem::Problem;
use super::rows::Rows;

/// Unit normals of great circles (rows), a unit direction near `+z` (model), residuals `m . o` (the sine of an angle).
///
/// Fleer 2017, eqs. 36, 38 and 40. Turn the normals first if the direction sought is far from `+z`.
#[derive(Debug, Clone, Copy)]
pub struct Direction<'a, T> {
    rows: &'a Rows<T>,
    plane: Option<Vector3<f64>>,
    quality: &'a [f32],
}

impl<'a, T: Real> Direction<'a, T> {
    /// Least squares over directions of unit length (in the chart about the last estimate).
    pub fn new(rows: &'a Rows<T>) -> Self {
        Self { rows, plane: None, quality: &[] }
    }

    /// Least squares with the added equation `plane . o = 1`, as section 2.2.1 of Fleer 2017 does with `(1, 1, 1)`.
    pub fn with_plane(rows: &'a Rows<T>, plane: Vector3<f64>) -> Self {
        Self { rows, plane: Some(plane), quality: &[] }
    }

    /// The same with a quality of each row for progressive sampling; without one all are alike.
    #[must_use]
    pub fn with_quality(self, quality: &'a [f32]) -> Self {
        Self { quality, ..self }
    }
}

impl<T: Real> Problem for Direction<'_, T> {
    type Model = Vector3<f64>;
    type Number = T;
    const SAMPLE_SIZE: usize = 2;
    const BOUNDED_H2_MIN: f64 = BOUNDED_Z_MIN;

    fn rows(&self) -> &Rows<T> {
        self.rows
    }

    fn quality(&self, index: usize) -> f32 {
        self.quality.get(index).copied().unwrap_or_default()
    }

    /// Eq. 36.
    fn fit_minimal(&self, sample: &[usize]) -> Option<Vector3<f64>> {
        let (first, second) = (self.rows.get(*sample.first()?)?, self.rows.get(*sample.get(1)?)?);
        first.cross(&second).try_normalize(1e-9).and_then(upwards)
    }

    fn fit_weighted(&self, moments: &Moments) -> Option<Vector3<f64>> {
        if let Some(plane) = self.plane {
            // (S + p p^T) o = p has the solution o ~ S^-1 p.
            let moments: Matrix3<f64> = moments.second_moments();
            let inverse = (moments / moments.trace()).try_inverse()?;
            return (inverse * plane).try_normalize(1e-12).and_then(upwards);
        }
        let [x, y, z] = moments.model();
        let step = moments.step()?;
        Vector3::new(x + step.x, y + step.y, z).try_normalize(1e-12).and_then(upwards)
    }

    fn coefficients(&self, model: &Vector3<f64>) -> [f64; 3] {
        (*model).into()
    }

    fn distance(&self, a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
        (a - b).norm()
    }
}

/// The same line, pointing up; none for a horizontal one, which the chart about `+z` does not hold.
fn upwards(direction: Vector3<f64>) -> Option<Vector3<f64>> {
    (direction.z.abs() > LEAST_Z).then(|| direction * direction.z.signum())
}

/// The least `z` of directions whose consensus is bounded: those within 14 degrees of `+z`, where the verticals of robots on floors
/// are. A lower one makes all bounds wider. Only time depends on it (`tests/consensus_bound.rs`).
const BOUNDED_Z_MIN: f64 = 0.97;

/// The least `z` of a unit direction in the chart about `+z`, whose coordinates grow beyond all bounds towards the horizon.
const LEAST_Z: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::super::{
        Gate, RansacOptions, RansacScratch, RejectRefitOptions, ReweightOptions, Stop, ransac, reject_refit, reweight,
    };
    use super::*;
    use crate::geometry::tangent_basis;
    use approx::assert_abs_diff_eq;

    /// Normals orthogonal to `truth` within 0.1 degrees, and as many that are not.
    fn scene(truth: Vector3<f64>) -> Rows<f64> {
        let basis = tangent_basis(&truth);
        let mut rows = Rows::with_capacity(400);
        for i in 0..200 {
            let t = f64::from(i) * 0.618;
            let noise = 0.0015 * (f64::from(i) * 12.9898).sin();
            let m = (basis.column(0) * t.cos() + basis.column(1) * t.sin() + truth * noise).normalize();
            rows.push(m.x, m.y, m.z);
            let m = Vector3::new((t * 3.1).cos(), (t * 1.7).sin(), 0.3 + (t * 2.3).cos()).normalize();
            rows.push(m.x, m.y, m.z);
        }
        rows
    }

    #[test]
    fn all_three_loops_find_the_common_direction() {
        let truth = Vector3::new(0.05, -0.03, 1.0).normalize();
        let rows = scene(truth);
        let problem = Direction::new(&rows);
        let near = Vector3::z();

        let mut weights = vec![1.0; rows.len()];
        let sampled =
            ransac(&problem, &RansacOptions::with_threshold(0.01), &mut weights, &mut RansacScratch::default());
        assert!(matches!(sampled.stop, Stop::Confident { .. }), "{}", sampled.stop);
        assert_abs_diff_eq!(sampled.model.unwrap(), truth, epsilon = 5e-4);

        let mut weights = vec![1.0; rows.len()];
        let options = RejectRefitOptions { keep_fraction: 0.8, max_iterations: 15, tolerance: 1e-5, rms_min: 0.002 };
        let trimmed = reject_refit(&problem, &options, &near, &mut weights);
        assert_abs_diff_eq!(trimmed.model.unwrap(), truth, epsilon = 5e-3);

        let mut weights = vec![1.0; rows.len()];
        let options =
            ReweightOptions { first_scale: 0.05, last_scale: 0.01, shrinking: 4, max_iterations: 10, tolerance: 1e-6 };
        let faded = reweight(&problem, &options, &trimmed.model.unwrap(), &mut weights);
        assert_abs_diff_eq!(faded.model.unwrap(), truth, epsilon = 5e-4);
        assert!(faded.inliers >= 200 && faded.rms < 0.01);
    }

    #[test]
    fn plane_constraint_is_the_least_squares_of_fleer() {
        let truth = Vector3::new(0.05, -0.03, 1.0).normalize();
        let rows = scene(truth);
        let plane = Vector3::new(1.0, 1.0, 1.0);
        let problem = Direction::with_plane(&rows, plane);
        let mut weights = vec![1.0; rows.len()];
        let found = rows.moments(truth.into(), Gate::Open, &mut weights);
        let moments = rows.iter().map(|r| r * r.transpose()).sum::<Matrix3<f64>>();
        let expected = ((moments + plane * plane.transpose()).try_inverse().unwrap() * plane).normalize();
        assert_abs_diff_eq!(problem.fit_weighted(&found).unwrap(), expected, epsilon = 1e-9);
    }

    #[test]
    fn parallel_normals_have_no_common_direction_and_too_few_say_so() {
        let mut rows = Rows::<f64>::with_capacity(10);
        for _ in 0..10 {
            rows.push(1.0, 0.0, 0.0);
        }
        let report = ransac(
            &Direction::new(&rows),
            &RansacOptions::with_threshold(0.01),
            &mut [1.0; 10],
            &mut RansacScratch::default(),
        );
        assert!(matches!(report.stop, Stop::NoModel { .. }) && report.model.is_none());
        let mut one = Rows::<f64>::with_capacity(1);
        one.push(1.0, 0.0, 0.0);
        let report = ransac(
            &Direction::new(&one),
            &RansacOptions::with_threshold(0.01),
            &mut [1.0],
            &mut RansacScratch::default(),
        );
        assert_eq!(report.stop, Stop::TooFew { have: 1, need: 2 });
    }
}
