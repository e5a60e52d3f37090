//! The extended Kalman filter of Scaramuzza, Siegwart and Martinelli (2009), section 8.2: state (28), dynamics (29),
//! observation (30) and noise (31).

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, RowVector2, Vector2, Vector3};

use super::model::{Feature, dynamics, dynamics_jacobians, observation, observation_jacobians, theta_of};
use crate::geometry::wrap_angle;
use crate::selfcalib::model::WheelMotion;
use crate::selfcalib::options::SelfCalibratorOptions;
use crate::selfcalib::step_outcome::StepOutcome;

/// The filter, with the state in the order of eq. 28.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct PaperFilter {
    options: SelfCalibratorOptions,
    ids: Vec<u64>,
    features: Vec<Feature>,
    /// (phi, rho, psi).
    mounting: Vector3<f64>,
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::selfcalib::matrix_state::matrix"))]
    covariance: DMatrix<f64>,
}

impl PaperFilter {
    pub(crate) fn new(options: &SelfCalibratorOptions) -> Self {
        let start = options.start;
        let j = start.polar_by_vector();
        let covariance = j * options.start_covariance * j.transpose();
        Self {
            options: *options,
            ids: Vec::new(),
            features: Vec::new(),
            mounting: Vector3::new(start.phi_rad(), start.rho_m(), start.psi_rad()),
            covariance: DMatrix::from_column_slice(3, 3, covariance.as_slice()),
        }
    }

    /// (phi, rho, psi) and its covariance; `None` once the filter has diverged beyond numbers.
    pub(crate) fn mounting(&self) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let at = 2 * self.features.len();
        let covariance: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(at, at).into();
        let finite = self.mounting.iter().chain(covariance.iter()).all(|x| x.is_finite());
        (finite && covariance.diagonal().min() >= 0.0).then_some((self.mounting, covariance))
    }

    /// Whether all lengths agree with the number of features.
    pub(crate) fn is_well_formed(&self) -> bool {
        let width = 2 * self.features.len() + 3;
        self.ids.len() == self.features.len() && self.covariance.shape() == (width, width)
    }

    pub(crate) fn landmarks(&self) -> usize {
        self.features.len()
    }

    pub(crate) fn followed(&self) -> impl Iterator<Item = u64> {
        self.ids.iter().copied()
    }

    pub(crate) fn step(&mut self, motion: &WheelMotion, seen: &[(u64, f64)]) -> StepOutcome {
        self.predict(motion);
        let mut outcome = StepOutcome::default();
        let mut known = Vec::with_capacity(seen.len());
        let mut new = Vec::new();
        for &(id, bearing) in seen {
            match self.ids.iter().position(|n| *n == id) {
                Some(i) => known.push((i, bearing)),
                None => new.push((id, bearing)),
            }
        }
        if let Some(nis) = self.update(&known) {
            outcome.nis = nis;
            outcome.used = known.len();
        }
        for (id, bearing) in new {
            self.initialise_feature(id, bearing);
            outcome.started += 1;
        }
        outcome
    }

    /// `P = F_x P F_x^T + F_u Q F_u^T`, with the block diagonal `F_x`.
    fn predict(&mut self, motion: &WheelMotion) {
        let base = self.options.wheel_base_m;
        let n = self.covariance.nrows();
        let noise = motion.covariance(self.options.odometry_k_m * self.options.odometry_inflation);
        let mut by_wheels = DMatrix::zeros(n, 2);
        for (i, feature) in self.features.iter_mut().enumerate() {
            let (a, b) = dynamics_jacobians(feature, motion, base);
            *feature = dynamics(feature, motion, base);
            for c in 0..n {
                let column: Vector2<f64> = self.covariance.fixed_view::<2, 1>(2 * i, c).into();
                self.covariance.fixed_view_mut::<2, 1>(2 * i, c).copy_from(&(a * column));
            }
            for r in 0..n {
                let row: RowVector2<f64> = self.covariance.fixed_view::<1, 2>(r, 2 * i).into();
                self.covariance.fixed_view_mut::<1, 2>(r, 2 * i).copy_from(&(row * a.transpose()));
            }
            by_wheels.fixed_view_mut::<2, 2>(2 * i, 0).copy_from(&b);
        }
        let cross = &by_wheels * DMatrix::from_column_slice(2, 2, noise.as_slice());
        self.covariance.gemm(1.0, &cross, &by_wheels.transpose(), 1.0);
    }

    /// One joint, ungated update; the normalised innovation squared.
    fn update(&mut self, known: &[(usize, f64)]) -> Option<f64> {
        if known.is_empty() {
            return None;
        }
        let (n, at) = (self.covariance.nrows(), 2 * self.features.len());
        let mut h = DMatrix::zeros(known.len(), n);
        let mut innovation = DVector::zeros(known.len());
        for (row, (i, bearing)) in known.iter().enumerate() {
            let (by_feature, by_mounting) = observation_jacobians(&self.features[*i], &self.mounting);
            h.fixed_view_mut::<1, 2>(row, 2 * i).copy_from(&by_feature);
            h.fixed_view_mut::<1, 3>(row, at).copy_from(&by_mounting);
            innovation[row] = wrap_angle(bearing - observation(&self.features[*i], &self.mounting));
        }
        let cross = &h * &self.covariance;
        let mut s = &cross * h.transpose();
        for k in 0..known.len() {
            s[(k, k)] += self.options.bearing_sigma_rad.powi(2);
        }
        let factor = Cholesky::new(s)?;
        let gain = factor.solve(&cross).transpose();
        let nis = innovation.dot(&factor.solve(&innovation));
        let step = &gain * innovation;
        for (i, feature) in self.features.iter_mut().enumerate() {
            feature.distance_m += step[2 * i];
            feature.theta_rad += step[2 * i + 1];
        }
        self.mounting += step.fixed_rows::<3>(at);
        self.covariance.gemm(-1.0, &gain, &cross, 1.0);
        let transposed = self.covariance.transpose();
        self.covariance += transposed;
        self.covariance *= 0.5;
        Some(nis)
    }

    /// Adds a feature at the start distance, in the direction of its bearing. The error of `theta` follows from those of the
    /// distance, the mounting and the bearing by the observation equation.
    fn initialise_feature(&mut self, id: u64, bearing: f64) {
        let distance_m = self.options.start_distance_m;
        let feature = Feature { distance_m, theta_rad: theta_of(distance_m, bearing, &self.mounting) };
        let (by_feature, by_mounting) = observation_jacobians(&feature, &self.mounting);
        let (n, at) = (self.covariance.nrows(), 2 * self.features.len());
        let scale = -1.0 / by_feature[1];
        let theta_by = by_mounting * scale;
        let mut grown = DMatrix::zeros(n + 2, n + 2);
        // Old features keep their place; the mounting moves behind the new one.
        let place = |i: usize| if i < at { i } else { i + 2 };
        for c in 0..n {
            for r in 0..n {
                grown[(place(r), place(c))] = self.covariance[(r, c)];
            }
        }
        let variance = self.options.start_distance_sigma_m.powi(2);
        let theta_by_distance = by_feature[0] * scale;
        for i in 0..n {
            let cross: f64 = (0..3).map(|k| theta_by[k] * self.covariance[(at + k, i)]).sum();
            grown[(at + 1, place(i))] = cross;
            grown[(place(i), at + 1)] = cross;
        }
        let own: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(at, at).into();
        let mounting_part = (theta_by * own * theta_by.transpose())[0];
        grown[(at, at)] = variance;
        grown[(at, at + 1)] = theta_by_distance * variance;
        grown[(at + 1, at)] = theta_by_distance * variance;
        grown[(at + 1, at + 1)] = mounting_part
            + theta_by_distance * theta_by_distance * variance
            + (scale * self.options.bearing_sigma_rad).powi(2);
        self.covariance = grown;
        self.ids.push(id);
        self.features.push(feature);
    }
}
