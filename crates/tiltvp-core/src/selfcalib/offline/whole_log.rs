//! The mounting from a whole log: robust bundle adjustment from several starts, optionally with the wheels and a time offset.

use std::fmt;

use nalgebra::{DMatrix, Matrix3, Vector2};

use super::attempts::{Attempt, solved, started};
use super::descent::{solve, solve_without_slips, time_offset_sigmas};
use super::log::{LogBearing, LogOptions, SortedLog};
use super::merged_landmarks::take_apart;
use super::misreading::Misreading;
use super::noise::{solve_with_doubt, solve_with_noise};
use crate::error::{Error, Result};
use crate::selfcalib::bundle::{BundleProblem, CholeskyFactor, DescentReport, DoubtedParts, FreeParameters, widened};
use crate::selfcalib::diagnosis::{Assumed, Cause, DEVIATION_SIGMAS, Deviation, doubted_of_camera};
use crate::selfcalib::estimate::MountingEstimate;
use crate::selfcalib::model::{Mounting, OUTLIER_SIGMAS, WheelMotion, Wheels};

/// The answer of [`calibrate_log`].
#[derive(Debug, Clone, PartialEq)]
pub struct LogCalibration {
    /// The mounting. Covariances are scaled by the residuals where these are larger than assumed.
    pub estimate: MountingEstimate,
    /// The wheels, as given or as estimated.
    pub wheels: Wheels,
    /// Standard deviations of the wheels' imbalance and of the wheel base in metres; 0 where not estimated.
    pub wheels_sigma: [f64; 2],
    /// The time by which bearings are later than the odometry, seconds; 0 where not estimated.
    pub time_offset_s: f64,
    /// Its standard deviation.
    pub time_offset_sigma_s: f64,
    /// How far the image centre about which the bearings were taken is off, along bearings 0 and 90 degrees, in units of the radius at
    /// which lines are seen: radians; 0 where not estimated.
    pub centre_off_rad: Vector2<f64>,
    /// Its standard deviations.
    pub centre_off_sigma_rad: Vector2<f64>,
    /// How much later than in the middle of the image lines along bearings 0 and 90 degrees are seen, as through a rolling shutter: seconds,
    /// in a log without times steps; 0 where not estimated. Others by the cosine of their bearing of the one and the sine of the other.
    pub rolling_shutter_s: Vector2<f64>,
    /// Its standard deviations.
    pub rolling_shutter_sigma_s: Vector2<f64>,
    /// Bearings that were used. Of those of one landmark at a standstill only the first is.
    pub bearings: usize,
    /// Bearings farther from their prediction than 4.5 standard deviations, which have no weight.
    pub outliers: usize,
    /// Root of the mean squared residual of the others, in standard deviations of a bearing.
    pub residual_rms: f64,
    /// Linearisations of the last descents.
    pub iterations: u32,
    /// Whether the last descent converged.
    pub converged: bool,
    /// Standard deviation of a bearing, and variance of a wheel's displacement for each metre, as given or, where the residuals say that
    /// they are others, as estimated.
    pub bearing_sigma_rad: f64,
    /// See there.
    pub odometry_k_m: f64,
    /// How the log may have been meant, where it fits that way only.
    pub misreading: Option<Misreading>,
    /// The parts of the drive whose motions the bearings contradict, as on a carpet, each from which share of it to which. Their odometry is
    /// taken to have ten times its standard deviations.
    pub doubted: Vec<Vector2<f64>>,
    /// Identifiers of landmarks whose bearings are those of two places, which were taken apart.
    pub merged_landmarks: Vec<u64>,
}

impl LogCalibration {
    /// Whether the answer can be relied upon: the descent came to rest, the mounting can be relied upon, and the log was not misread.
    pub fn reliable(&self) -> bool {
        self.converged && self.misreading.is_none() && self.estimate.reliable()
    }

    /// Whether motions of a part of the drive may err together: nothing is suspect, or what they make so.
    fn may_drift(&self) -> bool {
        let causes = [Cause::Drift, Cause::OdometryK, Cause::WheelBase, Cause::Wheels];
        let may = |cause: Cause| cause.is_of_camera() || causes.contains(&cause);
        self.misreading.is_none() && self.estimate.suspect.is_none_or(|suspect| may(suspect.cause))
    }
}

/// A sentence: whether the answer can be relied upon, and why not.
impl fmt::Display for LogCalibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.estimate.reliable() && !self.reliable() {
            write!(f, "not to be relied upon; ")?;
        }
        write!(f, "{}", self.estimate)?;
        if !self.converged {
            write!(f, "; not converged")?;
        }
        for part in &self.doubted {
            write!(f, "; odometry from {:.0} to {:.0} % of the drive doubted", 100.0 * part.x, 100.0 * part.y)?;
        }
        if !self.merged_landmarks.is_empty() {
            let names: Vec<String> = self.merged_landmarks.iter().map(u64::to_string).collect();
            write!(f, "; two landmarks under one name, taken apart: {}", names.join(", "))?;
        }
        self.misreading.map_or(Ok(()), |misreading| write!(f, "; {misreading}"))
    }
}

/// Share of turns, motions and bearings that may be contradicted before other readings of the log are tried, and with which such a
/// reading fits: a wrong sign or unit contradicts nearly all of one kind, slips and strays few of all.
const MISREAD_SHARE: f64 = 0.3;
const FITTING_SHARE: f64 = 0.2;

/// Turns by some 0.1 rad that a reading must leave to be believed: signs and units are told by turns.
const LEAST_TURNS: usize = 3;

/// Standard deviations of a free time offset up to which it may be none: 99.7 % of normal numbers are within.
const OFFSET_SIGMAS: f64 = 3.0;

/// The mounting from a whole log.
///
/// # Errors
/// [`Error::InvalidOption`] for options that make no sense, [`Error::InvalidArgument`] for numbers that are not finite, steps
/// that do not exist, times that do not grow or are missing, two bearings of a landmark at one step, more than
/// [`MOST_LANDMARKS`](crate::selfcalib::MOST_LANDMARKS), and logs without a landmark that is seen from two steps.
pub fn calibrate_log(
    options: &LogOptions,
    readings: &[WheelMotion],
    times_s: Option<&[f64]>,
    bearings: &[LogBearing],
) -> Result<LogCalibration> {
    let log = SortedLog::new(options, readings, times_s, bearings)?;
    let Some((mut named, mut descent)) = solved(&log)? else {
        return Err(Error::argument("bearings", "a problem without a solution", "a drive past landmarks"));
    };
    let mut misreading = None;
    if !fits(&named.problem, MISREAD_SHARE) {
        misreading = fitting_misreading(options, readings, times_s, bearings);
    }
    let mut merged_landmarks = Vec::new();
    if misreading.is_none() {
        merged_landmarks = take_apart(&mut named, &mut descent, &log)?;
    }
    let mut problem = named.problem;
    // More noise for all motions would explain what is wrong with those of a part.
    let as_told = problem.clone();
    if misreading.is_none() && !problem.contradictions().most_turns() {
        descent = solve_with_noise(&mut problem, options.max_iterations).unwrap_or(descent);
    }
    let mut answer = report(options, &problem, &descent, misreading);
    if let Ok(told) = &answer
        && told.may_drift()
        && let Some(without) = without_contradicted_parts(options, as_told)
    {
        answer = Ok(without);
    }
    answer.map(|found| LogCalibration { merged_landmarks, ..found }).map_err(|error| match misreading {
        Some(misreading) => {
            Error::argument("odometry", format!("a log that determines nothing; {misreading}"), "metres and radians")
        }
        None => error,
    })
}

/// The answer without the odometry of the parts of the drive that the bearings contradict, where nothing but the camera is suspect
/// then, and the wheels are as told.
fn without_contradicted_parts(options: &LogOptions, mut problem: BundleProblem) -> Option<LogCalibration> {
    let as_told = problem.clone();
    let (mut descent, doubted) = solve_with_doubt(&mut problem, options.max_iterations)?;
    if !options.estimate_odometry && wheels_are_others(options, &as_told) {
        return None;
    }
    descent = solve_with_noise(&mut problem, options.max_iterations).unwrap_or(descent);
    let answer = report(options, &problem, &descent, None).ok()?;
    let fits = answer.estimate.suspect.is_none_or(|suspect| suspect.cause.is_of_camera());
    (answer.converged && fits).then_some(LogCalibration { doubted, ..answer })
}

/// Whether a log tells other wheels than it was told, as far as motions of all its parts tell them. A wrong wheel base contradicts the
/// parts in which the robot turns.
fn wheels_are_others(options: &LogOptions, as_told: &BundleProblem) -> bool {
    let options = LogOptions { estimate_odometry: true, jackknife_parts: 0, ..*options };
    let mut problem = as_told.with_free(FreeParameters { wheels: true, ..as_told.free });
    let descent = solve(&mut problem, options.max_iterations);
    let Ok(answer) = report(&options, &problem, &descent, None) else { return false };
    let [imbalance, base_m] = answer.wheels_sigma.map(|sigma| DEVIATION_SIGMAS * sigma);
    let (wheels, told) = (answer.wheels, as_told.wheels);
    (wheels.imbalance - told.imbalance).abs() > imbalance || (wheels.base_m - told.base_m).abs() > base_m
}

/// Whether at most a share of the turns is contradicted, and of the motions and bearings.
fn fits(problem: &BundleProblem, share: f64) -> bool {
    let residuals = problem.residuals();
    let outliers = residuals.iter().filter(|r| r.abs() > OUTLIER_SIGMAS).count();
    let counts = problem.contradictions();
    let parts = [
        (counts.contradicted_turns, counts.turns),
        (counts.contradicted_motions, counts.motions),
        (outliers, residuals.len()),
    ];
    parts.iter().all(|(part, whole)| *part as f64 <= share * *whole as f64)
}

/// The misreading with which the log fits best, of those with which it fits at all.
fn fitting_misreading(
    options: &LogOptions,
    readings: &[WheelMotion],
    times_s: Option<&[f64]>,
    bearings: &[LogBearing],
) -> Option<Misreading> {
    let cost = |(readings, bearings): (Vec<WheelMotion>, Vec<LogBearing>)| {
        let log = SortedLog::new(options, &readings, times_s, &bearings).ok()?;
        let mut problem = started(&log, Attempt::FreeWheels).ok()?.problem;
        let descent = solve(&mut problem, options.max_iterations);
        // A reading that leaves nearly no motion fits anything.
        let turns = problem.contradictions().turns >= LEAST_TURNS;
        (descent.cost.is_finite() && turns && fits(&problem, FITTING_SHARE)).then_some(descent.cost)
    };
    let possible = Misreading::ALL.into_iter().filter(|misreading| misreading.possible(bearings));
    let fitting = possible.filter_map(|misreading| {
        Some((misreading, misreading.logs(readings, bearings).into_iter().filter_map(cost).min_by(f64::total_cmp)?))
    });
    fitting.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(misreading, _)| misreading)
}

/// The deviations of a solution, without a time offset that the score tells and the solution with a free one does not. The score takes
/// velocities as the wheels read them, whose noise is in the poses too: of a long drive with sudden turns it told 5 sigmas of none.
fn solved_deviations(
    options: &LogOptions,
    solved: &BundleProblem,
    covariance: &Matrix3<f64>,
    excess: f64,
) -> Vec<Deviation> {
    let mut deviations = solved.deviations(covariance, excess);
    let is_offset = |d: &Deviation| d.of == Assumed::TimeOffset;
    if deviations.iter().any(|d| is_offset(d) && d.sigmas > DEVIATION_SIGMAS * excess.sqrt())
        && let Some(sigmas) = time_offset_sigmas(solved, options.max_iterations)
        && sigmas <= OFFSET_SIGMAS * excess.sqrt()
    {
        deviations.retain(|d| !is_offset(d));
    }
    deviations
}

/// The scatter of what the log tells of the mounting without some of its landmarks in turn, where it is asked for. Of what one part alone
/// tells no more is known than at the start.
fn landmark_scatter(options: &LogOptions, problem: &BundleProblem) -> Option<Matrix3<f64>> {
    let solve_part = |part: &mut BundleProblem| {
        let descent = solve(part, options.max_iterations);
        solve_without_slips(part, options.max_iterations).unwrap_or(descent)
    };
    let parts = options.jackknife_parts as usize;
    (parts > 0).then(|| problem.landmark_scatter(parts, solve_part).unwrap_or(options.filter.start_covariance))
}

/// The answer: the solution with its covariance, scaled by the residuals where these are larger than assumed. What is suspect is told by the
/// solution that slips pull: they may be what a delay makes of turns.
fn report(
    options: &LogOptions,
    pulled: &BundleProblem,
    descent: &DescentReport,
    misreading: Option<Misreading>,
) -> Result<LogCalibration> {
    let o = &options.filter;
    let mut problem = pulled.clone();
    let descent = solve_without_slips(&mut problem, options.max_iterations).unwrap_or(*descent);
    let residuals = problem.residuals();
    let kept: Vec<f64> = residuals.iter().copied().filter(|r| r.abs() <= OUTLIER_SIGMAS).collect();
    let free = kept.len().saturating_sub(problem.width()).max(1) as f64;
    let sum: f64 = kept.iter().map(|r| r * r).sum();
    let scale = (sum / free).max(1.0);
    if residuals.is_empty() {
        return Err(Error::argument(
            "bearings",
            "a drive that determines nothing",
            "landmarks seen from several poses",
        ));
    }
    let solution = problem.eliminate_poses(problem.keyframes.len() - 1, false, 0.0).and_then(|system| {
        let covariance = CholeskyFactor::regularised(&system.equations.information)?.inverse();
        Some((problem.covariance_widening(&system, &covariance), covariance))
    });
    // No minimum is there: nothing is known beyond the start, and this is no answer.
    let converged = descent.converged && solution.is_some();
    let (widening, covariance) = solution.unwrap_or_else(|| {
        let mut unknown = DMatrix::from_diagonal_element(problem.width(), problem.width(), f64::INFINITY);
        unknown.fixed_view_mut::<3, 3>(0, 0).copy_from(&o.start_covariance);
        (Matrix3::identity(), unknown)
    });
    let covariance = covariance * scale;
    let mounting: Matrix3<f64> = covariance.fixed_view::<3, 3>(0, 0).into();
    let own = widening * mounting * widening.transpose();
    let doubted = if converged { problem.doubted_parts() } else { None };
    let motions = doubted.as_ref().map(DoubtedParts::scatter_of_mounting);
    let landmarks = converged.then(|| landmark_scatter(options, &problem)).flatten();
    let with = |scatter: Option<&Matrix3<f64>>, own| scatter.map_or(own, |scatter| widened(&own, scatter));
    let (counts, by_landmarks) = (pulled.contradictions(), with(landmarks.as_ref(), own));
    let factors = pulled.noise_factors();
    let deviations = solved_deviations(options, pulled, &by_landmarks, factors.excess());
    let suspect = pulled.suspect(o, &counts, (factors, &deviations), &by_landmarks, motions.as_ref());
    let of_camera = doubted_of_camera(&deviations, factors.excess());
    let widened_from = |own| with(landmarks.as_ref(), with(motions.as_ref(), own));
    let mounting = widened_from(of_camera.iter().fold(own, |own, doubted| widened(&own, &doubted.scatter)));
    let start = o.start_covariance * scale;
    let scatter = doubted.as_ref().map(DoubtedParts::scatter);
    let sigma = |at: usize| {
        let by_motions = scatter.as_ref().map_or(0.0, |scatter| scatter[(at, at)]);
        covariance[(at, at)].max(by_motions).sqrt()
    };
    let free = problem.free;
    let sigmas = |is_free, at| Vector2::from_fn(|k, _| if is_free { sigma(at + k) } else { 0.0 });
    Ok(LogCalibration {
        estimate: MountingEstimate::new(
            Mounting::from_vector(&problem.mounting),
            mounting,
            &start,
            Some(sum / kept.len().max(1) as f64),
            false,
        )
        .judged(counts, suspect)
        .doubting(of_camera.first(), || widened_from(own), &start),
        wheels: problem.wheels,
        wheels_sigma: if free.wheels { [sigma(3), sigma(4) * problem.wheels.base_m] } else { [0.0; 2] },
        time_offset_s: problem.offset_s,
        time_offset_sigma_s: if free.offset { sigma(free.offset_at()) } else { 0.0 },
        centre_off_rad: problem.centre,
        centre_off_sigma_rad: sigmas(free.centre, free.centre_at()),
        rolling_shutter_s: problem.shutter_s,
        rolling_shutter_sigma_s: sigmas(free.shutter, free.shutter_at()),
        bearings: residuals.len(),
        outliers: residuals.len() - kept.len(),
        residual_rms: (sum / kept.len().max(1) as f64).sqrt(),
        iterations: descent.iterations,
        converged,
        bearing_sigma_rad: problem.bearing_sigma,
        odometry_k_m: problem.noise.k_m,
        misreading,
        doubted: Vec::new(),
        merged_landmarks: Vec::new(),
    })
}
