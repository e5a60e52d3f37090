//! The paper's filter: state (28), dynamics (29), observation (30), the Jacobians of appendix A.4 and the noise (31).

use nalgebra::{Cholesky, DMatrix, DVector, Matrix2, Matrix3, RowVector2, RowVector3, Vector2, Vector3};

use super::mounting::Mounting;
use super::odometry::WheelMotion;
use super::options::SelfCalibratorOptions;
use super::outcome::Outcome;
use crate::geometry::wrap_angle;

/// A feature in polar coordinates: `D`, the distance of the robot from it, and `theta`, the robot's heading against the
/// direction from the feature to the robot (eq. 19).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Feature {
    /// `D`, metres.
    pub distance_m: f64,
    /// `theta`, radians.
    pub theta_rad: f64,
}

/// The dynamics of one feature, eq. 26.
pub fn dynamics(feature: &Feature, motion: &WheelMotion, wheel_base_m: f64) -> Feature {
    let (d, t) = (motion.distance_m(), motion.turn_rad(wheel_base_m));
    Feature {
        distance_m: feature.distance_m + d * feature.theta_rad.cos(),
        theta_rad: feature.theta_rad + t - d / feature.distance_m * feature.theta_rad.sin(),
    }
}

/// The Jacobians `A` by (D, theta) and `B` by (right, left) of [`dynamics`], eq. 32.
pub fn dynamics_jacobians(feature: &Feature, motion: &WheelMotion, wheel_base_m: f64) -> (Matrix2<f64>, Matrix2<f64>) {
    let (d, distance) = (motion.distance_m(), feature.distance_m);
    let (sin, cos) = feature.theta_rad.sin_cos();
    let a = Matrix2::new(1.0, -d * sin, d / (distance * distance) * sin, 1.0 - d / distance * cos);
    let (half, e) = (0.5 * sin / distance, 1.0 / wheel_base_m);
    (a, Matrix2::new(0.5 * cos, 0.5 * cos, e - half, -e - half))
}

/// The bearing of a feature, eq. 27, in (-pi, pi], with the mounting as (phi, rho, psi).
pub fn observation(feature: &Feature, mounting: &Vector3<f64>) -> f64 {
    let (phi, rho, psi) = (mounting.x, mounting.y, mounting.z);
    let gamma = feature.theta_rad + phi;
    let alpha = (-rho * gamma.sin()).atan2(-feature.distance_m - rho * gamma.cos());
    wrap_angle(alpha - gamma - psi)
}

/// The Jacobians of [`observation`]: (H1, H2) by (D, theta) and (H3, H4, -1) by (phi, rho, psi), appendix A.4.
pub fn observation_jacobians(feature: &Feature, mounting: &Vector3<f64>) -> (RowVector2<f64>, RowVector3<f64>) {
    let (d, rho) = (feature.distance_m, mounting.y);
    let (sin, cos) = (feature.theta_rad + mounting.x).sin_cos();
    let scale = 1.0 / (d * d + 2.0 * rho * d * cos + rho * rho);
    let turn = (-d * rho * cos - d * d) * scale;
    (RowVector2::new(-rho * sin * scale, turn), RowVector3::new(turn, d * sin * scale, -1.0))
}

/// The `theta` at which a feature at distance `D` is seen at this bearing.
fn theta_of(distance: f64, bearing: f64, mounting: &Vector3<f64>) -> f64 {
    let camera = Mounting::from_polar(mounting.x, mounting.y, mounting.z);
    let (sin, cos) = (bearing + mounting.x + mounting.z).sin_cos();
    let along = camera.x_m * cos + camera.y_m * sin;
    let reach = -along + (along * along - mounting.y * mounting.y + distance * distance).max(0.0).sqrt();
    (camera.y_m + reach * sin).atan2(-(camera.x_m + reach * cos))
}

/// The extended Kalman filter of section 8.2, the state ordered as eq. 28 has it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct PaperFilter {
    options: SelfCalibratorOptions,
    names: Vec<u64>,
    features: Vec<Feature>,
    /// (phi, rho, psi).
    mounting: Vector3<f64>,
    covariance: DMatrix<f64>,
}

impl PaperFilter {
    pub(super) fn new(options: &SelfCalibratorOptions) -> Self {
        let start = options.start;
        let j = start.polar_by_vector();
        let covariance = j * options.start_covariance * j.transpose();
        Self {
            options: *options,
            names: Vec::new(),
            features: Vec::new(),
            mounting: Vector3::new(start.phi_rad(), start.rho_m(), start.psi_rad()),
            covariance: DMatrix::from_column_slice(3, 3, covariance.as_slice()),
        }
    }

    /// (phi, rho, psi) and its covariance; `None` once the filter has diverged beyond numbers.
    pub(super) fn mounting(&self) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let at = 2 * self.features.len();
        let covariance: Matrix3<f64> = self.covariance.fixed_view::<3, 3>(at, at).into();
        let finite = self.mounting.iter().chain(covariance.iter()).all(|x| x.is_finite());
        (finite && covariance.diagonal().min() >= 0.0).then_some((self.mounting, covariance))
    }

    /// Whether there are as many of everything as there are features.
    pub(super) fn is_consistent(&self) -> bool {
        let width = 2 * self.features.len() + 3;
        self.names.len() == self.features.len() && self.covariance.shape() == (width, width)
    }

    pub(super) fn landmarks(&self) -> usize {
        self.features.len()
    }

    pub(super) fn step(&mut self, motion: &WheelMotion, seen: &[(u64, f64)]) -> Outcome {
        self.predict(motion);
        let mut outcome = Outcome::default();
        let mut known = Vec::with_capacity(seen.len());
        let mut fresh = Vec::new();
        for &(name, bearing) in seen {
            match self.names.iter().position(|n| *n == name) {
                Some(i) => known.push((i, bearing)),
                None => fresh.push((name, bearing)),
            }
        }
        if let Some(nis) = self.update(&known) {
            outcome.nis = nis;
            outcome.used = known.len();
        }
        for (name, bearing) in fresh {
            self.start(name, bearing);
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
        let spread = &by_wheels * DMatrix::from_column_slice(2, 2, noise.as_slice());
        self.covariance.gemm(1.0, &spread, &by_wheels.transpose(), 1.0);
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
        let spread = &h * &self.covariance;
        let mut s = &spread * h.transpose();
        for k in 0..known.len() {
            s[(k, k)] += self.options.bearing_sigma_rad.powi(2);
        }
        let factor = Cholesky::new(s)?;
        let gain = factor.solve(&spread).transpose();
        let nis = innovation.dot(&factor.solve(&innovation));
        let step = &gain * innovation;
        for (i, feature) in self.features.iter_mut().enumerate() {
            feature.distance_m += step[2 * i];
            feature.theta_rad += step[2 * i + 1];
        }
        self.mounting += step.fixed_rows::<3>(at);
        self.covariance.gemm(-1.0, &gain, &spread, 1.0);
        let transposed = self.covariance.transpose();
        self.covariance += transposed;
        self.covariance *= 0.5;
        Some(nis)
    }

    /// Takes up a feature at the start distance, in the direction in which it is seen. The observation equation gives the
    /// error of `theta` from those of the distance, the mounting and the bearing.
    fn start(&mut self, name: u64, bearing: f64) {
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
        self.names.push(name);
        self.features.push(feature);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selfcalib::odometry::{Leg, Wheels, compose};
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn feature() -> impl Strategy<Value = Feature> {
        (0.8..6.0f64, -3.0..3.0f64).prop_map(|(distance_m, theta_rad)| Feature { distance_m, theta_rad })
    }

    fn mounting() -> impl Strategy<Value = Vector3<f64>> {
        (-3.0..3.0f64, 0.01..0.5f64, -3.0..3.0f64).prop_map(|(phi, rho, psi)| Vector3::new(phi, rho, psi))
    }

    const H: f64 = 1e-6;

    proptest! {
        #[test]
        fn dynamics_have_the_jacobians_of_the_appendix(f in feature(), left in -0.2..0.2f64, right in -0.2..0.2f64) {
            let motion = WheelMotion { left_m: left, right_m: right };
            let (a, b) = dynamics_jacobians(&f, &motion, 0.4);
            let at = |d: f64, t: f64, r: f64, l: f64| {
                let f = Feature { distance_m: f.distance_m + d, theta_rad: f.theta_rad + t };
                let next = dynamics(&f, &WheelMotion { left_m: left + l, right_m: right + r }, 0.4);
                Vector2::new(next.distance_m, next.theta_rad)
            };
            let given = [a.column(0), a.column(1), b.column(0), b.column(1)];
            for (k, given) in given.iter().enumerate() {
                let d = |s: f64| { let mut x = [0.0; 4]; x[k] = s; at(x[0], x[1], x[2], x[3]) };
                prop_assert!(((d(H) - d(-H)) / (2.0 * H) - given).amax() < 1e-7);
            }
        }

        #[test]
        fn the_observation_has_the_jacobian_of_the_appendix(f in feature(), m in mounting()) {
            let (by_feature, by_mounting) = observation_jacobians(&f, &m);
            let at = |x: [f64; 5]| observation(
                &Feature { distance_m: f.distance_m + x[0], theta_rad: f.theta_rad + x[1] },
                &(m + Vector3::new(x[2], x[3], x[4])),
            );
            let given = [by_feature[0], by_feature[1], by_mounting[0], by_mounting[1], by_mounting[2]];
            for (k, given) in given.iter().enumerate() {
                let d = |s: f64| { let mut x = [0.0; 5]; x[k] = s; at(x) };
                prop_assert!((wrap_angle(d(H) - d(-H)) / (2.0 * H) - given).abs() < 1e-7);
            }
        }

        #[test]
        fn the_observation_is_that_of_the_plane(
            x in -3.0..3.0f64, y in 1.0..3.0f64, heading in -3.0..3.0f64, m in mounting(),
        ) {
            // The feature at the origin: eqs. 16 and 17.
            let f = Feature { distance_m: x.hypot(y), theta_rad: heading - y.atan2(x) };
            let camera = Vector2::new(x + m.y * (heading + m.x).cos(), y + m.y * (heading + m.x).sin());
            let expected = (-camera.y).atan2(-camera.x) - heading - m.x - m.z;
            prop_assert!(wrap_angle(observation(&f, &m) - expected).abs() < 1e-9);
            let seen = theta_of(f.distance_m, observation(&f, &m), &m);
            prop_assert!(wrap_angle(seen - f.theta_rad).abs() < 1e-9);
        }

        #[test]
        fn short_steps_follow_the_plane(x in -3.0..3.0f64, y in 1.0..3.0f64, heading in -3.0..3.0f64) {
            let f = Feature { distance_m: x.hypot(y), theta_rad: heading - y.atan2(x) };
            let motion = WheelMotion { left_m: 1e-4, right_m: 1.5e-4 };
            let leg = Leg::from_wheels(&motion, &Wheels::new(0.4), &crate::selfcalib::odometry::MotionNoise::new(1e-5));
            let pose = compose(&Vector3::new(x, y, heading), &leg.motion);
            let next = dynamics(&f, &motion, 0.4);
            prop_assert!((next.distance_m - pose.x.hypot(pose.y)).abs() < 1e-7);
            prop_assert!(wrap_angle(next.theta_rad - (pose.z - pose.y.atan2(pose.x))).abs() < 1e-7);
        }
    }

    #[test]
    fn a_feature_to_the_left() {
        // At the origin of camera and robot: theta of a feature to the left is a quarter of a turn.
        let seen = Feature { distance_m: 2.0, theta_rad: FRAC_PI_2 };
        assert!((observation(&seen, &Vector3::zeros()) - FRAC_PI_2).abs() < 1e-12);
    }
}
