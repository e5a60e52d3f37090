//! What a motion can tell about the mounting: the rank conditions of section 8.1, and what a drive has told so far.

use std::fmt;

use nalgebra::{DMatrix, Matrix3, RowSVector, SymmetricEigen, Vector3};

use super::mounting::Mounting;

/// A motion of section 8.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PureMotion {
    /// Turning about the middle of the axle.
    Rotation,
    /// Driving straight on.
    Straight,
    /// Both, one after the other.
    Both,
}

/// Where the observed feature is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeatureRange {
    /// So far that eq. 25 holds: `beta = -theta - phi - psi`.
    Far,
    /// Near enough for eq. 24.
    Close,
}

/// The dimension of the observable part of (D, theta, phi, rho, psi) when one feature is observed during a motion: the rank
/// of the gradients of the bearing along it, whose Taylor coefficients are the Lie derivatives of section 8.1.
///
/// `state` is (D, theta, phi, rho, psi) at the start of the motion. For both motions the straight one observes the feature
/// in the given range, and the rotation from close.
pub fn observable_dimension(state: &[f64; 5], motion: PureMotion, range: FeatureRange) -> usize {
    let samples = 12;
    let mut rows = Vec::new();
    let (rotation, straight) = (motion != PureMotion::Straight, motion != PureMotion::Rotation);
    for i in 0..samples {
        let s = f64::from(i) / f64::from(samples - 1);
        if straight {
            rows.push(gradient(state, 0.5 * state[0] * s, 0.0, range));
        }
        if rotation {
            let range = if motion == PureMotion::Both { FeatureRange::Close } else { range };
            rows.push(gradient(state, 0.0, 2.5 * s, range));
        }
    }
    let jacobian = DMatrix::from_fn(rows.len(), 5, |r, c| rows[r][c]);
    let values = jacobian.singular_values();
    values.iter().filter(|value| **value > 1e-8 * values.max()).count()
}

/// The derivative by (D, theta, phi, rho, psi) at the start of the bearing after driving `way` straight on and turning.
fn gradient(state: &[f64; 5], way: f64, turn: f64, range: FeatureRange) -> RowSVector<f64, 5> {
    let [distance, theta, phi, rho, _] = *state;
    // The feature at the origin, the robot on the x axis.
    let (x, y) = (distance + way * theta.cos(), way * theta.sin());
    let far = x.hypot(y);
    // By D and theta at the start.
    let distance_by = [x / far, way * (-x * theta.sin() + y * theta.cos()) / far];
    let direction_by = [-y / (far * far), way * (x * theta.cos() + y * theta.sin()) / (far * far)];
    let now = theta + turn - y.atan2(x);
    let theta_by = [-direction_by[0], 1.0 - direction_by[1]];
    let (sin, cos) = (now + phi).sin_cos();
    let scale = 1.0 / (far * far + 2.0 * rho * far * cos + rho * rho);
    let (h1, h2, h4) = match range {
        FeatureRange::Far => (0.0, -1.0, 0.0),
        FeatureRange::Close => (-rho * sin * scale, -(far * rho * cos + far * far) * scale, far * sin * scale),
    };
    RowSVector::from([h1 * distance_by[0] + h2 * theta_by[0], h1 * distance_by[1] + h2 * theta_by[1], h2, h4, -1.0])
}

/// Standard deviation below which an angle counts as determined by the drive, radians.
const ANGLE_SIGMA: f64 = 0.05;

/// Standard deviation below which a distance counts as determined, metres and as a share of itself.
const DISTANCE_SIGMA: (f64, f64) = (0.02, 0.05);

/// What the motion so far has determined, without what was believed at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "one answer for each quantity")]
pub struct Observability {
    /// Standard deviations of (phi, rho, psi) by the bearings and the odometry alone; infinite where they say nothing.
    pub sigma_phi_rho_psi: Vector3<f64>,
    /// Standard deviations of (x, y, yaw) by them alone.
    pub sigma_xy_yaw: Vector3<f64>,
    /// Whether phi is determined: to 0.05 rad, at a rho beyond three of its standard deviations.
    pub phi: bool,
    /// Whether rho is determined: to 0.02 m, or to 5 % of itself.
    pub rho: bool,
    /// Whether psi is determined: to 0.05 rad.
    pub psi: bool,
    /// Whether yaw = phi + psi is determined: to 0.05 rad.
    pub yaw: bool,
    /// Whether rho is not significantly above zero, so that phi and psi mean little, while x, y and yaw are known.
    pub rho_near_zero: bool,
}

impl Observability {
    /// From what is believed now and what was believed at the start, as covariances of (x, y, yaw).
    pub(super) fn new(mounting: &Mounting, now: &Matrix3<f64>, start: &Matrix3<f64>) -> Self {
        let without = match (now.try_inverse(), start.try_inverse()) {
            (Some(now), Some(start)) => inverted(&(now - start)),
            _ => Matrix3::repeat(f64::INFINITY),
        };
        let sigma = |m: &Matrix3<f64>| m.diagonal().map(|v| if v >= 0.0 { v.sqrt() } else { f64::INFINITY });
        let sigma_xy_yaw = sigma(&without);
        let j = mounting.polar_by_vector();
        let polar = if without.iter().chain(j.iter()).all(|x| x.is_finite()) {
            sigma(&(j * without * j.transpose()))
        } else {
            Vector3::repeat(f64::INFINITY)
        };
        let rho = mounting.rho_m();
        let across = (sigma_xy_yaw.x.powi(2) + sigma_xy_yaw.y.powi(2)).sqrt();
        let near_zero = rho < 3.0 * polar.y.min(across) || rho < 1e-9;
        let place = sigma_xy_yaw.x.max(sigma_xy_yaw.y);
        Self {
            sigma_phi_rho_psi: polar,
            sigma_xy_yaw,
            phi: polar.x < ANGLE_SIGMA && !near_zero,
            rho: polar.y.min(if near_zero { place } else { f64::INFINITY })
                < DISTANCE_SIGMA.0.max(DISTANCE_SIGMA.1 * rho),
            psi: polar.z < ANGLE_SIGMA && !near_zero,
            yaw: sigma_xy_yaw.z < ANGLE_SIGMA,
            rho_near_zero: near_zero && place < DISTANCE_SIGMA.0.max(DISTANCE_SIGMA.1 * rho),
        }
    }

    /// Whether everything there is to know is determined.
    pub fn complete(&self) -> bool {
        self.yaw && self.rho && (self.rho_near_zero || (self.phi && self.psi))
    }

    /// What motion would determine what is not.
    pub fn advice(&self) -> &'static str {
        if self.complete() {
            "nothing is missing"
        } else if !self.yaw {
            "drive straight on past features for yaw = phi + psi, then rotate in place near a feature"
        } else {
            "rotate in place near a feature, after driving straight on past it, for phi, rho and psi"
        }
    }
}

/// The inverse of an information matrix, infinite in all that its flat directions touch.
fn inverted(information: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(0.5 * (information + information.transpose()));
    let mut inverse = Matrix3::zeros();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        inverse += vector * vector.transpose() / value.max(1e-9);
    }
    inverse
}

impl fmt::Display for Observability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [("phi", self.phi), ("rho", self.rho), ("psi", self.psi), ("yaw", self.yaw)];
        let words = |wanted: bool| {
            let names: Vec<&str> = parts.iter().filter(|(_, known)| *known == wanted).map(|(name, _)| *name).collect();
            if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
        };
        write!(f, "determined: {}; not determined: {}", words(true), words(false))?;
        if self.rho_near_zero {
            write!(f, "; rho is not significantly above zero, where phi and psi mean nothing: use x, y and yaw")?;
        }
        if self.complete() { Ok(()) } else { write!(f, "; {}", self.advice()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3 as M;
    use proptest::prelude::*;

    fn state() -> impl Strategy<Value = [f64; 5]> {
        (0.6..3.0f64, 0.3..1.2f64, -1.2..1.2f64, 0.1..0.4f64, -1.2..1.2f64)
            .prop_map(|(d, t, phi, rho, psi)| [d, t, phi, rho, psi])
    }

    proptest! {
        #[test]
        fn the_four_cases_of_the_paper(s in state()) {
            use FeatureRange::{Close, Far};
            // 8.1.1: the sum of theta, phi and psi. 8.1.2: D, theta and eta. 8.1.3: lambda, gamma and psi. 8.1.4: not all.
            prop_assert_eq!(observable_dimension(&s, PureMotion::Rotation, Far), 1);
            prop_assert_eq!(observable_dimension(&s, PureMotion::Straight, Far), 3);
            prop_assert_eq!(observable_dimension(&s, PureMotion::Rotation, Close), 3);
            prop_assert!(observable_dimension(&s, PureMotion::Straight, Close) < 5);
            // The remark that ends 8.1: straight far from the feature, then rotations close to it.
            prop_assert_eq!(observable_dimension(&s, PureMotion::Both, Far), 5);
        }

        #[test]
        fn the_determinant_of_a_1(d in 0.5..5.0f64, t in -3.0..3.0f64) {
            let m = M::new(
                0.0, -1.0, -1.0,
                -t.sin() / (d * d), t.cos() / d, 0.0,
                2.0 * (2.0 * t).sin() / d.powi(3), -2.0 * (2.0 * t).cos() / (d * d), 0.0,
            );
            prop_assert!((m.determinant() - 2.0 * t.sin() / d.powi(4)).abs() < 1e-9 * (1.0 + d.powi(-4)));
        }

        #[test]
        fn the_determinant_of_a_2(l in 1.2..5.0f64, g in -3.0..3.0f64) {
            // Derivatives along gamma of beta = atan(sin g / (l + cos g)) - g - psi, of which psi is in the first only.
            let first = |l: f64, g: f64| (l * g.cos() + 1.0) / (l * l + 2.0 * l * g.cos() + 1.0) - 1.0;
            let h = 1e-4;
            let second = |l: f64, g: f64| (first(l, g + h) - first(l, g - h)) / (2.0 * h);
            let by = |f: &dyn Fn(f64, f64) -> f64| {
                [(f(l + h, g) - f(l - h, g)) / (2.0 * h), (f(l, g + h) - f(l, g - h)) / (2.0 * h)]
            };
            let (a, b) = (by(&first), by(&second));
            let determinant = -(a[0] * b[1] - a[1] * b[0]);
            let printed = -l * (l * l - 1.0) / (l * l + 2.0 * l * g.cos() + 1.0).powi(3);
            prop_assert!((determinant - printed).abs() < 1e-4 * (1.0 + printed.abs()), "{determinant} {printed}");
        }
    }
}
