//! The mounting from a whole log at once: robust sparse least squares, optionally with the wheels and a time offset.

use std::collections::BTreeMap;

use nalgebra::Matrix3;

use super::calibrator::MountingEstimate;
use super::dense::Factor;
use super::descent::Descent;
use super::graph::{Free, Graph};
use super::growing::{FIRST, along, grown};
use super::log::{LogBearing, LogOptions, check};
use super::loss::{LIMIT, Loss};
use super::mounting::Mounting;
use super::odometry::{WheelMotion, Wheels};
use super::options::{CalibrationMethod, SelfCalibratorOptions};
use super::recursive::Recursive;
use crate::error::{Error, Result};

/// The mounting, and what else was estimated, from a whole log.
#[derive(Debug, Clone, PartialEq)]
pub struct LogCalibration {
    /// The mounting. Covariances are scaled by the residuals where these are larger than assumed.
    pub estimate: MountingEstimate,
    /// The wheels as they were given, or as estimated.
    pub wheels: Wheels,
    /// Standard deviations of the wheels' imbalance and of the wheel base in metres; 0 where not estimated.
    pub wheels_sigma: [f64; 2],
    /// By how much bearings are later than the odometry, seconds; 0 where not estimated.
    pub time_offset_s: f64,
    /// Standard deviation of it.
    pub time_offset_sigma_s: f64,
    /// Bearings that were used, those taken at a standstill but the first left out.
    pub bearings: usize,
    /// Bearings farther from their prediction than 4.5 standard deviations, which count for nothing.
    pub outliers: usize,
    /// Root of the mean squared residual of the others, in standard deviations of a bearing.
    pub residual_rms: f64,
    /// Linearisations.
    pub iterations: u32,
    /// Whether the descent came to rest.
    pub converged: bool,
}

/// Fall of the cost below which the descent has come to rest.
const TOLERANCE: f64 = 1e-3;

/// How often landmarks are weighed by how far their bearings scatter.
const JUDGEMENTS: usize = 4;

/// Share of outliers of a solution beside which no other is looked for.
const FEW: f64 = 0.03;

/// Where an attempt takes its first guess of the mounting from.
#[derive(Clone, Copy)]
enum Guess {
    /// The options.
    Start,
    /// The log without loops.
    Open,
    /// The default filter, poses too.
    Filter,
}

/// The mounting from a whole log.
///
/// # Errors
/// [`Error::InvalidOption`] for options that make no sense, [`Error::InvalidArgument`] for numbers that are not finite, steps
/// that do not exist, times that do not grow or are missing, and logs without a landmark that is seen twice.
pub fn calibrate_log(
    options: &LogOptions,
    readings: &[WheelMotion],
    times_s: Option<&[f64]>,
    bearings: &[LogBearing],
) -> Result<LogCalibration> {
    options.filter.validate()?;
    check(options, readings, times_s, bearings)?;
    let mut order: Vec<LogBearing> = bearings.to_vec();
    order.sort_by_key(|b| b.step);
    let asked = Free { wheels: options.estimate_odometry, offset: options.estimate_time_offset };
    let mut best: Option<(Graph, Descent)> = None;
    let start = options.filter.start.vector();
    let with_wheels = Free { wheels: true, ..asked };
    // Wheels that may give a little let loops close; a start far off may need a map without loops, or the filter's answer.
    let attempts =
        [(with_wheels, Guess::Start), (asked, Guess::Filter), (asked, Guess::Start), (with_wheels, Guess::Open)];
    for (i, (free, guess)) in attempts.into_iter().enumerate() {
        if i == 2 && asked == with_wheels {
            continue;
        }
        let mut graph = match guess {
            Guess::Start => grown(options, &start, free, true, readings, times_s, &order),
            Guess::Open => {
                let open = grown(options, &start, free, false, readings, times_s, &order).mounting;
                grown(options, &open, free, true, readings, times_s, &order)
            }
            Guess::Filter => {
                let found = filtered(options, readings, &order)?;
                along(options, &found, free, readings, times_s, &order)
            }
        };
        if free != asked {
            graph.descend(options.max_iterations, TOLERANCE, 1e-3);
            graph = graph.with_fixed_wheels(Wheels::new(options.filter.wheel_base_m));
        }
        let first = graph.descend(options.max_iterations, TOLERANCE, 1e-3);
        graph.loss = Loss::Cut(LIMIT);
        let mut then = graph.descend(options.max_iterations, TOLERANCE, 1e-3);
        let mut iterations = first.iterations + then.iterations;
        for _ in 0..JUDGEMENTS {
            if !graph.weigh_landmarks() {
                break;
            }
            for loss in [FIRST, Loss::Cut(LIMIT)] {
                graph.loss = loss;
                then = graph.descend(options.max_iterations, TOLERANCE, 1e-3);
                iterations += then.iterations;
            }
        }
        let descent = Descent { iterations, ..then };
        let residuals = graph.residuals();
        let outliers = residuals.iter().filter(|r| r.abs() > LIMIT).count();
        let good = descent.converged && (outliers as f64) < FEW * residuals.len() as f64;
        if descent.cost.is_finite() && best.as_ref().is_none_or(|(_, best)| descent.cost < best.cost) {
            best = Some((graph, descent));
        }
        if good {
            break;
        }
    }
    let Some((graph, descent)) = best else {
        return Err(Error::argument("bearings", "a problem without a solution", "a drive past landmarks"));
    };
    report(options, &graph, &descent)
}

/// What the default filter makes of the log if it forgets nothing: its poses and the mounting.
fn filtered(options: &LogOptions, readings: &[WheelMotion], order: &[LogBearing]) -> Result<Graph> {
    let method = CalibrationMethod::Default;
    let mut filter = Recursive::new(&SelfCalibratorOptions { method, memory: u32::MAX, ..options.filter })?;
    let mut rest = order;
    for (step, reading) in readings.iter().enumerate() {
        let (now, later) = rest.split_at(rest.partition_point(|b| b.step <= step));
        rest = later;
        let mut seen: BTreeMap<u64, f64> = BTreeMap::new();
        for b in now {
            seen.entry(b.landmark).or_insert(b.bearing_rad);
        }
        let seen: Vec<(u64, f64)> = seen.into_iter().collect();
        filter.step(reading, &seen);
    }
    Ok(filter.into_graph())
}

fn report(options: &LogOptions, graph: &Graph, descent: &Descent) -> Result<LogCalibration> {
    let o = &options.filter;
    let residuals = graph.residuals();
    let kept: Vec<f64> = residuals.iter().copied().filter(|r| r.abs() <= LIMIT).collect();
    let free = kept.len().saturating_sub(graph.width()).max(1) as f64;
    let sum: f64 = kept.iter().map(|r| r * r).sum();
    let scale = (sum / free).max(1.0);
    let nothing =
        || Error::argument("bearings", "a drive that determines nothing", "landmarks seen from several poses");
    let eliminated = graph.eliminate(graph.nodes.len() - 1, false, 0.0).ok_or_else(nothing)?;
    let covariance = Factor::touched(eliminated.information.clone()).ok_or_else(nothing)?.inverse();
    let widening = graph.widening(&eliminated, &covariance);
    let covariance = covariance * scale;
    let mounting: Matrix3<f64> = covariance.fixed_view::<3, 3>(0, 0).into();
    let sigma = |at: usize| covariance[(at, at)].sqrt();
    let (wheels, offset) = (options.estimate_odometry, options.estimate_time_offset);
    Ok(LogCalibration {
        estimate: MountingEstimate::new(
            Mounting::from_vector(&graph.mounting),
            widening * mounting * widening.transpose(),
            &(o.start_covariance * scale),
            Some(sum / kept.len().max(1) as f64),
            false,
        ),
        wheels: graph.wheels,
        wheels_sigma: if wheels { [sigma(3), sigma(4) * graph.wheels.base_m] } else { [0.0; 2] },
        time_offset_s: graph.offset_s,
        time_offset_sigma_s: if offset { sigma(if wheels { 5 } else { 3 }) } else { 0.0 },
        bearings: residuals.len(),
        outliers: residuals.len() - kept.len(),
        residual_rms: (sum / kept.len().max(1) as f64).sqrt(),
        iterations: descent.iterations,
        converged: descent.converged,
    })
}
