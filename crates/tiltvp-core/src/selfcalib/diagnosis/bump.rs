//! Whether a jump between the odometry and the bearings may be a bump of the camera instead of a slip of the wheels.

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::geometry::wrap_angle;
use crate::selfcalib::bundle::{BundleProblem, CholeskyFactor, FIRST_DAMPING};
use crate::selfcalib::model::{between, compose};
use crate::selfcalib::options::SelfCalibratorOptions;

/// Most jumps that are looked at, the largest first; logs with many are suspected of slips anyway.
const MOST_JUMPS: usize = 5;

/// Twice the logarithm of the likelihood ratio by which a slip must explain a jump better than a bump: some three thousand to one.
const SURE: f64 = 16.0;

/// Squared Mahalanobis distance of two mountings up to which they may be the same: the 99.9 % quantile of chi-square of three numbers.
const SAME: f64 = 16.27;

/// Standard deviations of the mounting within which a bump would leave it right enough.
const HARMLESS_SIGMAS: f64 = 2.0;

/// Iterations and tolerance of the cost for a part of a log, which starts at the solution of the whole.
const ITERATIONS: u32 = 30;
const TOLERANCE: f64 = 0.1;

/// Information by which landmarks stay where they are that a part of a log does not see, 1/rad^2.
const UNSEEN_INFORMATION: f64 = 1.0;

impl BundleProblem {
    /// The angle, in radians, of the first jump that may be a bump of the camera: the mountings before and after it do not say clearly
    /// enough that it was a slip. `covariance` is that of the mounting.
    pub(super) fn possible_bump(&self, options: &SelfCalibratorOptions, covariance: &Matrix3<f64>) -> Option<f64> {
        let information = covariance.try_inverse()?;
        let mut jumps: Vec<(usize, Vector3<f64>, f64)> = (1..self.keyframes.len())
            .filter(|to| self.slipped(*to))
            .map(|to| {
                let by = self.bump_instead_of_slip(to);
                (to, by, by.dot(&(information * by)).sqrt())
            })
            .filter(|(.., sigmas)| *sigmas > HARMLESS_SIGMAS)
            .collect();
        jumps.sort_by(|a, b| b.2.total_cmp(&a.2));
        jumps.truncate(MOST_JUMPS);
        let possible = |(to, by, _): &(usize, Vector3<f64>, f64)| !self.is_slip(options, *to, by);
        jumps.iter().find(|jump| possible(jump)).map(|(_, by, _)| by.z.abs())
    }

    /// How the mounting would have changed if the odometry of the motion to a keyframe is right, and the camera was bumped.
    fn bump_instead_of_slip(&self, to: usize) -> Vector3<f64> {
        let (before, after) = (&self.keyframes[to - 1], &self.keyframes[to]);
        let jump = between(&after.odometry.motion, &between(&before.pose, &after.pose));
        let mut by = compose(&jump, &self.mounting) - self.mounting;
        by.z = wrap_angle(by.z);
        by
    }

    /// Whether the mountings before and after a jump are clearly rather the same than changed by a bump.
    fn is_slip(&self, options: &SelfCalibratorOptions, to: usize, bump: &Vector3<f64>) -> bool {
        let Some((early, late)) =
            self.before(to, options).mounting_alone().zip(self.from(to, options).mounting_alone())
        else {
            return false;
        };
        let mut off = late.0 - early.0;
        off.z = wrap_angle(off.z);
        let Some(information) = (early.1 + late.1).try_inverse() else { return false };
        let squared = |away: Vector3<f64>| away.dot(&(information * away));
        squared(off) <= SAME && squared(off - bump) - squared(off) > SURE
    }

    /// The part of the log before a keyframe.
    fn before(&self, to: usize, options: &SelfCalibratorOptions) -> Self {
        let mut part = self.clone();
        part.keyframes.truncate(to);
        part.hold_landmarks(options);
        part
    }

    /// The part of the log from a keyframe on, with nothing known of the mounting and the landmarks but what is at a start.
    fn from(&self, to: usize, options: &SelfCalibratorOptions) -> Self {
        let mut part = self.clone();
        part.keyframes.drain(..to);
        let width = part.width();
        let fresh = Self::new(options, &part.mounting, part.free, part.loss).prior_information;
        part.prior_information = fresh.resize(width, width, 0.0);
        part.prior_mean = part.shared();
        part.prior_mean.fixed_rows_mut::<3>(0).copy_from(&options.start.vector());
        part.hold_landmarks(options);
        part
    }

    /// Holds landmarks of which nothing but bearings would tell the direction, or the distance. What is known of others stays as it is.
    fn hold_landmarks(&mut self, options: &SelfCalibratorOptions) {
        let (here, sigma) = (self.shared(), options.start_distance_log_sigma);
        let start = 1.0 / (sigma * sigma);
        for direction in (self.free.width()..self.width()).step_by(2) {
            let held = [(direction, f64::MIN_POSITIVE, UNSEEN_INFORMATION), (direction + 1, start, start)];
            for (at, least, information) in held {
                if self.prior_information[(at, at)] < least {
                    self.prior_information[(at, at)] = information;
                    self.prior_mean[at] = here[at];
                }
            }
        }
    }

    /// The mounting of a part of a log and its covariance.
    fn mounting_alone(mut self) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        self.levenberg_marquardt(ITERATIONS, TOLERANCE, FIRST_DAMPING);
        let system = self.eliminate_poses(self.keyframes.len() - 1, false, 0.0)?;
        let covariance: DMatrix<f64> = CholeskyFactor::regularised(&system.equations.information)?.inverse();
        Some((self.mounting, covariance.fixed_view::<3, 3>(0, 0).into()))
    }
}
