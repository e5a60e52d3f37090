//! The tilt over time: a Kalman filter of the ground normal on the sphere, which fuses the estimates of successive images.

mod model;
mod options;
mod report;
mod state;

use nalgebra::{Matrix2, Matrix2x6, Matrix6, Rotation2, Rotation3, Vector3};

pub use self::options::{MountingOptions, TiltFilterOptions};
pub use self::report::{FilteredTilt, Verdict};
pub use self::state::TiltFilterState;
use self::state::{FLOOR, MOUNTING, SCENE, add, is_of_angles, no_covariance, of_angles, of_scene, of_state};
use super::confidence;
use super::estimate::TiltEstimate;
use crate::error::{Error, Result};
use crate::filter::{ChiSquareGate, Innovation, symmetric};
use crate::geometry::{Tilt, tangent_basis, tangent_exp, tangent_log, tangent_transport};

/// A recursive filter of the robot's ground normal.
///
/// **State.** On a floor that is plane but not level, the ground normal in the frame of the wheels, `f`, turns with the robot:
/// after a turn of `yaw` to the left, `f' = Rz(-yaw) f`. A lean of the robot itself (a mounting error, a soft wheel, a load)
/// stays where it is, `m`. The robot sees `n = B(m) f` with the smallest rotation `B(m)` that takes `z` to `m`. Without
/// [`TiltFilterOptions::mounting`] `m` is `z`; with it, turning tells `f` and `m` apart.
///
/// **Motion.** The floor's tilt walks randomly, by a variance for each metre that the wheels roll and one for each
/// prediction; steps of it (a threshold, a ramp) are left to the gate. Wheels roll also while a robot turns in place.
///
/// **Measurement.** An estimate is `n` with an error of covariance `R` (and the noise floor). Images of one place err alike:
/// the error `c` of the scene is a state, of which only so much is new in an image as the robot has driven on. Its covariance
/// is `s C`, a share of that of the best image of the place: with `rho = exp(-driven / correlation)` and `K = min(C, R)`
///
/// ```text
/// cov(c', c) = s rho K,   C' = rho^2 K + (1 - rho^2) R,   n measured = n + c' + noise of covariance R - s C'
/// ```
///
/// The scene turns with the floor, for walls out of plumb do. A robot that stands still therefore never knows its tilt
/// better than by the share `s` of its best image's covariance, however many images it takes.
///
/// **Gate.** An estimate whose normalised innovation squared is beyond the chi-square gate is left out. If `jump_after` of
/// them in a row agree with each other, the floor has changed: its tilt is forgotten, that of the mounting is not. If
/// `lost_after` in a row are left out, agreeing or not, the floor's tilt is unknown, and the filter abstains.
///
/// **Images that repeat.** Estimates of images ([`update`](Self::update)) that stay the same to the last bit while the wheels
/// roll are left out from the second on: a camera that is frozen tells nothing of where the robot is now.
#[derive(Debug, Clone, PartialEq)]
pub struct TiltFilter {
    options: TiltFilterOptions,
    gate: ChiSquareGate,
    state: TiltFilterState,
}

/// How far the wheels may roll, in metres, while images stay the same: a thousand times as far as views of 160 x 120 pixels,
/// drawn without noise, take to differ (1e-5 in each of eight), and more than slack lets wheels of a robot that stands tell.
const STILL_M: f64 = 0.01;

/// A checked measurement: the normal and its covariance, noise floor included, in the tangent basis at the normal.
#[derive(Clone, Copy)]
struct Measured {
    normal: Vector3<f64>,
    covariance: Matrix2<f64>,
}

impl TiltFilter {
    /// A filter that knows nothing yet.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] of [`TiltFilterOptions::validate`].
    pub fn new(options: TiltFilterOptions) -> Result<Self> {
        options.validate()?;
        let gate = ChiSquareGate::new(options.gate_probability, 2)?;
        Ok(Self { options, gate, state: TiltFilterState::unknown(&options) })
    }

    /// The filter of a state that [`state`](Self::state) gave.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless normals have length one and covariances can be such of angles, and the errors of `new`.
    pub fn with_state(options: TiltFilterOptions, state: TiltFilterState) -> Result<Self> {
        state.validate()?;
        Ok(Self { state, ..Self::new(options)? })
    }

    /// The options.
    pub fn options(&self) -> &TiltFilterOptions {
        &self.options
    }

    /// Everything that is known.
    pub fn state(&self) -> &TiltFilterState {
        &self.state
    }

    /// The largest normalised innovation squared that passes the gate.
    pub fn nis_limit(&self) -> f64 {
        self.gate.limit()
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.state = TiltFilterState::unknown(&self.options);
    }

    /// The robot has turned by `yaw_rad` (to the left positive) and driven `distance_m` (in either direction) since the last
    /// call.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless both are finite; the filter is as before.
    pub fn predict(&mut self, yaw_rad: f64, distance_m: f64) -> Result<()> {
        for (name, value) in [("yaw_rad", yaw_rad), ("distance_m", distance_m)] {
            if !value.is_finite() {
                return Err(Error::argument(name, value, "a finite number"));
            }
        }
        let (options, state) = (&self.options, &mut self.state);
        let distance_m = distance_m.abs();
        // No step, however long, makes a tilt more unknown than it was before anything was known.
        let grown = |variance: f64, prior: f64| variance.min(prior * prior);
        let rolled_m = distance_m.max(options.half_track_m * yaw_rad.abs());
        let walk = options.walk_rad_per_sqrt_m.powi(2) * rolled_m + options.walk_rad_per_sqrt_step.powi(2);
        let floor_walk = Matrix2::identity() * grown(walk, options.prior_rad);

        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -yaw_rad).into_inner();
        let plane_turn = *Rotation2::new(-yaw_rad).matrix();
        let turned = (turn * state.floor).normalize();
        let mut transition = Matrix6::identity();
        transition
            .fixed_view_mut::<2, 2>(FLOOR, FLOOR)
            .copy_from(&(tangent_basis(&turned).transpose() * turn * tangent_basis(&state.floor)));
        transition.fixed_view_mut::<2, 2>(SCENE, SCENE).copy_from(&plane_turn);
        state.covariance = symmetric(&(transition * state.covariance * transition.transpose()));
        add(&mut state.covariance, FLOOR, &floor_walk);
        if let Some(mounting) = &options.mounting {
            let walk = grown(mounting.walk_rad_per_sqrt_m.powi(2) * distance_m, mounting.prior_rad);
            add(&mut state.covariance, MOUNTING, &(Matrix2::identity() * walk));
        }
        state.covariance = of_state(&state.covariance);
        state.floor = turned;
        state.scene = of_scene(&(plane_turn * state.scene));
        state.common = state.common.map(|common| symmetric(&(plane_turn * common * plane_turn.transpose())));
        state.driven_m += distance_m;
        state.rolled_m += rolled_m;
        let wheels = model::robot_from_wheels(&state.mounting);
        state.pending = state.pending.map(|(normal, covariance)| {
            let robot_turn = wheels * turn * wheels.transpose();
            let there = (robot_turn * normal).normalize();
            let carried = tangent_basis(&there).transpose() * robot_turn * tangent_basis(&normal);
            (there, of_angles(&symmetric(&(carried * covariance * carried.transpose() + floor_walk))))
        });
        Ok(())
    }

    /// Fuses the tilt of an image, unless it has none, trusts itself too little, or is outside the gate; says what it did.
    pub fn update(&mut self, estimate: &TiltEstimate) -> Verdict {
        self.update_tilt(estimate.tilt, &estimate.covariance_rad2, estimate.confidence)
    }

    /// [`update`](Self::update) by what it looks at: the tilt, its covariance and its confidence. One of no finite angles is none.
    pub fn update_tilt(&mut self, tilt: Option<Tilt>, covariance_rad2: &Matrix2<f64>, confidence: f64) -> Verdict {
        let normal = tilt.and_then(|tilt| Tilt::from_normal(&tilt.normal())).map(|tilt| tilt.normal());
        let Some(normal) = normal.filter(|_| is_of_angles(covariance_rad2)) else { return Verdict::NoTilt };
        let told = Some((normal, *covariance_rad2));
        let rolled_m = if self.state.latest == told { self.state.rolled_m } else { 0.0 };
        if rolled_m > STILL_M {
            return Verdict::Repeated { rolled_m, limit_m: STILL_M };
        }
        let verdict = self.fuse(normal, covariance_rad2, confidence);
        if !matches!(verdict, Verdict::LowConfidence { .. }) {
            (self.state.latest, self.state.rolled_m) = (told, rolled_m);
        }
        verdict
    }

    /// Fuses a ground normal of any length with a covariance in squared radians in its tangent plane, in the basis of
    /// [`tangent_basis`]; its confidence is the probability of an error below two degrees under that covariance.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for a normal that is zero or not finite, and for a matrix that is no covariance of angles;
    /// the filter is as before.
    pub fn update_normal(&mut self, normal: &Vector3<f64>, covariance_rad2: &Matrix2<f64>) -> Result<Verdict> {
        let Some(tilt) = Tilt::from_normal(normal) else {
            let got = format!("[{}, {}, {}]", normal.x, normal.y, normal.z);
            return Err(Error::argument("normal", got, "a finite vector that is not zero"));
        };
        if !is_of_angles(covariance_rad2) {
            return Err(no_covariance("covariance_rad2", covariance_rad2));
        }
        Ok(self.fuse(tilt.normal(), covariance_rad2, confidence::confidence(covariance_rad2)))
    }

    /// The ground normal in the robot's frame: floor and mounting together.
    pub fn estimate(&self) -> FilteredTilt {
        let state = &self.state;
        let jacobian = self.jacobian(false);
        let covariance = symmetric(&(jacobian * state.covariance * jacobian.transpose()));
        self.filtered(&model::normal_of(&state.floor, &state.mounting), covariance)
    }

    /// The floor's part alone, in the frame of the wheels.
    pub fn floor(&self) -> FilteredTilt {
        self.filtered(&self.state.floor, self.state.covariance.fixed_view::<2, 2>(FLOOR, FLOOR).into_owned())
    }

    /// The robot's own part alone: what it would see on level ground. `None` if it is not estimated.
    pub fn mounting(&self) -> Option<FilteredTilt> {
        let covariance = self.state.covariance.fixed_view::<2, 2>(MOUNTING, MOUNTING).into_owned();
        self.options.mounting.map(|_| self.filtered(&self.state.mounting, covariance))
    }

    fn filtered(&self, normal: &Vector3<f64>, covariance: Matrix2<f64>) -> FilteredTilt {
        let tilt = Tilt::from_normal(normal).unwrap_or(Tilt::UPRIGHT);
        FilteredTilt::new(tilt, covariance, self.options.sigma_max_rad)
    }

    fn fuse(&mut self, normal: Vector3<f64>, covariance_rad2: &Matrix2<f64>, confidence: f64) -> Verdict {
        let options = self.options;
        if confidence.is_nan() || confidence < options.confidence_min {
            return Verdict::LowConfidence { confidence, limit: options.confidence_min };
        }
        let floor = Matrix2::identity() * (options.noise_floor_rad * options.noise_floor_rad);
        let measured = Measured { normal, covariance: of_angles(&(symmetric(covariance_rad2) + floor)) };
        let limit = self.gate.limit();
        let before = self.state.covariance;
        let (nis, corrected) = self.corrected(&measured, &before);
        if let Some(corrected) = corrected.filter(|_| self.gate.passes(nis)) {
            self.state = corrected;
            return Verdict::Accepted { nis, limit };
        }
        let agrees = self.state.pending.is_some_and(|pending| self.agree(pending, &measured));
        let agreeing = if agrees { self.state.agreeing.saturating_add(1) } else { 1 };
        let rejected = self.state.rejected.saturating_add(1);
        if agreeing >= options.jump_after {
            let mut open = before;
            add(&mut open, FLOOR, &(Matrix2::identity() * (options.prior_rad * options.prior_rad)));
            if let (_, Some(corrected)) = self.corrected(&measured, &open) {
                self.state = corrected;
                return Verdict::Jumped { nis, limit, agreeing };
            }
        }
        if rejected >= options.lost_after {
            self.forget_floor();
            return Verdict::Lost { nis, limit, rejected };
        }
        let state = &mut self.state;
        state.pending = Some((measured.normal, measured.covariance));
        (state.agreeing, state.rejected) = (agreeing, rejected);
        Verdict::OutsideGate { nis, limit, rejected }
    }

    /// The normalised innovation squared of a measurement, and the state after it, from the present means and a covariance.
    fn corrected(&self, measured: &Measured, covariance: &Matrix6<f64>) -> (f64, Option<TiltFilterState>) {
        let state = &self.state;
        let predicted = model::normal_of(&state.floor, &state.mounting);
        let carry = tangent_transport(&measured.normal, &predicted);
        let noise = symmetric(&(carry * measured.covariance * carry.transpose()));

        let (keep, fresh, common) = self.scene_motion(&noise);
        let mut transition = Matrix6::identity();
        transition.fixed_view_mut::<2, 2>(SCENE, SCENE).copy_from(&keep);
        let mut covariance = transition * covariance * transition.transpose();
        add(&mut covariance, SCENE, &fresh);
        let scene = keep * state.scene;

        let innovation = tangent_log(&predicted, &measured.normal) - scene;
        let own = noise - common * self.options.correlated_share;
        let Some(seen) = Innovation::new(symmetric(&covariance), self.jacobian(true), own, innovation) else {
            return (f64::INFINITY, None);
        };
        let (step, after) = seen.correct();
        let floor = tangent_exp(&state.floor, &step.fixed_rows::<2>(FLOOR).into_owned());
        let mounting = tangent_exp(&state.mounting, &step.fixed_rows::<2>(MOUNTING).into_owned());
        let mut moved = Matrix6::identity();
        moved.fixed_view_mut::<2, 2>(FLOOR, FLOOR).copy_from(&tangent_transport(&state.floor, &floor));
        moved.fixed_view_mut::<2, 2>(MOUNTING, MOUNTING).copy_from(&tangent_transport(&state.mounting, &mounting));
        let after = TiltFilterState {
            floor,
            mounting,
            scene: of_scene(&(scene + step.fixed_rows::<2>(SCENE))),
            covariance: of_state(&symmetric(&(moved * after * moved.transpose()))),
            common: Some(common),
            driven_m: 0.0,
            pending: None,
            agreeing: 0,
            rejected: 0,
            latest: state.latest,
            rolled_m: state.rolled_m,
        };
        (seen.nis(), Some(after))
    }

    /// What becomes of the scene's error before an estimate of covariance `R` is fused: the factor `A = rho K C^-1` of what
    /// is kept, the covariance `s (C' - A C A^T)` of what is new, and `C'`.
    fn scene_motion(&self, noise: &Matrix2<f64>) -> (Matrix2<f64>, Matrix2<f64>, Matrix2<f64>) {
        let share = self.options.correlated_share;
        let rho = (-self.state.driven_m / self.options.correlation_m).exp();
        let kept = self.state.common.and_then(|before| {
            let shared = model::common_part(&before, noise)?;
            let keep = shared * before.try_inverse()? * rho;
            let common = symmetric(&(shared * (rho * rho) + noise * (1.0 - rho * rho)));
            Some((keep, symmetric(&(common - keep * before * keep.transpose())) * share, common))
        });
        kept.unwrap_or((Matrix2::zeros(), noise * share, *noise))
    }

    /// The Jacobian of the ground normal by the error state, with or without the scene's error on top.
    fn jacobian(&self, with_scene: bool) -> Matrix2x6<f64> {
        let (by_floor, by_mounting) = model::jacobians(&self.state.floor, &self.state.mounting);
        let mut jacobian = Matrix2x6::zeros();
        jacobian.fixed_view_mut::<2, 2>(0, FLOOR).copy_from(&by_floor);
        if self.options.mounting.is_some() {
            jacobian.fixed_view_mut::<2, 2>(0, MOUNTING).copy_from(&by_mounting);
        }
        if with_scene {
            jacobian.fixed_view_mut::<2, 2>(0, SCENE).copy_from(&Matrix2::identity());
        }
        jacobian
    }

    /// Whether two measurements that the gate has rejected may be of one tilt.
    fn agree(&self, (normal, covariance): (Vector3<f64>, Matrix2<f64>), measured: &Measured) -> bool {
        let carry = tangent_transport(&measured.normal, &normal);
        let spread = covariance + carry * measured.covariance * carry.transpose();
        let way = tangent_log(&normal, &measured.normal);
        crate::filter::squared_mahalanobis(&way, &symmetric(&spread)).is_some_and(|nis| self.gate.passes(nis))
    }

    /// The floor's tilt is as unknown as before the first image; the mounting stays.
    fn forget_floor(&mut self) {
        let mounting = self.state.mounting;
        let covariance = self.state.covariance.fixed_view::<2, 2>(MOUNTING, MOUNTING).into_owned();
        self.reset();
        self.state.mounting = mounting;
        self.state.covariance.fixed_view_mut::<2, 2>(MOUNTING, MOUNTING).copy_from(&covariance);
    }
}
