//! The bundle-adjustment problem: its unknowns, its prior and its cost.

use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};

use super::free_parameters::FreeParameters;
use super::keyframe::{Keyframe, Observation};
use crate::selfcalib::model::{
    BearingLoss, FitSummary, InverseDistanceLandmark, MotionLoss, MotionNoise, Viewpoint, Wheels, along_arc, arc,
    between, between_jacobians, compose, compose_jacobians, preintegrate,
};
use crate::selfcalib::options::SelfCalibratorOptions;

/// A chain of keyframes from a fixed first one, and the parameters that they share: mounting, wheels, time offset and
/// image centre if free, then landmarks.
///
/// The cost is half the sum of the squared, whitened residuals of odometry and bearings (with robust losses) and of the prior.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct BundleProblem {
    pub(crate) mounting: Vector3<f64>,
    pub(crate) wheels: Wheels,
    pub(crate) offset_s: f64,
    /// How far the image centre about which bearings were taken is off, forward and left in the camera, in units of the radius at which
    /// lines are seen.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) centre: Vector2<f64>,
    /// Whether the time offset is that of late bearings, which were taken on the way to the next keyframe; else on that from the one before.
    /// It does not change with the offset's sign in a descent, for which the cost would have a kink at zero.
    pub(crate) late: bool,
    /// Whether velocities are those of the wheels, in place of those of the estimated poses, which at the solution of a wrong time offset are
    /// distorted by it.
    pub(crate) as_wheels_read: bool,
    /// Whether turns are compared as they are read, with the wheel base that is told; else in radians, in which their noise makes the best
    /// free base longer than the true one, but which turns that are contradicted mislead less.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) turns_as_read: bool,
    pub(crate) free: FreeParameters,
    pub(crate) noise: MotionNoise,
    pub(crate) landmarks: Vec<InverseDistanceLandmark>,
    pub(crate) keyframes: Vec<Keyframe>,
    /// Mean of the shared parameters without the bearings of the keyframes.
    pub(crate) prior_mean: DVector<f64>,
    /// Information about them.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::selfcalib::matrix_state::matrix"))]
    pub(crate) prior_information: DMatrix<f64>,
    pub(crate) bearing_sigma: f64,
    /// The scatter of each landmark's bearings, in units of `bearing_sigma`.
    pub(crate) scatters: Vec<f64>,
    pub(crate) loss: BearingLoss,
    pub(crate) slip: MotionLoss,
}

/// Standard deviations of the weak priors on (imbalance, logarithm of the wheel base), on the time offset, and that of a rolling shutter from
/// the middle to the lines, seconds, on the image centre, and on a turn of the camera all along the drive. Wheels are known to 20 %, clocks to a
/// second, centres to a tenth of the radius and screws to 12 degrees at worst. A drive determines them a hundred times better, so that the priors only keep the equations regular.
const WHEELS_SIGMA: [f64; 2] = [0.2, 0.2];
const OFFSET_SIGMA_S: f64 = 1.0;
const CENTRE_SIGMA: f64 = 0.1;
const CREEP_SIGMA_RAD: f64 = 0.2;

/// Jacobians of the pose of an observation.
pub(crate) struct ObservationPoseJacobians {
    /// By the pose of its keyframe.
    pub(crate) pose: Matrix3<f64>,
    /// By that of the keyframe's [neighbour](BundleProblem::neighbour).
    pub(crate) neighbour: Matrix3<f64>,
    /// By the time offset.
    pub(crate) offset: Vector3<f64>,
}

impl BundleProblem {
    /// A problem without motions and landmarks, with the prior of the options, at a guess of the mounting.
    pub(crate) fn new(
        options: &SelfCalibratorOptions,
        mounting: &Vector3<f64>,
        free: FreeParameters,
        loss: BearingLoss,
    ) -> Self {
        let width = free.width();
        let mut prior_mean = DVector::zeros(width);
        let mut prior_information = DMatrix::zeros(width, width);
        prior_mean.fixed_rows_mut::<3>(0).copy_from(&options.start.vector());
        let start = options.start_covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        prior_information.fixed_view_mut::<3, 3>(0, 0).copy_from(&start);
        if free.wheels {
            prior_mean[4] = options.wheel_base_m.ln();
            for (k, sigma) in WHEELS_SIGMA.iter().enumerate() {
                prior_information[(3 + k, 3 + k)] = 1.0 / (sigma * sigma);
            }
        }
        if free.offset {
            let at = free.offset_at();
            prior_information[(at, at)] = 1.0 / (OFFSET_SIGMA_S * OFFSET_SIGMA_S);
        }
        if free.centre {
            for k in 0..2 {
                prior_information[(free.centre_at() + k, free.centre_at() + k)] = 1.0 / (CENTRE_SIGMA * CENTRE_SIGMA);
            }
        }
        Self {
            mounting: *mounting,
            wheels: Wheels::new(options.wheel_base_m),
            offset_s: 0.0,
            centre: Vector2::zeros(),
            late: false,
            as_wheels_read: false,
            turns_as_read: false,
            free,
            noise: options.motion_noise(),
            landmarks: Vec::new(),
            keyframes: vec![Keyframe::anchor()],
            prior_mean,
            prior_information,
            bearing_sigma: options.bearing_sigma_rad,
            scatters: Vec::new(),
            loss,
            slip: MotionLoss::Logarithmic,
        }
    }

    /// The number of shared parameters.
    pub(crate) fn width(&self) -> usize {
        self.free.width() + 2 * self.landmarks.len()
    }

    /// The shared parameters as a vector.
    pub(crate) fn shared(&self) -> DVector<f64> {
        let mut g = DVector::zeros(self.width());
        g.fixed_rows_mut::<3>(0).copy_from(&self.mounting);
        if self.free.wheels {
            g[3] = self.wheels.imbalance;
            g[4] = self.wheels.base_m.ln();
        }
        if self.free.offset {
            g[self.free.offset_at()] = self.offset_s;
        }
        if self.free.centre {
            g.fixed_rows_mut::<2>(self.free.centre_at()).copy_from(&self.centre);
        }
        for (i, landmark) in self.landmarks.iter().enumerate() {
            let at = self.free.width() + 2 * i;
            g[at] = landmark.direction;
            g[at + 1] = landmark.log_inverse_distance;
        }
        g
    }

    /// This problem with more parameters free, where they are now.
    pub(crate) fn with_free(&self, free: FreeParameters) -> Self {
        let mut problem = self.clone();
        let information = &mut problem.prior_information;
        let mut insert = |at: usize, values: &[(f64, f64)]| {
            let count = values.len();
            let mean = std::mem::replace(&mut problem.prior_mean, DVector::zeros(0));
            problem.prior_mean = mean.insert_rows(at, count, 0.0);
            let before = std::mem::replace(information, DMatrix::zeros(0, 0));
            *information = before.insert_rows(at, count, 0.0).insert_columns(at, count, 0.0);
            for (k, (value, sigma)) in values.iter().enumerate() {
                problem.prior_mean[at + k] = *value;
                information[(at + k, at + k)] = 1.0 / (sigma * sigma);
            }
        };
        if free.wheels && !problem.free.wheels {
            let [imbalance, base] = WHEELS_SIGMA;
            insert(3, &[(problem.wheels.imbalance, imbalance), (problem.wheels.base_m.ln(), base)]);
            problem.free.wheels = true;
        }
        if free.offset && !problem.free.offset {
            insert(problem.free.offset_at(), &[(problem.offset_s, OFFSET_SIGMA_S)]);
            problem.free.offset = true;
        }
        if free.centre && !problem.free.centre {
            let [x, y] = problem.centre.into();
            insert(problem.free.centre_at(), &[(x, CENTRE_SIGMA), (y, CENTRE_SIGMA)]);
            problem.free.centre = true;
        }
        if free.shutter && !problem.free.shutter {
            insert(problem.free.shutter_at(), &[(0.0, OFFSET_SIGMA_S); 2]);
            problem.free.shutter = true;
        }
        if free.creep && !problem.free.creep {
            insert(problem.free.creep_at(), &[(0.0, CREEP_SIGMA_RAD)]);
            problem.free.creep = true;
        }
        problem
    }

    /// This problem with fixed wheels.
    pub(crate) fn with_fixed_wheels(mut self, wheels: Wheels) -> Self {
        if self.free.wheels {
            self.prior_mean = self.prior_mean.remove_rows(3, 2);
            self.prior_information = self.prior_information.remove_rows(3, 2).remove_columns(3, 2);
            self.free.wheels = false;
            self.wheels = wheels;
            for keyframe in self.keyframes.iter_mut().skip(1) {
                keyframe.odometry = preintegrate(&keyframe.readings, &wheels, &self.noise);
            }
        }
        self
    }

    /// Sets the shared parameters from a vector.
    pub(crate) fn set_shared(&mut self, g: &DVector<f64>) {
        self.mounting = g.fixed_rows::<3>(0).into();
        if self.free.wheels {
            self.wheels = Wheels { imbalance: g[3], base_m: g[4].exp() };
            for keyframe in self.keyframes.iter_mut().skip(1) {
                keyframe.odometry = preintegrate(&keyframe.readings, &self.wheels, &self.noise);
            }
        }
        if self.free.offset {
            self.offset_s = g[self.free.offset_at()];
        }
        if self.free.centre {
            self.centre = g.fixed_rows::<2>(self.free.centre_at()).into();
        }
        for (i, landmark) in self.landmarks.iter_mut().enumerate() {
            let at = self.free.width() + 2 * i;
            landmark.direction = g[at];
            landmark.log_inverse_distance = g[at + 1];
        }
    }

    /// Makes the prior as large as so many more landmarks want, so that adding them moves it no more.
    pub(crate) fn make_room(&mut self, landmarks: usize) {
        let n = self.width() + 2 * landmarks;
        let mean = std::mem::replace(&mut self.prior_mean, DVector::zeros(0));
        self.prior_mean = mean.resize_vertically(n, 0.0);
        let information = std::mem::replace(&mut self.prior_information, DMatrix::zeros(0, 0));
        self.prior_information = information.resize(n, n, 0.0);
    }

    /// Adds a landmark whose direction is unknown and whose distance is known by `log_inverse_distance +- sigma`.
    pub(crate) fn add_landmark(
        &mut self,
        landmark: InverseDistanceLandmark,
        log_inverse_distance: f64,
        sigma: f64,
    ) -> usize {
        let n = self.width();
        if n == self.prior_mean.len() {
            self.make_room(1);
        }
        self.prior_mean[n] = landmark.direction;
        self.prior_mean[n + 1] = log_inverse_distance;
        self.prior_information[(n + 1, n + 1)] = 1.0 / (sigma * sigma);
        self.landmarks.push(landmark);
        self.scatters.push(1.0);
        self.landmarks.len() - 1
    }

    /// This problem without some of its landmarks and their bearings, where it is now.
    pub(crate) fn without_landmarks(&self, gone: impl Fn(usize) -> bool) -> Self {
        let (mut problem, calibration) = (self.clone(), self.free.width());
        let kept: Vec<usize> = (0..self.landmarks.len()).filter(|i| !gone(*i)).collect();
        let of_kept = kept.iter().flat_map(|i| [0, 1].map(|k| calibration + 2 * i + k));
        let rows: Vec<usize> = (0..calibration).chain(of_kept).collect();
        problem.prior_mean = self.prior_mean.select_rows(&rows);
        problem.prior_information = self.prior_information.select_rows(&rows).select_columns(&rows);
        problem.landmarks = kept.iter().map(|i| self.landmarks[*i]).collect();
        problem.scatters = kept.iter().map(|i| self.scatters[*i]).collect();
        let mut places = vec![None; self.landmarks.len()];
        kept.iter().enumerate().for_each(|(place, i)| places[*i] = Some(place));
        for keyframe in &mut problem.keyframes {
            let seen = keyframe.observations.iter();
            keyframe.observations =
                seen.filter_map(|seen| Some(Observation { landmark: places[seen.landmark]?, ..*seen })).collect();
        }
        problem
    }

    /// The keyframe towards which the robot was from another one when the bearings of that were taken: the next where they are late, else
    /// the one before. None where there is none, where velocities are the wheels', and without a time offset.
    pub(crate) fn neighbour(&self, at: usize) -> Option<usize> {
        if self.as_wheels_read || !self.free.offset && self.offset_s == 0.0 {
            None
        } else if self.late {
            Some(at + 1).filter(|next| *next < self.keyframes.len())
        } else {
            at.checked_sub(1)
        }
    }

    /// The pose at which the bearings of a keyframe were taken, with its Jacobians unless the time offset is zero and fixed: on the arc to
    /// its [neighbour](Self::neighbour), or without one on that of the wheels.
    pub(crate) fn observation_pose(&self, at: usize) -> (Vector3<f64>, Option<ObservationPoseJacobians>) {
        let (keyframe, tau) = (&self.keyframes[at], self.offset_s);
        if !self.free.offset && tau == 0.0 {
            return (keyframe.pose, None);
        }
        let (velocity, by_poses) = match self.neighbour(at) {
            Some(other) => self.velocity_between(at, other),
            None => (self.velocity_read(at), [Matrix3::zeros(); 2]),
        };
        let (moved, by_along) = arc(&(velocity * tau));
        let (first, second) = compose_jacobians(&keyframe.pose, &moved);
        let by_velocity = second * by_along * tau;
        let jacobians = ObservationPoseJacobians {
            pose: first + by_velocity * by_poses[0],
            neighbour: by_velocity * by_poses[1],
            offset: second * by_along * velocity,
        };
        (compose(&keyframe.pose, &moved), Some(jacobians))
    }

    /// The velocity at a keyframe as the wheels read it: on departure where bearings are late, if it goes on, else on arrival.
    fn velocity_read(&self, at: usize) -> Vector3<f64> {
        match self.keyframes.get(at + 1).filter(|_| self.late) {
            Some(next) => next.mean_velocity() + next.unevenness[0],
            None => self.keyframes[at].mean_velocity() + self.keyframes[at].unevenness[1],
        }
    }

    /// The velocity at a keyframe on the way to or from a neighbour, with its Jacobians by the poses of both.
    fn velocity_between(&self, at: usize, neighbour: usize) -> (Vector3<f64>, [Matrix3<f64>; 2]) {
        let (start, end) = (&self.keyframes[at.min(neighbour)], &self.keyframes[at.max(neighbour)]);
        let motion = between(&start.pose, &end.pose);
        let ((along, by_motion), (by_start, by_end)) = (along_arc(&motion), between_jacobians(&start.pose, &motion));
        if end.seconds <= 0.0 {
            return (Vector3::zeros(), [Matrix3::zeros(); 2]);
        }
        let [by_start, by_end] = [by_start, by_end].map(|by_pose| by_motion * by_pose / end.seconds);
        let mean = along / end.seconds;
        if at < neighbour {
            (mean + end.unevenness[0], [by_start, by_end])
        } else {
            (mean + end.unevenness[1], [by_end, by_start])
        }
    }

    /// Half the sum of the squared, whitened residuals.
    pub(crate) fn cost(&self) -> f64 {
        self.fit().cost
    }

    /// How well the problem fits.
    pub(crate) fn fit(&self) -> FitSummary {
        let away = self.shared() - &self.prior_mean;
        let cost = 0.5 * away.dot(&(&self.prior_information * &away)) + self.scatter_cost();
        let mut fit = FitSummary { cost, ..FitSummary::default() };
        fit.cost += (1..self.keyframes.len()).map(|to| self.motion_cost(to)).sum::<f64>();
        for residual in self.residuals() {
            fit.add(residual, self.loss);
        }
        fit
    }

    /// The whitened residuals of all bearings, in the order of keyframes and observations.
    pub(crate) fn residuals(&self) -> Vec<f64> {
        let (points, mut all) = (self.homogeneous_landmarks(), Vec::new());
        for (at, keyframe) in self.keyframes.iter().enumerate() {
            let view = Viewpoint::new(&self.observation_pose(at).0, &self.mounting);
            let residual = |seen: &Observation| view.residual(&points[seen.landmark], &seen.about(&self.centre).along);
            all.extend(
                keyframe.observations.iter().map(|s| residual(s) / (self.bearing_sigma * self.scatters[s.landmark])),
            );
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::model::{RelativeMotion, WheelMotion};

    /// Between two keyframes the robot drives slowly, then three times as fast, straight on.
    #[test]
    fn velocities_as_read_are_those_of_the_first_and_the_last_reading() {
        let options = SelfCalibratorOptions::default();
        let free = FreeParameters::default();
        let mut problem = BundleProblem::new(&options, &Vector3::zeros(), free, BearingLoss::Truncated(4.5));
        let driven = |way_m: f64| {
            let wheels = WheelMotion { left_m: way_m, right_m: way_m };
            RelativeMotion::from_wheels(&wheels, &problem.wheels, &problem.noise)
        };
        let (slow, fast) = (driven(0.1), driven(0.3));
        let mut keyframe = Keyframe::after(slow, Vector3::new(0.1, 0.0, 0.0), 1.0);
        keyframe.extend(&fast, Vector3::new(0.4, 0.0, 0.0), 1.0);
        problem.keyframes.push(keyframe);
        for (late, at, expected) in [(false, 1, 0.3), (true, 0, 0.1)] {
            problem.late = late;
            assert!((problem.velocity_read(at) - Vector3::new(expected, 0.0, 0.0)).norm() < 1e-12, "{late}");
        }
    }
}
