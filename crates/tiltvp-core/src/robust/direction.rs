//! The direction that is most nearly orthogonal to many unit normals: a common vanishing point.

use nalgebra::{Matrix3, Vector3};

use super::census::Census;
use super::loss::Gate;
use super::problem::Problem;
use super::real::Real;
use super::rows::{Moments, Rows};
use super::sampling::Score;

/// Unit normals of great circles (rows), a unit direction near `+z` (model), residuals `m . o` (the sine of an angle).
///
/// Paper 000 eqs. 36, 38 and 40. Turn the normals first if the direction sought is far from `+z`.
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

    /// Least squares with the added equation `plane . o = 1`, as paper 000 section 2.2.1 does with `(1, 1, 1)`.
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
    type Summary = Moments;
    const SAMPLE_SIZE: usize = 2;

    fn len(&self) -> usize {
        self.rows.len()
    }

    /// Eq. 36.
    fn fit_minimal(&self, sample: &[usize]) -> Option<Vector3<f64>> {
        let (first, second) = (self.rows.get(*sample.first()?)?, self.rows.get(*sample.get(1)?)?);
        first.cross(&second).try_normalize(1e-9).and_then(upwards)
    }

    fn consensus(&self, model: &Vector3<f64>, threshold: f64, to_beat: usize) -> usize {
        self.rows.count_to_beat((*model).into(), threshold, to_beat)
    }

    fn consensus_of_each(&self, models: &[Option<Vector3<f64>>], threshold: f64, to_beat: usize, counts: &mut [usize]) {
        let models = models.iter().map(|model| model.map(Into::into));
        self.rows.count_each_to_beat(&models, threshold, to_beat, counts);
    }

    fn take_census(&self, threshold: f64, census: &mut Census) -> bool {
        census.take(self.rows, threshold, LEAST_COUNTED_Z);
        true
    }

    fn consensus_at_most(&self, census: &Census, model: &Vector3<f64>) -> usize {
        census.at_most((*model).into())
    }

    fn consensus_among(&self, observations: &[u32], model: &Vector3<f64>, threshold: f64) -> usize {
        self.rows.count_among(observations, (*model).into(), threshold)
    }

    fn support(&self, model: &Vector3<f64>, threshold: f64, score: Score, to_beat: f64) -> f64 {
        self.rows.support((*model).into(), threshold, score, to_beat)
    }

    fn quality(&self, index: usize) -> f32 {
        self.quality.get(index).copied().unwrap_or_default()
    }

    fn summarise(&self, model: &Vector3<f64>, gate: Gate, weights: &mut [f32]) -> Moments {
        self.rows.moments((*model).into(), gate, weights)
    }

    fn trim(&self, before: &Moments, model: &Vector3<f64>, threshold: f64, weights: &mut [f32]) -> Moments {
        self.rows.trim(before, (*model).into(), threshold, weights)
    }

    fn fit(&self, summary: &Moments, _near: &Vector3<f64>) -> Option<Vector3<f64>> {
        if let Some(plane) = self.plane {
            // (S + p p^T) o = p has the solution o ~ S^-1 p.
            let moments: Matrix3<f64> = summary.second_moments();
            let scale = moments.trace();
            let inverse = (moments / scale).try_inverse()?;
            return (inverse * plane).try_normalize(1e-12).and_then(upwards);
        }
        let [x, y, z] = summary.model();
        let step = summary.step()?;
        Vector3::new(x + step.x, y + step.y, z).try_normalize(1e-12).and_then(upwards)
    }

    fn rms(&self, summary: &Moments, model: &Vector3<f64>) -> f64 {
        // In the chart of the summary's model the direction is (x, y, z) / scale.
        let at = Vector3::from(summary.model());
        let scale = at.z / model.z;
        let step = (model * scale - at).xy();
        (summary.sum_of_squares(&step) / summary.weight).sqrt() / scale.abs()
    }

    fn count(summary: &Moments) -> usize {
        summary.count
    }

    fn distance(&self, a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
        (a - b).norm()
    }
}

/// The same line, pointing up; none for a horizontal one, which the chart about `+z` does not hold.
fn upwards(direction: Vector3<f64>) -> Option<Vector3<f64>> {
    (direction.z.abs() > LEAST_Z).then(|| direction * direction.z.signum())
}

/// The least `z` of directions of which a census tells something: those within 14 degrees of `+z`.
const LEAST_COUNTED_Z: f64 = 0.97;

/// The least `z` of a unit direction in the chart.
const LEAST_Z: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::super::{
        RansacOptions, RansacScratch, RejectRefitOptions, ReweightOptions, Stop, ransac, reject_refit, reweight,
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
            ransac(&problem, &RansacOptions::with_threshold(0.01), &near, &mut weights, &mut RansacScratch::default());
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
    fn plane_constraint_is_the_papers_least_squares() {
        let truth = Vector3::new(0.05, -0.03, 1.0).normalize();
        let rows = scene(truth);
        let plane = Vector3::new(1.0, 1.0, 1.0);
        let problem = Direction::with_plane(&rows, plane);
        let mut weights = vec![1.0; rows.len()];
        let summary = problem.summarise(&truth, Gate::Open, &mut weights);
        let moments = rows.iter().map(|r| r * r.transpose()).sum::<Matrix3<f64>>();
        let expected = ((moments + plane * plane.transpose()).try_inverse().unwrap() * plane).normalize();
        assert_abs_diff_eq!(problem.fit(&summary, &truth).unwrap(), expected, epsilon = 1e-9);
    }

    #[test]
    fn parallel_normals_have_no_common_direction_and_too_few_say_so() {
        let mut rows = Rows::<f64>::with_capacity(10);
        for _ in 0..10 {
            rows.push(1.0, 0.0, 0.0);
        }
        let near = Vector3::z();
        let report = ransac(
            &Direction::new(&rows),
            &RansacOptions::with_threshold(0.01),
            &near,
            &mut [1.0; 10],
            &mut RansacScratch::default(),
        );
        assert!(matches!(report.stop, Stop::NoModel { .. }) && report.model.is_none());
        let mut one = Rows::<f64>::with_capacity(1);
        one.push(1.0, 0.0, 0.0);
        let report = ransac(
            &Direction::new(&one),
            &RansacOptions::with_threshold(0.01),
            &near,
            &mut [1.0],
            &mut RansacScratch::default(),
        );
        assert_eq!(report.stop, Stop::TooFew { have: 1, need: 2 });
    }
}
