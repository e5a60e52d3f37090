//! What the tilt filter knows between two images.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix6, Vector2, Vector3};

use super::options::TiltFilterOptions;
use crate::error::{Error, Result};
use crate::filter::{positive_semidefinite, restored};

/// What a [`TiltFilter`](super::TiltFilter) knows, but for its options: everything the next answer depends on.
///
/// The covariance is that of the error state (floor, mounting, scene), two numbers each: walks from the floor's and the
/// mounting's normal in the basis of [`tangent_basis`](crate::geometry::tangent_basis) there, and the
/// error that successive images share, in radians along the robot's `x` and `y`.
#[derive(Debug, Clone, PartialEq)]
pub struct TiltFilterState {
    /// The ground normal in the frame of the wheels, `f`.
    pub floor: Vector3<f64>,
    /// The ground normal that the robot would see on level ground, `m`.
    pub mounting: Vector3<f64>,
    /// The error of the last estimate that the next image of the same place will share, `c`.
    pub scene: Vector2<f64>,
    /// Covariance of the error state, in squared radians.
    pub covariance: Matrix6<f64>,
    /// The covariance of the best estimate of this place, `C`, of which `c` is a share; `None` before the first.
    pub common: Option<Matrix2<f64>>,
    /// Metres driven since the last estimate fused.
    pub driven_m: f64,
    /// The last estimate rejected by the gate, with its covariance, if nothing has been fused since.
    pub pending: Option<(Vector3<f64>, Matrix2<f64>)>,
    /// How many rejected estimates in a row agree, that one included.
    pub agreeing: u32,
    /// How many estimates in a row the gate has rejected.
    pub rejected: u32,
    /// The last estimate of an image that was looked at, with its covariance as it was given.
    pub latest: Option<(Vector3<f64>, Matrix2<f64>)>,
    /// Metres that the wheels have rolled, turns in place included, since images told that estimate first.
    pub rolled_m: f64,
}

/// The floor's, the mounting's and the scene's place in the error state.
pub(super) const FLOOR: usize = 0;
pub(super) const MOUNTING: usize = 2;
pub(super) const SCENE: usize = 4;

/// The largest sum of the variances of an angle's two components, square radians: each is within pi of its mean.
const VARIANCES_MAX: f64 = 2.0 * PI * PI;

/// The same and what rounding may carry it above, as a share of it: that of covariances that are symmetric and positive
/// ([`positive_semidefinite`]).
const REACH: f64 = VARIANCES_MAX * (1.0 + 1e-9);

impl TiltFilterState {
    /// Before the first image.
    pub(super) fn unknown(options: &TiltFilterOptions) -> Self {
        let mut covariance = Matrix6::zeros();
        add(&mut covariance, FLOOR, &(Matrix2::identity() * options.prior_rad.powi(2)));
        if let Some(mounting) = &options.mounting {
            add(&mut covariance, MOUNTING, &(Matrix2::identity() * mounting.prior_rad.powi(2)));
        }
        Self {
            floor: Vector3::z(),
            mounting: Vector3::z(),
            scene: Vector2::zeros(),
            covariance,
            common: None,
            driven_m: 0.0,
            pending: None,
            agreeing: 0,
            rejected: 0,
            latest: None,
            rolled_m: 0.0,
        }
    }

    /// Checks that normals have length one and covariances can be such.
    pub(super) fn validate(&self) -> Result<()> {
        let unit = |name, v: &Vector3<f64>| {
            let good = (v.norm_squared() - 1.0).abs() < 1e-9;
            let got = || format!("[{}, {}, {}]", v.x, v.y, v.z);
            if good { Ok(()) } else { Err(Error::argument(name, got(), "a vector of length 1")) }
        };
        unit("floor", &self.floor)?;
        unit("mounting", &self.mounting)?;
        if of_scene(&self.scene) != self.scene {
            let got = format!("[{}, {}]", self.scene.x, self.scene.y);
            return Err(Error::argument("scene", got, "angles from -pi to pi"));
        }
        if !positive_semidefinite(&self.covariance) {
            return Err(Error::argument("covariance", "another matrix", "a covariance, symmetric and positive"));
        }
        for at in [FLOOR, MOUNTING, SCENE] {
            let block = self.covariance.fixed_view::<2, 2>(at, at).into_owned();
            if block.trace() > REACH {
                return Err(no_covariance("covariance", &block));
            }
        }
        let spread = |name, matrix: &Matrix2<f64>| {
            if matrix.cholesky().is_some() && is_of_angles(matrix) { Ok(()) } else { Err(no_covariance(name, matrix)) }
        };
        if let Some(common) = &self.common {
            spread("common", common)?;
        }
        if let Some((normal, covariance)) = &self.pending {
            unit("pending", normal)?;
            spread("pending", covariance)?;
        }
        if let Some((normal, covariance)) = &self.latest {
            unit("latest", normal)?;
            if !is_of_angles(covariance) {
                return Err(no_covariance("latest", covariance));
            }
        }
        // Infinity is what a sum of very long ways comes to.
        for (name, metres) in [("driven_m", self.driven_m), ("rolled_m", self.rolled_m)] {
            if metres.is_nan() || metres < 0.0 {
                return Err(Error::argument(name, metres, "a number of metres"));
            }
        }
        Ok(())
    }
}

/// Adds a block to the covariance of the error state.
pub(super) fn add(covariance: &mut Matrix6<f64>, at: usize, block: &Matrix2<f64>) {
    let mut view = covariance.fixed_view_mut::<2, 2>(at, at);
    view += block;
}

/// Whether a matrix can be the covariance of two angles.
pub(super) fn is_of_angles(matrix: &Matrix2<f64>) -> bool {
    positive_semidefinite(matrix) && matrix.trace() <= REACH
}

/// The factor for errors of two angles that leaves them no more unknown than angles can be.
fn within_reach(variances: f64) -> f64 {
    if variances > VARIANCES_MAX { (VARIANCES_MAX / variances).sqrt() } else { 1.0 }
}

/// The covariance of two angles, no more unknown than angles can be.
pub(super) fn of_angles(covariance: &Matrix2<f64>) -> Matrix2<f64> {
    covariance * within_reach(covariance.trace()).powi(2)
}

/// The scene's error with no angle beyond what angles can be.
pub(super) fn of_scene(scene: &Vector2<f64>) -> Vector2<f64> {
    scene.map(|angle| angle.clamp(-PI, PI))
}

/// The covariance of the error state with no angle more unknown than angles can be, and restored: rounding of what was large, or what
/// a state was read with, is not small beside an image's covariance.
pub(super) fn of_state(covariance: &Matrix6<f64>) -> Matrix6<f64> {
    let mut out = restored(covariance);
    for at in [FLOOR, MOUNTING, SCENE] {
        let factor = within_reach(out[(at, at)] + out[(at + 1, at + 1)]);
        if factor < 1.0 {
            out.fixed_rows_mut::<2>(at).scale_mut(factor);
            out.fixed_columns_mut::<2>(at).scale_mut(factor);
        }
    }
    out
}

/// The refusal of a matrix that is no covariance.
pub(super) fn no_covariance(name: &'static str, m: &Matrix2<f64>) -> Error {
    let got = format!("[[{}, {}], [{}, {}]]", m[(0, 0)], m[(0, 1)], m[(1, 0)], m[(1, 1)]);
    let expected = "a covariance in squared radians, symmetric and positive, with variances that angles can have";
    Error::argument(name, got, expected)
}
