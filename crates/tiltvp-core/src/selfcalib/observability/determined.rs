//! What a drive has determined so far, without the information at the start.

use std::fmt;

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use crate::selfcalib::model::Mounting;

/// Standard deviation below which an angle counts as determined by the drive, radians: 3 degrees, a tenth of the default's start.
const ANGLE_SIGMA: f64 = 0.05;

/// Standard deviation below which a distance counts as determined, metres and as a share of itself: a tenth of the rho of the
/// robots of Scaramuzza et al. (2009) and of the logs measured here, and what the angles allow at larger ones.
const DISTANCE_SIGMA_M: f64 = 0.02;
const DISTANCE_SHARE: f64 = 0.05;

/// Standard deviations of rho within which it may be zero.
const NEAR_ZERO_SIGMAS: f64 = 3.0;

/// The rho at which it is zero to rounding, metres.
const ZERO_M: f64 = 1e-9;

/// Information below which a direction of (x, y, yaw) counts as unknown: a standard deviation of 3e4 m or rad.
const LEAST_INFORMATION: f64 = 1e-9;

/// What the drive so far has determined, without the information at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "one answer for each quantity")]
pub struct Observability {
    /// Standard deviations of (phi, rho, psi) from bearings and odometry alone; infinite where they tell nothing.
    pub sigma_phi_rho_psi: Vector3<f64>,
    /// Standard deviations of (x, y, yaw) from them alone.
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
    /// From the covariances of (x, y, yaw) now and at the start: what the drive added to the information.
    pub(crate) fn new(mounting: &Mounting, now: &Matrix3<f64>, start: &Matrix3<f64>) -> Self {
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
        let near_zero = rho < NEAR_ZERO_SIGMAS * polar.y.min(across) || rho < ZERO_M;
        let place = sigma_xy_yaw.x.max(sigma_xy_yaw.y);
        Self {
            sigma_phi_rho_psi: polar,
            sigma_xy_yaw,
            phi: polar.x < ANGLE_SIGMA && !near_zero,
            rho: polar.y.min(if near_zero { place } else { f64::INFINITY })
                < DISTANCE_SIGMA_M.max(DISTANCE_SHARE * rho),
            psi: polar.z < ANGLE_SIGMA && !near_zero,
            yaw: sigma_xy_yaw.z < ANGLE_SIGMA,
            rho_near_zero: near_zero && place < DISTANCE_SIGMA_M.max(DISTANCE_SHARE * rho),
        }
    }

    /// Whether everything is determined.
    pub fn complete(&self) -> bool {
        self.yaw && self.rho && (self.rho_near_zero || (self.phi && self.psi))
    }

    /// The motion that would determine the rest.
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

/// The inverse of an information matrix, very large in the directions that it does not determine.
fn inverted(information: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(0.5 * (information + information.transpose()));
    let mut inverse = Matrix3::zeros();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        inverse += vector * vector.transpose() / value.max(LEAST_INFORMATION);
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
