//! The method of straight edges: the vertical by the odds that each segment of the image passes through it, fused with the vote of
//! the edge pixels.

mod anywhere;
mod choice;

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use self::anywhere::{Edge, Prior, Search};
use super::refined::{Refined, TILT_MAX_RAD};
use super::{Fitter, Prepared, RefineOptions, Setting, TiltMethod, edge_offset};
use crate::edges::{EdgeOptions, EdgePixels, RidgePixels};
use crate::error::{Error, Result};
use crate::geometry::{Tilt, tangent_basis};
use crate::image::ImageView;
use crate::options;
use crate::options::Between;
use crate::robust::Stop;
use crate::segments::{FinderScratch, SegmentDetectorOptions, SegmentFinder, SegmentOptions, Segments};
use crate::tilt::confidence::inverse_of_positive;
use crate::tilt::estimate::{ALTERNATIVES, Alternative, EdgeElement, TiltEstimate};
use crate::tilt::fit::{Fit, Seen};
use crate::tilt::scratch::{Scratch, Work};
use crate::tilt::tables::PixelTables;
use crate::tilt::trust::Trust;

options! {
    /// Options of the method of straight edges.
    #[derive(Copy)]
    pub struct SegmentsOptions {
        /// What a straight edge is: from 8 pixels on, for at the rim of an upward view doors are no longer.
        [flat] segments: SegmentOptions = SegmentOptions { support_min_px: 8, ..SegmentOptions::default() };
        /// Standard deviation in radians by which the edges of vertical things miss the vertical.
        scatter_rad: f64 = 0.6f64.to_radians() => Between(0.0, 1.0), "an angle strictly between 0 and 1 radian";
        /// The most segments that are weighed, the longest ones.
        segments_max: usize = 64 => 2.0..=1e6, "a whole number from 2 to 1000000";
    }
}

/// How far beyond the largest lean the circles of segments may pass: five times their usual scatter.
const BEYOND_RAD: f64 = 3f64.to_radians();

/// Leans from the upright to the largest one that are tried to begin with: steps of a degree by default.
const GRID: i32 = 12;

/// Standard deviation of the leans that are expected before the image is seen, in largest leans: 5 degrees by default.
const LEAN_SIGMA: f64 = 5.0 / 12.0;

/// The largest lean up to which edges near the vertical are looked at alone. Beyond it those of horizontal things may be as near,
/// and frames of three directions are weighed.
const NEAR_MAX_RAD: f64 = 20f64.to_radians();

/// Least probability of being the right one of all alternatives, below which there is no answer.
const PROBABILITY_MIN: f64 = 0.5;

/// The scatter in radians at which a segment that passes through a direction is as likely to be of it as any other.
const EVEN_RAD: f64 = 3f64.to_radians();

/// The length in radians of a segment that counts as two observations; others by the square root of their length.
const LENGTH_RAD: f64 = 0.2;

/// Standard deviation in radians of azimuth within which edges are those of one object and err together.
const OBJECT_RAD: f64 = 5f64.to_radians();

/// Sectors of azimuth whose residuals are taken as one for the covariance: of 15 degrees.
const SECTORS: usize = 24;

/// Standard deviation in radians of what no image tells, a side: half the median error on every second location of 108 panoramas.
const FLOOR_RAD: f64 = 0.1f64.to_radians();

/// Standard deviation in radians, a side, by which the vote of the pixels errs beside what its covariance tells, by normals that
/// are told by the gradients of single pixels: set on the same locations.
const PIXELS_RAD: f64 = 0.7f64.to_radians();

/// By how much the variance of a frame exceeds what its edges tell as if each erred on its own: with it, 87 % of the errors below
/// five degrees are within the 90 % regions in 648 views of panoramas, the same ones on which it was set.
const ANYWHERE_GROWTH: f64 = 4.0;

/// Leans of the grid, the best ones, of which the odds are summed exactly.
const BEST: usize = 6;

/// Most refits, and the change in radians at which they end.
const ITERATIONS: u32 = 8;
const TOLERANCE_RAD: f64 = 1e-4;

/// How a fit tells whether it is of the vertical: `tiltvp measure trust --weights` prints it.
static TRUST: Trust = Trust { constant: 6.782, weights: [-1.164, 2.173, 1.694, 0.317, -0.112, 0.615, -0.279, -1.218] };

impl TiltMethod for SegmentsOptions {
    fn edges(&self) -> EdgeOptions {
        SegmentDetectorOptions::default().edges
    }

    fn tilt_limit_rad(&self) -> f64 {
        PI
    }

    fn prepare(&self, setting: &Setting<'_>) -> Result<Prepared> {
        let Setting { origin, options, pixels } = *setting;
        if origin.row_stride != 1 {
            return Err(Error::option(
                "row_stride",
                origin.row_stride,
                "1: straight edges are followed from row to row",
            ));
        }
        SegmentFinder::check_margin(&origin.options)?;
        let finder = SegmentFinder::new(&origin.camera, &pixels.region, self.segments);
        let refined = RefineOptions::default();
        let usual = refined.edges();
        let heights = usual.elevation_min_rad.sin()..=usual.elevation_max_rad.sin();
        let in_band = pixels.region.pixels().map(|(_, _, bearing)| heights.contains(&bearing.z)).collect();
        let tilt_max_rad = options.tilt_max_rad.unwrap_or(TILT_MAX_RAD);
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
        Ok(Prepared::Segments(Arc::new(SegmentFit {
            finder,
            edges: origin.options,
            robot_from_camera: origin.robot_from_camera,
            tilt_max_rad,
            step_rad: step,
            leans: leans.collect(),
            pixels: Refined::new(setting, refined),
            strong: usual,
            in_band,
            options: *self,
        })))
    }
}

/// The method ready for images.
#[derive(Debug)]
pub(in crate::tilt) struct SegmentFit {
    finder: SegmentFinder,
    edges: EdgeOptions,
    robot_from_camera: Matrix3<f64>,
    tilt_max_rad: f64,
    /// Distance of neighbouring leans.
    step_rad: f64,
    leans: Vec<Lean>,
    /// The method of the pixels, and which of them vote.
    pixels: Refined,
    strong: EdgeOptions,
    /// Whether each pixel of the region is in the band of elevations of those that vote.
    in_band: Vec<bool>,
    options: SegmentsOptions,
}

/// A lean that is tried to begin with.
#[derive(Debug, Clone, Copy)]
struct Lean {
    normal: [f32; 3],
    /// Logarithm of what was expected of it, up to a constant.
    prior: f32,
}

/// The memory of one thread.
#[derive(Debug, Clone)]
pub(in crate::tilt) struct SegmentWork {
    finder: FinderScratch,
    segments: Segments,
    /// The pixels that vote.
    strong: EdgePixels,
    /// Of the segments that are weighed: their numbers, and the probability of being vertical by the last fit.
    weighed: Vec<(u32, f64)>,
    search: Search,
    rows: Vec<Row>,
    /// The same for the grid.
    columns: Columns,
    scores: Vec<(f32, u32)>,
}

impl SegmentWork {
    /// The directions that may be up in the last image, and what tells which one is.
    pub(in crate::tilt) fn hypotheses(&self) -> Vec<(Vector3<f64>, Vec<f64>)> {
        self.search.hypotheses.iter().map(|h| (h.up, h.features.to_vec())).collect()
    }
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

/// The fit to the segments with the vote of the pixels, by information. Where they differ by more than they may, the covariance
/// grows with the square of it (Birge 1932). The vote alone where the segments tell nothing.
fn fused(fit: &Fit, vote: &Fit) -> Fit {
    let (Some(tilt), Some(covariance)) = (fit.tilt, fit.covariance) else {
        return if vote.covariance.is_some() { Fit { inliers: fit.inliers, ..*vote } } else { *fit };
    };
    let (Some(other), Some(other_covariance)) = (vote.tilt, vote.covariance) else { return *fit };
    let basis = tangent_basis(&tilt.normal());
    let away = basis.transpose() * other.normal();
    let theirs = other_covariance + Matrix2::identity() * (PIXELS_RAD * PIXELS_RAD);
    let Some(inverse) = (covariance + theirs).try_inverse() else { return *fit };
    let gain = covariance * inverse;
    let normal = tilt.normal() + basis * (gain * away);
    // Its expectation is one.
    let disagreement = 0.5 * away.dot(&(inverse * away));
    let together = (Matrix2::identity() - gain) * covariance * disagreement.max(1.0);
    let symmetric = 0.5 * (together + together.transpose());
    Fit { tilt: Tilt::from_normal(&normal), covariance: Some(symmetric), ..*fit }
}

/// Rows by their numbers, for the grid: normals, half the inverse variances, logarithms of the odds, weights.
#[derive(Debug, Clone, Default)]
struct Columns {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    half: Vec<f32>,
    log_odds: Vec<f32>,
    weight: Vec<f32>,
}

impl SegmentFit {
    /// The tilt of an image.
    pub(in crate::tilt) fn estimate(
        &self,
        image: &ImageView<'_>,
        tables: &PixelTables,
        scratch: &mut Scratch,
    ) -> TiltEstimate {
        let region = &tables.region;
        let Scratch { work: pixel_work, segments, .. } = scratch;
        let work = segments.get_or_insert_with(|| {
            Box::new(SegmentWork {
                finder: self.finder.scratch(region, &self.edges),
                segments: Segments::default(),
                strong: EdgePixels::default(),
                weighed: Vec::new(),
                search: Search::default(),
                rows: Vec::new(),
                columns: Columns::default(),
                scores: Vec::new(),
            })
        });
        self.finder.find(image, region, self.edges.gradient_min, None, &mut work.finder, &mut work.segments);
        let fit = if self.tilt_max_rad > NEAR_MAX_RAD {
            self.fit_anywhere(work)
        } else {
            self.weigh(work);
            let fit = self.fit(work);
            fused(&fit, &self.vote(&work.finder.ridge, tables, &mut work.strong, pixel_work))
        };
        let considered = work.weighed.iter().map(|(i, _)| work.segments.list[*i as usize].support()).sum();
        let trust = (self.tilt_max_rad <= NEAR_MAX_RAD).then_some(&TRUST);
        let seen = Seen {
            edge_pixels: work.segments.points.len(),
            prefiltered_pixels: considered,
            pixels_per_rad: region.pixels_per_rad(),
            tilt_max_rad: self.tilt_max_rad,
            trust,
        };
        fit.into_estimate(&seen, &mut pixel_work.trusted)
    }

    /// The most probable of the directions that may be up, unless none is more probable than all others together.
    fn fit_anywhere(&self, work: &mut SegmentWork) -> Fit {
        let SegmentWork { segments, weighed, search, .. } = work;
        let turn = &self.robot_from_camera;
        search
            .take(segments.list.iter().map(|s| Edge::new(turn, &s.normal, &s.middle, s.variances_rad2, s.length_rad)));
        search.run(&Prior { reach_rad: self.tilt_max_rad, robot_from_camera: *turn });
        weighed.clear();
        let Some(best) = search.hypotheses.first() else {
            return Fit::failed(Stop::TooFew { have: search.edges.len(), need: 3 });
        };
        let shares = search.edges.iter().map(|edge| best.shares(edge)[2]);
        weighed.extend(shares.enumerate().map(|(i, share)| (i as u32, share)));
        let mut alternatives = [None; ALTERNATIVES];
        for (slot, hypothesis) in alternatives.iter_mut().zip(&search.hypotheses) {
            *slot = Some(Alternative { normal: hypothesis.up, probability: hypothesis.probability });
        }
        let (probability, limit) = (best.probability, PROBABILITY_MIN);
        if probability < limit {
            for (_, share) in weighed.iter_mut() {
                *share = 0.0;
            }
            let stop = Stop::Ambiguous { probability, limit, of: search.hypotheses.len() };
            return Fit { alternatives, ..Fit::failed(stop) };
        }
        let vertical = || search.edges.iter().zip(weighed.iter()).filter(|(_, (_, share))| *share > 0.5);
        let (mut squares, mut count) = (0.0, 0.0);
        for (edge, _) in vertical() {
            squares += edge.normal.dot(&best.up).powi(2);
            count += 1.0;
        }
        let floor = Matrix2::identity() * (FLOOR_RAD * FLOOR_RAD);
        Fit {
            tilt: Tilt::from_normal(&best.up),
            covariance: best.covariance().map(|covariance| covariance * ANYWHERE_GROWTH + floor),
            inliers: vertical().map(|(_, (i, _))| segments.list[*i as usize].support()).sum(),
            rms: (squares / count).sqrt(),
            iterations: search.hypotheses.len() as u32,
            alternatives,
            ..Fit::failed(Stop::Chosen { probability, of: search.hypotheses.len() })
        }
    }

    /// What the strong ridge pixels near the horizon say by their gradients.
    fn vote(&self, ridge: &RidgePixels, tables: &PixelTables, strong: &mut EdgePixels, work: &mut Work) -> Fit {
        let least = (self.strong.gradient_min * self.strong.gradient_min) as f32;
        strong.clear();
        let edges = &ridge.edges;
        for ((slot, gx), gy) in edges.slot().iter().zip(edges.gx()).zip(edges.gy()) {
            if gx * gx + gy * gy >= least && self.in_band[*slot as usize] {
                strong.push(&tables.region, *slot, *gx, *gy);
            }
        }
        self.pixels.fit(strong, tables, work)
    }

    /// Takes the longest segments that may be vertical, with their odds and weights.
    fn weigh(&self, work: &mut SegmentWork) {
        let SegmentWork { segments, weighed, rows, .. } = work;
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

    /// The lean with the greatest sum of odds, then reweighted least squares.
    fn fit(&self, work: &mut SegmentWork) -> Fit {
        let SegmentWork { segments, weighed, rows, columns, scores, .. } = work;
        let failed = Fit::failed;
        if rows.len() < 2 {
            return failed(Stop::TooFew { have: rows.len(), need: 2 });
        }
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
        let best = scores.iter().take(BEST).map(|(_, i)| exact(*i)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, mut normal)) = best else { return failed(Stop::NoModel { trials: 0 }) };

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

    /// The edge pixels of the segments of the last image, in their order.
    pub(in crate::tilt) fn elements(&self, centre: (f32, f32), scratch: &Scratch) -> Vec<EdgeElement> {
        let Some(work) = scratch.segments.as_deref() else { return Vec::new() };
        let SegmentWork { segments, weighed, .. } = work;
        let mut vertical = vec![None; segments.list.len()];
        for (i, share) in weighed {
            vertical[*i as usize] = Some(*share > 0.5);
        }
        let of_segment = |(segment, vertical): (&crate::segments::Segment, Option<bool>)| {
            let normal = (self.robot_from_camera * segment.normal).cast::<f32>().into();
            let points = segments.points_of(segment).iter();
            let elements = points.map(move |point| {
                let (u, v) = (point.pixel[0].round(), point.pixel[1].round());
                let [cos, sin, offset] = edge_offset(u - centre.0, v - centre.1, point.gradient[0], point.gradient[1]);
                EdgeElement {
                    u: u as u16,
                    v: v as u16,
                    phi_rad: f64::from(sin).atan2(f64::from(cos)),
                    offset_px: f64::from(offset),
                    normal,
                    prefiltered: vertical.is_some(),
                    inlier: vertical == Some(true),
                }
            });
            elements.collect::<Vec<_>>()
        };
        segments.list.iter().zip(vertical).flat_map(of_segment).collect()
    }
}

impl Columns {
    /// The rows, with variances that are as much greater as half a step of the grid makes them.
    fn fill(&mut self, rows: &[Row], half_step: f64) {
        let Self { x, y, z, half, log_odds, weight } = self;
        [&mut *x, &mut *y, &mut *z, &mut *half, &mut *log_odds, &mut *weight].into_iter().for_each(Vec::clear);
        for row in rows {
            let variance = row.variance + half_step * half_step;
            x.push(row.normal.x as f32);
            y.push(row.normal.y as f32);
            z.push(row.normal.z as f32);
            half.push((0.5 / variance) as f32);
            log_odds.push((row.odds * (row.variance / variance).sqrt()).ln() as f32);
            weight.push(row.weight as f32);
        }
    }

    /// Sum of the weighted logarithms of the odds of a lean, of those above even.
    fn score(&self, normal: &[f32; 3]) -> f32 {
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
