//! Several starts of the bundle adjustment of a whole log, of which the best solution counts.

use std::collections::BTreeMap;

use super::descent::{TOLERANCE, solve};
use super::incremental::{NamedProblem, incremental_problem, problem_along};
use super::log::{LogOptions, SortedLog};
use crate::error::Result;
use crate::selfcalib::bundle::{BundleProblem, DescentReport, FIRST_DAMPING, FreeParameters};
use crate::selfcalib::model::{OUTLIER_SIGMAS, Wheels};
use crate::selfcalib::options::{CalibrationMethod, SelfCalibratorOptions};
use crate::selfcalib::window::SlidingWindow;

/// Share of outliers of a converged solution up to which no other start is tried: as many as single wrong bearings make. A solution
/// with a loop that did not close has more.
const OUTLIER_SHARE: f64 = 0.03;

/// Where an attempt starts, and what is free until the loops are closed.
#[derive(Clone, Copy)]
pub(super) enum Attempt {
    /// The start of the options. Wheels that may give a little let loops close.
    FreeWheels,
    /// The mounting and the poses of the sliding window.
    Window,
    /// The start of the options.
    Start,
    /// The mounting of the log without loops, for a start that is far off. Wheels as in the first attempt.
    WithoutLoops,
}

/// The best solution of several starts.
pub(super) fn solved(log: &SortedLog<'_>) -> Result<Option<(NamedProblem, DescentReport)>> {
    let options = log.options;
    let mut best: Option<(NamedProblem, DescentReport)> = None;
    for attempt in [Attempt::FreeWheels, Attempt::Window, Attempt::Start, Attempt::WithoutLoops] {
        if matches!(attempt, Attempt::Start) && options.estimate_odometry {
            // The wheels were free in the first attempt and would be again.
            continue;
        }
        if matches!(attempt, Attempt::Window)
            && best.as_ref().is_some_and(|(best, _)| best.problem.contradictions().most_turns())
        {
            // No start mends an odometry that turns otherwise, and the filter's is the dearest.
            continue;
        }
        let mut named = started(log, attempt)?;
        let descent = solve(&mut named.problem, options.max_iterations);
        let residuals = named.problem.residuals();
        let outliers = residuals.iter().filter(|r| r.abs() > OUTLIER_SIGMAS).count();
        let good = descent.converged && (outliers as f64) < OUTLIER_SHARE * residuals.len() as f64;
        if descent.cost.is_finite() && best.as_ref().is_none_or(|(_, best)| descent.cost < best.cost) {
            best = Some((named, descent));
        }
        if good {
            break;
        }
    }
    Ok(best.map(|(named, descent)| with_rolling_shutter(named, descent, options)))
}

/// A solution with the rolling shutter free where the options ask for it.
fn with_rolling_shutter(
    mut named: NamedProblem,
    solved: DescentReport,
    options: &LogOptions,
) -> (NamedProblem, DescentReport) {
    if !options.estimate_rolling_shutter {
        return (named, solved);
    }
    named.problem = named.problem.with_free(FreeParameters { shutter: true, ..named.problem.free });
    let descent = solve(&mut named.problem, options.max_iterations);
    (named, descent)
}

/// The problem that an attempt starts from, with the parameters free that the options ask for.
pub(super) fn started(log: &SortedLog<'_>, attempt: Attempt) -> Result<NamedProblem> {
    let options = log.options;
    let asked = FreeParameters {
        wheels: options.estimate_odometry,
        offset: options.estimate_time_offset,
        centre: options.estimate_centre,
        // Freed once the rest is solved: of a few keyframes it explains anything.
        shutter: false,
        creep: false,
    };
    let with_wheels = FreeParameters { wheels: true, ..asked };
    let start = options.filter.start.vector();
    let mut named = match attempt {
        Attempt::FreeWheels => incremental_problem(log, &start, with_wheels, true),
        Attempt::Window => return Ok(problem_along(log, &whole_window(log)?, asked)),
        Attempt::Start => return Ok(incremental_problem(log, &start, asked, true)),
        Attempt::WithoutLoops => {
            let mounting = incremental_problem(log, &start, with_wheels, false).problem.mounting;
            incremental_problem(log, &mounting, with_wheels, true)
        }
    };
    if asked != with_wheels {
        named.problem.levenberg_marquardt_carrying(options.max_iterations, TOLERANCE, FIRST_DAMPING);
        named.problem = named.problem.with_fixed_wheels(Wheels::new(options.filter.wheel_base_m));
    }
    Ok(named)
}

/// The problem of a sliding window that is never marginalised.
fn whole_window(log: &SortedLog<'_>) -> Result<BundleProblem> {
    let method = CalibrationMethod::Default;
    let mut window =
        SlidingWindow::new(&SelfCalibratorOptions { method, keyframes_max: u32::MAX, ..log.options.filter })?;
    for step in log.steps() {
        let mut seen: BTreeMap<u64, f64> = BTreeMap::new();
        for b in step.bearings {
            seen.entry(b.landmark).or_insert(b.bearing_rad);
        }
        let seen: Vec<(u64, f64)> = seen.into_iter().collect();
        window.step(step.reading, &seen);
    }
    Ok(window.into_problem())
}
