//! The bundle-adjustment problem: its unknowns, its prior and its cost.

use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};

use super::free_parameters::FreeParameters;
use super::keyframe::{Keyframe, Observation};
use crate::selfcalib::model::{
    BearingLoss, FitSummary, InverseDistanceLandmark, MotionLoss, MotionNoise, Wheels, preintegrate,
};
use crate::selfcalib::options::SelfCalibratorOptions;

/// A chain of keyframes from a fixed first one, and the parameters that they share: mounting, wheels, time offset, image
/// centre and rolling shutter if free, then landmarks.
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
    /// How much later than in the middle of the image lines are seen forward and left in the camera, seconds.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) shutter_s: Vector2<f64>,
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

impl BundleProblem {
    /// A problem without motions and landmarks, with the prior of the options, at a guess of the mounting.
    pub(crate) fn new(
        options: &SelfCalibratorOptions,
        mounting: &Vector3<f64>,
        free: FreeParameters,
        loss: BearingLoss,
    ) -> Self {
        let start = options.start_covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        let mounting_alone = Self {
            mounting: *mounting,
            wheels: Wheels::new(options.wheel_base_m),
            offset_s: 0.0,
            centre: Vector2::zeros(),
            shutter_s: Vector2::zeros(),
            late: false,
            as_wheels_read: false,
            turns_as_read: false,
            free: FreeParameters::default(),
            noise: options.motion_noise(),
            landmarks: Vec::new(),
            keyframes: vec![Keyframe::anchor()],
            prior_mean: options.start.vector().as_slice().to_vec().into(),
            prior_information: DMatrix::from_column_slice(3, 3, start.as_slice()),
            bearing_sigma: options.bearing_sigma_rad,
            scatters: Vec::new(),
            loss,
            slip: MotionLoss::Logarithmic,
        };
        mounting_alone.with_free(free)
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
        if self.free.shutter {
            g.fixed_rows_mut::<2>(self.free.shutter_at()).copy_from(&self.shutter_s);
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
            let [x, y] = problem.shutter_s.into();
            insert(problem.free.shutter_at(), &[(x, OFFSET_SIGMA_S), (y, OFFSET_SIGMA_S)]);
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
        if self.free.shutter {
            self.shutter_s = g.fixed_rows::<2>(self.free.shutter_at()).into();
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
        for at in 0..self.keyframes.len() {
            self.for_each_observation(at, |seen, view, _| {
                let residual = view.residual(&points[seen.landmark], &seen.about(&self.centre).along);
                all.push(residual / (self.bearing_sigma * self.scatters[seen.landmark]));
            });
        }
        all
    }
}
