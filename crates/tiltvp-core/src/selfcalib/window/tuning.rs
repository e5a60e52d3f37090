//! Every number by which the sliding window is tuned, with its reason.
//!
//! The first group decides when the window is solved. Solving less often than here leaves Jacobians that disagree with the answer
//! (Huang, Mourikis and Roumeliotis 2010): the filter gains information along directions that the motion does not tell. Solving
//! more often costs time and nothing else. `test_drives_are_recovered_and_errors_are_as_claimed` holds errors and covariances,
//! `just measure-calibration` prints them on a thousand drives and on the real logs, and `just bench calibration` the time.

/// Keyframes up to which the window is solved at every step: about the length of the first straight metre, after which distances
/// are known and Jacobians are stable. With 20 or 80 errors of simulated drives stay the same within 3 %.
pub(super) const EVERY_STEP_KEYFRAMES: usize = 40;

/// Growth of the number of keyframes at which the window is solved in any case. At a factor of two the sum of all solutions costs
/// as much as two of the last. With 1.5 or 4 errors stay the same.
pub(super) const GROWTH: f64 = 2.0;

/// The same growth while the filter is inconsistent: some 25 solutions for every factor of 30 instead of 5.
pub(super) const INCONSISTENT_GROWTH: f64 = 1.15;

/// Landmarks with one bearing in the window, as of tracks that break, above which its older half is marginalised early, with those
/// that are not seen any more. With five new names a step, of 500, a step took 115 ms in the mean and 17 s at most, with this 13 and
/// 1.0 s, and errors are the same. Of the logs measured here none has so many.
pub(super) const SEEN_ONCE_MAX: usize = 300;

/// Standard deviations by which the mounting may move from the last solution. At one the solution is about as far from the point
/// of linearisation as from the truth. With half or twice of it errors of simulated drives stay the same within 4 %.
pub(super) const MOVED_SIGMAS: f64 = 1.0;

/// The same while the filter is inconsistent. With half or twice of it the errors of three drives with 3 % outliers grow from 2.3 to
/// 2.6 mm.
pub(super) const INCONSISTENT_MOVED_SIGMAS: f64 = 0.5;

/// Ratio of a standard deviation of the mounting to that at the last solution, below which the window is solved: the Jacobians with
/// which so much was learned are not those of the answer. With 0.3 or 0.9 errors of simulated drives stay the same within 4 %.
pub(super) const SIGMA_RATIO: f64 = 0.6;

/// Keyframes until such a ratio counts again after a solution that does not confirm it, which makes the gain spurious: at least so
/// many, and one for so many keyframes. `spurious_information_of_a_circle_costs_little_and_is_not_reported` shows both effects.
pub(super) const SPURIOUS_KEYFRAMES: usize = 5;
pub(super) const SPURIOUS_SHARE: usize = 20;

/// Rejections of a landmark in a row at which the window is solved, so that it decides who is right. Three chance rejections in a
/// row have a probability of 1e-12 at the default gate.
pub(super) const DISPUTED_REJECTIONS: u32 = 3;

/// Keyframes without a landmark after which its rejection is a loop closure, at which the window is solved at once. A tracker
/// loses a landmark for a few frames without the pose having drifted.
pub(super) const LOOP_KEYFRAMES: usize = 10;

/// Standard deviations from the last solution up to which the search starts from the filter's mean: beyond, the filter has been
/// linearised at the wrong place, and the last solution is the better start.
pub(super) const TRUSTED_SIGMAS: f64 = 3.0;

/// Most Gauss-Newton iterations from a start that is trusted, and from another one. From the filter's mean two or three do.
pub(super) const ITERATIONS: u32 = 4;
pub(super) const UNTRUSTED_ITERATIONS: u32 = 12;

/// Most iterations after the outliers have been left out: the solution moves little.
pub(super) const FIXED_OUTLIER_ITERATIONS: u32 = 2;

/// Difference of the cost from its prediction at which the window is solved: the solution is then within a third of a standard
/// deviation, by `r^2 / 2 = 0.05`.
pub(super) const COST_TOLERANCE: f64 = 0.05;

/// Threshold of Huber's loss while the window is solved, standard deviations: a bearing passes it once in 370 by chance.
pub(super) const HUBER_SIGMAS: f64 = 3.0;

/// Share of outliers up to which they are single wrong bearings, which are left out. More come from a wrong solution, which would
/// be confirmed by leaving them out.
pub(super) const OUTLIER_SHARE: f64 = 0.03;

/// Keyframes up to which other yaws are tried where there are outliers; later the yaw is known, and a start costs more.
pub(super) const RESTART_KEYFRAMES: usize = 160;

/// These yaws, in standard deviations of the start. The first keeps it and searches only the distances of landmarks with
/// outliers, the second those of all landmarks.
pub(super) const RESTART_YAWS: [f64; 6] = [0.0, 0.0, 1.0, -1.0, 2.0, -2.0];

/// Most linearisations of an update between solutions.
pub(super) const UPDATE_ITERATIONS: u32 = 4;

/// Change of pose or mounting below which an update is not iterated again, as a share of the standard deviation, and the least
/// standard deviation: a micrometre or a microradian.
pub(super) const UPDATE_MOVED_SIGMAS: f64 = 0.05;
pub(super) const UPDATE_LEAST_SIGMA: f64 = 1e-6;

/// Fewer than one in so many bearings that the others contradict are wrong; of more it is not said who is right. With a half nine
/// rendered drives had the same alarms.
pub(super) const MINORITY: usize = 3;

/// Bearings of a step from which on a majority of rejections means that the wheels slipped: two of two may be wrong by chance.
pub(super) const SLIP_BEARINGS: usize = 3;

/// Factor of the standard deviations of a step's motion after a slip: of some millimetres it makes a metre, the size of a slip.
pub(super) const SLIP_FACTOR: f64 = 300.0;

/// Rejections in a row after which an identifier means another landmark: two more than the window is asked after.
pub(super) const LOST_REJECTIONS: u32 = 5;

/// Steps with bearings over which innovations are summed: 120 bearings of ten landmarks, whose mean square has a standard
/// deviation of 0.13.
pub(super) const MONITOR_STEPS: usize = 12;

/// Probability with which a consistent filter raises no alarm over these steps: one false alarm in a million steps.
pub(super) const ALARM_PROBABILITY: f64 = 1.0 - 1e-6;

/// Mean normalised innovation squared that an alarm needs besides: noise that is 1.4 times as large as assumed raises none.
pub(super) const ALARM_EXCESS: f64 = 2.0;

/// Share of rejected bearings up to which an alarm does not count them: trackers confuse landmarks.
pub(super) const ALARM_REJECTED_SHARE: f64 = 0.1;

/// Mean normalised innovation squared from which on the filter counts as inconsistent, and is solved more often: four standard
/// deviations of the mean over [`MONITOR_STEPS`] with ten landmarks.
pub(super) const INCONSISTENT_EXCESS: f64 = 1.5;

/// Share of rejected bearings from which on it counts as inconsistent: 200 times that of the default gate.
pub(super) const INCONSISTENT_REJECTED_SHARE: f64 = 0.02;
