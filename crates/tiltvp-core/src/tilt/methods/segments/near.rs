//! The vertical where the robot leans little: segments near it, each vertical or not by its odds.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::options::{FLOOR_RAD, SegmentsOptions};
use crate::geometry::{Tilt, tangent_basis};
use crate::robust::Stop;
use crate::segments::Segments;
use crate::tilt::confidence::inverse_of_positive;
use crate::tilt::fit::Fit;

/// How far beyond the largest lean the circles of segments may pass: five times their usual scatter.
const BEYOND_RAD: f64 = 3f64.to_radians();

/// Leans from the upright to the largest one that are tried to begin with: steps of a degree by default.
const GRID: i32 = 12;

/// Standard deviation of the leans that are expected before the image is seen, in largest leans: 5 degrees by default.
const LEAN_SIGMA: f64 = 5.0 / 12.0;

/// The scatter in radians at which a segment that passes through a direction is as likely to be of it as any other.
pub(super) const EVEN_RAD: f64 = 3f64.to_radians();

/// The length in radians of a segment that counts as two observations; others by the square root of their length.
pub(super) const LENGTH_RAD: f64 = 0.2;

/// Standard deviation in radians of azimuth within which edges are those of one object and err together.
const OBJECT_RAD: f64 = 5f64.to_radians();

/// Sectors of azimuth whose residuals are taken as one for the covariance: of 15 degrees.
const SECTORS: usize = 24;

/// Leans of the grid, the best ones, of which the odds are summed exactly.
const BEST: usize = 6;

/// Most refits, and the change in radians at which they end.
const ITERATIONS: u32 = 8;
const TOLERANCE_RAD: f64 = 1e-4;

/// The search near the upright, ready for segments.
#[derive(Debug)]
pub(super) struct Near {
    robot_from_camera: Matrix3<f64>,
    tilt_max_rad: f64,
    /// Distance of neighbouring leans.
    step_rad: f64,
    leans: Vec<Lean>,
    options: SegmentsOptions,
}

/// The memory of one thread.
#[derive(Debug, Clone, Default)]
pub(super) struct NearWork {
    rows: Vec<Row>,
    /// The same for the grid.
    columns: Columns,
    scores: Vec<(f32, u32)>,
}

/// A lean that is tried to begin with.
#[derive(Debug, Clone, Copy)]
struct Lean {
    normal: [f32; 3],
    /// Logarithm of what was expected of it, up to a constant.
    prior: f32,
}

/// A segment that may be vertical, in the robot frame.
#[derive(Debug, Clone, Copy)]
struct Row {
    normal: Vector3<f64>,
    /// Variance of the angle by which the circle of a vertical edge misses the vertical.
    variance: f64,
    /// Odds at no distance, that the segment is of a direction near the vertical and not of any.
    odds: f64,
    weight: f64,
    azimuth: f64,
    /// Probability of being vertical, by the last fit.
    vertical: f64,
}

impl Row {
    /// Odds that it is of a direction that its circle misses by so much.
    fn odds_at(&self, distance: f64) -> f64 {
        self.odds * (-0.5 * distance * distance / self.variance).exp()
    }
}

/// What the rows of a sector of azimuth tell together.
#[derive(Debug, Clone, Copy, Default)]
struct Sector {
    information: Matrix2<f64>,
    score: Vector2<f64>,
}

/// Rows by their numbers, for the grid: normals, half the inverse variances, logarithms of the odds, weights.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    half: Vec<f32>,
    log_odds: Vec<f32>,
    weight: Vec<f32>,
}

impl Near {
    /// The leans up to the largest one, for a mounting.
    pub(super) fn new(robot_from_camera: &Matrix3<f64>, tilt_max_rad: f64, options: SegmentsOptions) -> Self {
        let step = tilt_max_rad / f64::from(GRID);
        let places = (-GRID..=GRID).flat_map(|i| (-GRID..=GRID).map(move |k| (i, k)));
        let within = places.filter(|(i, k)| i * i + k * k <= GRID * GRID);
        let leans = within.map(|(i, k)| {
            let (x, y) = (f64::from(i) * step, f64::from(k) * step);
            let lean = x.hypot(y);
            let sine = if lean > 0.0 { lean.sin() / lean } else { 1.0 };
            let prior = -0.5 * (lean / (LEAN_SIGMA * tilt_max_rad)).powi(2);
            Lean { normal: [(x * sine) as f32, (y * sine) as f32, lean.cos() as f32], prior: prior as f32 }
        });
        Self { robot_from_camera: *robot_from_camera, tilt_max_rad, step_rad: step, leans: leans.collect(), options }
    }

    /// Takes the longest segments that may be vertical, with their odds and weights.
    fn weigh(&self, segments: &Segments, weighed: &mut Vec<(u32, f64)>, rows: &mut Vec<Row>) {
        let limit = (self.tilt_max_rad + BEYOND_RAD).min(FRAC_PI_2).sin();
        weighed.clear();
        rows.clear();
        let up = self.robot_from_camera.transpose() * Vector3::z();
        for (i, segment) in segments.list.iter().enumerate() {
            if segment.normal.dot(&up).abs() >= limit || rows.len() == self.options.segments_max {
                continue;
            }
            let middle = self.robot_from_camera * segment.middle;
            let variance = segment.variance_at(&up) + self.options.scatter_rad.powi(2);
            // An edge that is seen near a direction passes through it by chance more often.
            let chance = (1.0 - middle.z * middle.z).max(1e-3).sqrt();
            rows.push(Row {
                normal: self.robot_from_camera * segment.normal,
                variance,
                odds: EVEN_RAD * chance / variance.sqrt(),
                weight: 2.0 * (segment.length_rad / LENGTH_RAD).sqrt(),
                azimuth: middle.y.atan2(middle.x),
                vertical: 0.0,
            });
            weighed.push((i as u32, 0.0));
        }
        // Edges of one object err together: they share the information of the strongest.
        for i in 0..rows.len() {
            let Row { azimuth, variance, .. } = rows[i];
            let together: f64 = rows
                .iter()
                .filter_map(|row| {
                    let apart = (row.azimuth - azimuth).abs();
                    let turns = apart.min(2.0 * PI - apart) / OBJECT_RAD;
                    // Beyond, the share is below a three-thousandth.
                    (turns < 4.0).then(|| (-0.5 * turns * turns).exp() / row.variance)
                })
                .sum();
            rows[i].weight /= (together * variance).sqrt();
        }
    }

    /// The normal of the lean with the greatest sum of odds.
    fn best_of_grid(&self, work: &mut NearWork) -> Option<Vector3<f64>> {
        let NearWork { rows, columns, scores } = work;
        columns.fill(rows, 0.5 * self.step_rad);
        scores.clear();
        scores.extend(
            self.leans.iter().enumerate().map(|(i, lean)| (lean.prior + columns.score(&lean.normal), i as u32)),
        );
        scores.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let exact = |i: u32| {
            let lean = &self.leans[i as usize];
            let normal = Vector3::from(lean.normal.map(f64::from));
            let sum: f64 = rows.iter().map(|row| row.weight * row.odds_at(row.normal.dot(&normal)).ln_1p()).sum();
            (sum + f64::from(lean.prior), normal)
        };
        let best = scores.iter().take(BEST).map(|(_, i)| exact(*i)).max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(best.1)
    }

    /// The lean with the greatest sum of odds, then reweighted least squares.
    ///
    /// `weighed` becomes the numbers of the segments that were weighed, with their probabilities of being vertical.
    pub(super) fn fit(&self, segments: &Segments, weighed: &mut Vec<(u32, f64)>, work: &mut NearWork) -> Fit {
        self.weigh(segments, weighed, &mut work.rows);
        let failed = Fit::failed;
        if work.rows.len() < 2 {
            return failed(Stop::TooFew { have: work.rows.len(), need: 2 });
        }
        let Some(mut normal) = self.best_of_grid(work) else { return failed(Stop::NoModel { trials: 0 }) };
        let rows = &mut work.rows;

        // In the tangent plane of the upright: `normal = (x, y, 1)`, scaled.
        let mut stop = Stop::IterationLimit { limit: ITERATIONS, change: f64::INFINITY };
        let mut iterations = 0;
        while iterations < ITERATIONS {
            iterations += 1;
            let (mut information, mut pull) = (Matrix2::zeros(), Vector2::zeros());
            for row in rows.iter_mut() {
                let odds = row.odds_at(row.normal.dot(&normal));
                row.vertical = odds / (1.0 + odds);
                let weight = row.weight * row.vertical / row.variance;
                let slope = row.normal.xy();
                information += slope * slope.transpose() * weight;
                pull += slope * (weight * row.normal.z);
            }
            let Some(inverse) = inverse_of_positive(&information) else {
                return failed(Stop::NoModel { trials: iterations });
            };
            let lean = -(inverse * pull);
            let next = Vector3::new(lean.x, lean.y, 1.0).normalize();
            let change = (next - normal).norm();
            normal = next;
            if change < TOLERANCE_RAD {
                stop = Stop::Converged { iterations, change, tolerance: TOLERANCE_RAD };
                break;
            }
            stop = Stop::IterationLimit { limit: ITERATIONS, change };
        }
        let Some(tilt) = Tilt::from_normal(&normal) else { return failed(Stop::NoModel { trials: iterations }) };
        if tilt.alpha_rad() > self.tilt_max_rad + BEYOND_RAD {
            let (angle_rad, limit_rad) = (tilt.alpha_rad(), self.tilt_max_rad);
            return failed(Stop::OutOfReach { angle_rad, limit_rad });
        }
        let (mut squares, mut total) = (0.0, 0.0);
        let mut sectors = [Sector::default(); SECTORS];
        let mut curvature = Matrix2::zeros();
        for row in rows.iter() {
            let distance = row.normal.dot(&normal);
            squares += row.weight * row.vertical * distance * distance;
            total += row.weight * row.vertical;
            let (slope, weight) = (row.normal.xy(), row.weight * row.vertical / row.variance);
            let information = slope * slope.transpose() * weight;
            let sector = ((row.azimuth / (2.0 * PI) + 0.5) * SECTORS as f64) as usize;
            let own = &mut sectors[sector.min(SECTORS - 1)];
            own.information += information;
            own.score += slope * (weight * distance);
            // Odds fall with the distance: what is far off bends the sum the other way.
            curvature += information * (1.0 - (1.0 - row.vertical) * distance * distance / row.variance);
        }
        // The least squares of errors that those of one sector share, and the pull of one unnoticed segment; see
        // `confidence::clustered_covariance`.
        let held = || sectors.iter().filter(|sector| sector.information.trace() > 0.0);
        let total_information: f64 = held().map(|sector| sector.information.trace()).sum();
        let pooled = held().map(|sector| sector.score.norm_squared() / sector.information.trace()).sum::<f64>();
        let squares_of = held().map(|sector| sector.information * sector.information).sum::<Matrix2<f64>>();
        let clutter = 1.0 / self.options.scatter_rad;
        let covariance = inverse_of_positive(&curvature).map(|inverse| {
            let spread = squares_of * (pooled / total_information) + Matrix2::identity() * (clutter * clutter);
            // From the plane of `(x, y, 1)` to the tangent plane of the normal.
            let plane = tangent_basis(&normal).transpose().fixed_columns::<2>(0) * normal.z;
            let covariance = plane * (inverse * spread * inverse) * plane.transpose();
            0.5 * (covariance + covariance.transpose()) + Matrix2::identity() * (FLOOR_RAD * FLOOR_RAD)
        });
        for (row, (_, vertical)) in rows.iter().zip(weighed.iter_mut()) {
            *vertical = row.vertical;
        }
        let inliers = weighed.iter().filter(|(_, vertical)| *vertical > 0.5);
        let inliers = inliers.map(|(i, _)| segments.list[*i as usize].support()).sum();
        let rms = (squares / total).sqrt();
        Fit { tilt: Some(tilt), covariance, inliers, rms, iterations, ..failed(stop) }.settled()
    }
}

impl Columns {
    /// The rows, with variances that are as much greater as half a step of the grid makes them.
    fn fill(&mut self, rows: &[Row], half_step: f64) {
        self.clear();
        for row in rows {
            let variance = row.variance + half_step * half_step;
            self.push(&row.normal, variance, row.odds * (row.variance / variance).sqrt(), row.weight);
        }
    }

    /// Removes all rows and keeps the memory.
    pub(super) fn clear(&mut self) {
        let Self { x, y, z, half, log_odds, weight } = self;
        [x, y, z, half, log_odds, weight].into_iter().for_each(Vec::clear);
    }

    /// Appends a row with the odds that it has at no distance.
    pub(super) fn push(&mut self, normal: &Vector3<f64>, variance: f64, odds: f64, weight: f64) {
        self.x.push(normal.x as f32);
        self.y.push(normal.y as f32);
        self.z.push(normal.z as f32);
        self.half.push((0.5 / variance) as f32);
        self.log_odds.push(odds.ln() as f32);
        self.weight.push(weight as f32);
    }

    /// Sum of the weighted logarithms of the odds of a lean, of those above even.
    pub(super) fn score(&self, normal: &[f32; 3]) -> f32 {
        let mut lanes = [0.0f32; 8];
        let Self { x, y, z, half, log_odds, weight } = self;
        let n = x.len();
        let (y, z, half, log_odds, weight) = (&y[..n], &z[..n], &half[..n], &log_odds[..n], &weight[..n]);
        for i in 0..n {
            let distance = x[i] * normal[0] + y[i] * normal[1] + z[i] * normal[2];
            lanes[i % 8] += weight[i] * (log_odds[i] - distance * distance * half[i]).max(0.0);
        }
        lanes.iter().sum()
    }
}
