//! The state of the sliding window: (pose, mounting, landmarks) now, and the bundle problem that it came from.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::monitor::InnovationMonitor;
use super::tuning::HUBER_SIGMAS;
use crate::error::Result;
use crate::filter::ChiSquareGate;
use crate::selfcalib::bundle::{BundleProblem, FreeParameters, widened};
use crate::selfcalib::diagnosis::{Contradictions, Deviation, Suspect};
use crate::selfcalib::model::{BearingLoss, InverseDistanceLandmark, Prediction, Viewpoint, WheelMotion};
use crate::selfcalib::options::SelfCalibratorOptions;

/// The places of the mounting and of the first landmark in the state (pose, mounting, landmarks).
pub(super) const MOUNTING: usize = 3;
pub(super) const LANDMARKS: usize = 6;

/// The loss of bearings while the window is solved.
pub(super) const ROBUST_LOSS: BearingLoss = BearingLoss::Huber(HUBER_SIGMAS);

/// What the last examination found.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Examination {
    pub(crate) contradictions: Contradictions,
    pub(crate) suspect: Option<Suspect>,
    /// Covariance of the mounting that errors make which motions of a part of the drive share.
    pub(crate) motion_scatter: Option<Matrix3<f64>>,
    /// What is doubted of the camera: image centre, shutter, creep.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) doubted_of_camera: Vec<Deviation>,
}

/// An iterated extended Kalman filter on (pose, mounting, landmarks), and a sliding window of keyframes that is solved again, and
/// relinearised, where the filter's Jacobians have become wrong.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SlidingWindow {
    pub(super) options: SelfCalibratorOptions,
    pub(super) gate: ChiSquareGate,
    /// The keyframes of the window, at the last solution.
    pub(super) problem: BundleProblem,
    /// (pose, mounting, landmarks) now.
    pub(super) mean: DVector<f64>,
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::selfcalib::matrix_state::matrix"))]
    pub(super) covariance: DMatrix<f64>,
    /// The caller's identifiers of the landmarks; `None` once an identifier means another landmark.
    pub(super) landmark_ids: Vec<Option<u64>>,
    /// Rejections of each landmark in a row.
    pub(super) rejections: Vec<u32>,
    /// Number of keyframes at which the window is solved in any case.
    pub(super) next_relinearisation: usize,
    /// Number of keyframes at the last solution.
    pub(super) solved_keyframes: usize,
    /// Covariance of the mounting at the last solution.
    pub(super) solved_covariance: Matrix3<f64>,
    /// Number of keyframes up to which information gained since the last solution counts as spurious.
    pub(super) spurious_until: usize,
    /// The factor that widens the covariance of the mounting for errors that a landmark's bearings share.
    pub(super) widening: Matrix3<f64>,
    /// The odometry since the robot stands, which is none that counts yet.
    pub(super) standing: WheelMotion,
    /// Covariance that the last motion added to the pose.
    pub(super) motion_noise: Matrix3<f64>,
    pub(super) monitor: InnovationMonitor,
    /// What the last examination of the window found.
    pub(super) examination: Examination,
}

impl SlidingWindow {
    pub(crate) fn new(options: &SelfCalibratorOptions) -> Result<Self> {
        let start = options.start.vector();
        let problem = BundleProblem::new(options, &start, FreeParameters::default(), ROBUST_LOSS);
        let mut mean = DVector::zeros(LANDMARKS);
        mean.fixed_rows_mut::<3>(MOUNTING).copy_from(&start);
        let mut covariance = DMatrix::zeros(LANDMARKS, LANDMARKS);
        covariance.fixed_view_mut::<3, 3>(MOUNTING, MOUNTING).copy_from(&options.start_covariance);
        Ok(Self {
            options: *options,
            gate: ChiSquareGate::new(options.gate_probability, 1)?,
            problem,
            mean,
            covariance,
            landmark_ids: Vec::new(),
            rejections: Vec::new(),
            next_relinearisation: 3,
            solved_keyframes: 1,
            solved_covariance: options.start_covariance,
            spurious_until: 0,
            widening: Matrix3::identity(),
            standing: WheelMotion::default(),
            motion_noise: Matrix3::zeros(),
            monitor: InnovationMonitor::default(),
            examination: Examination::default(),
        })
    }

    /// Whether all lengths agree with the number of landmarks, and only these are observed.
    pub(crate) fn is_well_formed(&self) -> bool {
        let (problem, count) = (&self.problem, self.landmark_ids.len());
        let width = problem.free.width() + 2 * count;
        [self.rejections.len(), problem.landmarks.len(), problem.scatters.len()].iter().all(|len| *len == count)
            && self.mean.len() == 3 + width
            && self.covariance.shape() == (3 + width, 3 + width)
            && problem.prior_mean.len() == width
            && problem.prior_information.shape() == (width, width)
            && problem.free == FreeParameters::default()
            && !problem.keyframes.is_empty()
            && problem.observations().all(|observation| observation.landmark < count)
    }

    /// The mounting with its covariance, as [`covariance_as_told`](Self::covariance_as_told) tells and widened for an image centre, a
    /// shutter or a creep that was doubted at the last examination.
    pub(crate) fn mounting(&self) -> (Vector3<f64>, Matrix3<f64>) {
        let known = self.covariance_as_told();
        let doubted = self.examination.doubted_of_camera.iter();
        let covariance = doubted.fold(known, |known, doubted| widened(&known, &doubted.scatter));
        (self.mean.fixed_rows::<3>(MOUNTING).into(), covariance)
    }

    /// The covariance of the mounting if the camera is as told: that of the last solution, where information gained since may be
    /// spurious, and widened for errors that a landmark's bearings share, and for those that up to the last examination motions of the
    /// drive shared.
    pub(crate) fn covariance_as_told(&self) -> Matrix3<f64> {
        let mut covariance: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(MOUNTING, MOUNTING).into();
        // A keyframe without bearings was not asked yet whether the window has to be solved.
        let unseen = self.problem.keyframes.last().is_some_and(|last| last.observations.is_empty());
        if self.problem.keyframes.len() < self.spurious_until + usize::from(unseen) {
            covariance = widened(&covariance, &self.solved_covariance);
        }
        covariance = self.widening * covariance * self.widening.transpose();
        self.examination.motion_scatter.as_ref().map_or(covariance, |scatter| widened(&covariance, scatter))
    }

    /// The number of landmarks that are followed.
    pub(crate) fn landmarks(&self) -> usize {
        self.followed().count()
    }

    /// Their identifiers.
    pub(crate) fn followed(&self) -> impl Iterator<Item = u64> {
        self.landmark_ids.iter().flatten().copied()
    }

    /// The monitor of the innovations.
    pub(crate) fn monitor(&self) -> &InnovationMonitor {
        &self.monitor
    }

    /// The bundle problem of the keyframes in the window.
    pub(crate) fn into_problem(self) -> BundleProblem {
        self.problem
    }

    /// The pose now.
    pub(super) fn pose(&self) -> Vector3<f64> {
        self.mean.fixed_rows::<3>(0).into()
    }

    /// Place and direction of the camera now.
    pub(super) fn viewpoint(&self) -> Viewpoint {
        Viewpoint::new(&self.pose(), &self.mean.fixed_rows::<3>(MOUNTING).into())
    }

    /// The predicted bearing of a landmark.
    pub(super) fn predict_bearing(&self, slot: usize, viewpoint: &Viewpoint) -> Prediction {
        let at = LANDMARKS + 2 * slot;
        let (anchor, direction) = (self.problem.landmarks[slot].anchor, self.mean[at]);
        let landmark = InverseDistanceLandmark { anchor, direction, log_inverse_distance: self.mean[at + 1] };
        viewpoint.predict(&landmark.homogeneous())
    }
}
