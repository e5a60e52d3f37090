//! Landmarks whose bearings are those of two places: things of one name, or tracks that went on along another line.

use super::attempts::solved;
use super::incremental::NamedProblem;
use super::log::{LogBearing, SortedLog};
use super::triangulation::triangulated;
use crate::error::Result;
use crate::selfcalib::bundle::{BundleProblem, DescentReport};
use crate::selfcalib::model::{BearingLoss, OUTLIER_SIGMAS, Viewpoint};

/// Bearings that tell another place: enough that by chance no mistaken ones agree on it, and for a scatter of their own.
const LEAST_BEARINGS: usize = 12;

/// Standard deviations within which they agree on it before the log is solved with it: poses may still be bent by both places, and a
/// direction that is wrong by chance is as near once in sixty times at half a degree.
const AGREEING_SIGMAS: f64 = 6.0;

/// Share of the bearings of each place that may not fit it: single strays may be among them, another place's may not.
const OUTLIER_SHARE: f64 = 0.1;

/// Most rounds in which each bearing goes to the place that it fits better, as in k-means: nearly all do in the first.
const ROUNDS: usize = 3;

/// Takes landmarks apart whose bearings are those of two places, and solves the log again. Returns their identifiers.
///
/// # Errors
/// Those of [`solved`].
pub(super) fn take_apart(
    named: &mut NamedProblem,
    descent: &mut DescentReport,
    log: &SortedLog<'_>,
) -> Result<Vec<u64>> {
    let problem = &named.problem;
    let has_outliers = |landmark: &usize| bearings(problem, *landmark, is_outlier).len() >= LEAST_BEARINGS;
    let suspects: Vec<u64> =
        (0..problem.landmarks.len()).filter(has_outliers).map(|landmark| named.names[landmark]).collect();
    // More noise than told, or a bump, makes outliers of all landmarks.
    let are_most = 2 * suspects.len() > problem.landmarks.len();
    if suspects.is_empty() || are_most || problem.noise_factors().bearings > 1.0 {
        return Ok(Vec::new());
    }
    let mut merged = Vec::new();
    let mut log = log.clone();
    for name in suspects {
        if let Some((apart, found, how)) = apart(named, &log, name)? {
            (*named, *descent, log) = (apart, how, found);
            merged.push(name);
        }
    }
    Ok(merged)
}

fn is_outlier(residual: f64) -> bool {
    residual > OUTLIER_SIGMAS
}

/// The log with another landmark for a part of the bearings of one, solved, if enough of its outliers agree on one place and the
/// bearings of both fit then.
fn apart<'a>(
    named: &NamedProblem,
    log: &SortedLog<'a>,
    name: u64,
) -> Result<Option<(NamedProblem, SortedLog<'a>, DescentReport)>> {
    let Some(landmark) = named.names.iter().position(|own| *own == name) else { return Ok(None) };
    let outliers = bearings(&named.problem, landmark, is_outlier);
    if outliers.len() < LEAST_BEARINGS {
        return Ok(None);
    }
    let (mut problem, o) = (named.problem.clone(), &log.options.filter);
    let place = triangulated(&problem, o, &outliers).0;
    let mut second = problem.add_landmark(place, -o.start_distance_m.ln(), o.start_distance_log_sigma);
    assign(&mut problem, [landmark, second]);
    if bearings(&problem, second, |residual| residual <= AGREEING_SIGMAS).len() < LEAST_BEARINGS {
        return Ok(None);
    }
    let mut of_second = name;
    while named.names.contains(&of_second) {
        of_second = of_second.wrapping_add(1);
    }
    let mut last = None;
    for _ in 0..ROUNDS {
        let is_second = |seen: &LogBearing| {
            let keyframe = problem.keyframes.get(named.keyframes[seen.step]);
            keyframe.is_some_and(|keyframe| keyframe.observations.iter().any(|own| own.landmark == second))
        };
        let ours = |seen: &LogBearing| [name, of_second].contains(&seen.landmark);
        let log = log.renamed(|seen| match (ours(seen), is_second(seen)) {
            (true, true) => of_second,
            (true, false) => name,
            _ => seen.landmark,
        });
        // A name of which no bearing is left has no landmark.
        let Some((found, descent)) = solved(&log)? else { break };
        let at = |name: u64| found.names.iter().position(|own| *own == name);
        let (Some(first), Some(other)) = (at(name), at(of_second)) else { break };
        let mut again = found.problem.clone();
        let changed = assign(&mut again, [first, other]);
        (problem, second) = (again, other);
        last = Some((found, log, descent, [first, other]));
        if !changed {
            break;
        }
    }
    // What fits a second place must be worth what it costs as outliers.
    let worth = LEAST_BEARINGS as f64 * BearingLoss::Truncated(OUTLIER_SIGMAS).cost(f64::INFINITY);
    Ok(last.and_then(|(found, log, descent, pair)| {
        let fits = pair.iter().all(|place| {
            let [outliers, all] =
                [is_outlier, |_| true].map(|such: fn(f64) -> bool| bearings(&found.problem, *place, such).len() as f64);
            outliers <= OUTLIER_SHARE * all
        });
        (fits && descent.cost + worth < named.problem.cost()).then_some((found, log, descent))
    }))
}

/// Keyframes and angles of the bearings of a landmark with such sizes of their whitened residuals. Lines of images scatter, each in its
/// way, and are not two places for that.
fn bearings(problem: &BundleProblem, landmark: usize, such: impl Fn(f64) -> bool) -> Vec<(usize, f64)> {
    let mut found = Vec::new();
    let point = problem.landmarks[landmark].homogeneous();
    for (at, keyframe) in problem.keyframes.iter().enumerate() {
        let Some(seen) = keyframe.observations.iter().find(|seen| seen.landmark == landmark) else { continue };
        let view = Viewpoint::new(&problem.observation_pose(at, &seen.along).0, &problem.mounting);
        let residual = view.residual(&point, &seen.about(&problem.centre).along);
        if such(residual.abs() / (problem.bearing_sigma * problem.scatters[landmark])) {
            found.push((at, seen.bearing));
        }
    }
    found
}

/// Gives each bearing of two landmarks to the one that it fits better. Returns whether one changed.
fn assign(problem: &mut BundleProblem, pair: [usize; 2]) -> bool {
    let places = pair.map(|landmark| problem.landmarks[landmark].homogeneous());
    let mut changed = false;
    for at in 0..problem.keyframes.len() {
        let Some(k) = problem.keyframes[at].observations.iter().position(|seen| pair.contains(&seen.landmark)) else {
            continue;
        };
        let seen = problem.keyframes[at].observations[k];
        let view = Viewpoint::new(&problem.observation_pose(at, &seen.along).0, &problem.mounting);
        let [first, second] = places.map(|place| view.residual(&place, &seen.about(&problem.centre).along).abs());
        let nearer = pair[usize::from(second < first)];
        changed |= nearer != seen.landmark;
        problem.keyframes[at].observations[k].landmark = nearer;
    }
    changed
}
