//! Landmarks whose bearings are those of two places: things of one name, or tracks that went on along another line.

use super::descent::solve;
use super::log::LogOptions;
use super::triangulation::triangulated;
use crate::selfcalib::bundle::{BundleProblem, DescentReport};
use crate::selfcalib::model::{BearingLoss, OUTLIER_SIGMAS, Viewpoint};

/// Bearings that tell another place: enough that by chance no mistaken ones agree on it, and for a scatter of their own.
const LEAST_BEARINGS: usize = 12;

/// Standard deviations within which they agree on it before the problem is solved with it.
const AGREEING_SIGMAS: f64 = 6.0;

/// Share of the bearings of each place that may not fit it.
const OUTLIER_SHARE: f64 = 0.1;

/// Most rounds in which each bearing goes to the place that it fits better, as in k-means: nearly all do in the first.
const ROUNDS: usize = 3;

/// Takes landmarks apart whose bearings are those of two places, and solves the problem again. Returns which they are; `None` if there
/// are none.
pub(super) fn solve_with_splits(
    problem: &mut BundleProblem,
    options: &LogOptions,
) -> Option<(DescentReport, Vec<usize>)> {
    let has_outliers = |landmark: &usize| bearings(problem, *landmark, is_outlier).len() >= LEAST_BEARINGS;
    let suspects: Vec<usize> = (0..problem.landmarks.len()).filter(has_outliers).collect();
    // More noise than told, or a bump, makes outliers of all landmarks.
    let are_most = 2 * suspects.len() > problem.landmarks.len();
    if suspects.is_empty() || are_most || problem.noise_factors().bearings > 1.0 {
        return None;
    }
    let (mut last, mut merged) = (None, Vec::new());
    // What fits a second place must be worth what it costs as outliers.
    let worth = LEAST_BEARINGS as f64 * BearingLoss::Truncated(OUTLIER_SIGMAS).cost(f64::INFINITY);
    for landmark in suspects {
        if let Some((split, descent)) = split(problem, landmark, options)
            && descent.cost + worth < problem.cost()
        {
            (*problem, last) = (split, Some(descent));
            merged.push(landmark);
        }
    }
    Some((last?, merged))
}

fn is_outlier(residual: f64) -> bool {
    residual > OUTLIER_SIGMAS
}

/// The problem with another place for a landmark, solved, if enough of its outliers agree on one and the bearings of both fit then.
fn split(problem: &BundleProblem, landmark: usize, options: &LogOptions) -> Option<(BundleProblem, DescentReport)> {
    let outliers = bearings(problem, landmark, is_outlier);
    if outliers.len() < LEAST_BEARINGS {
        return None;
    }
    let mut split = problem.clone();
    let o = &options.filter;
    let place = triangulated(&split, o, &outliers).0;
    let second = split.add_landmark(place, -o.start_distance_m.ln(), o.start_distance_log_sigma);
    assign(&mut split, [landmark, second]);
    if bearings(&split, second, |residual| residual <= AGREEING_SIGMAS).len() < LEAST_BEARINGS {
        return None;
    }
    let mut descent = solve(&mut split, options.max_iterations);
    for _ in 1..ROUNDS {
        if !assign(&mut split, [landmark, second]) {
            break;
        }
        descent = solve(&mut split, options.max_iterations);
    }
    let fits = |place: usize| {
        let [outliers, all] =
            [is_outlier, |_| true].map(|such: fn(f64) -> bool| bearings(&split, place, such).len() as f64);
        outliers <= OUTLIER_SHARE * all
    };
    (fits(landmark) && fits(second)).then_some((split, descent))
}

/// Keyframes and angles of the bearings of a landmark with such sizes of their whitened residuals.
fn bearings(problem: &BundleProblem, landmark: usize, such: impl Fn(f64) -> bool) -> Vec<(usize, f64)> {
    let mut found = Vec::new();
    let point = problem.landmarks[landmark].homogeneous();
    for (at, keyframe) in problem.keyframes.iter().enumerate() {
        let Some(seen) = keyframe.observations.iter().find(|seen| seen.landmark == landmark) else { continue };
        let view = Viewpoint::new(&problem.observation_pose(at).0, &problem.mounting);
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
        let view = Viewpoint::new(&problem.observation_pose(at).0, &problem.mounting);
        let seen = problem.keyframes[at].observations[k];
        let [first, second] = places.map(|place| view.residual(&place, &seen.about(&problem.centre).along).abs());
        let nearer = pair[usize::from(second < first)];
        changed |= nearer != seen.landmark;
        problem.keyframes[at].observations[k].landmark = nearer;
    }
    changed
}
