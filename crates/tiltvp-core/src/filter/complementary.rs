//! A complementary filter on rotations: rates of turn in the short run, a reference attitude in the long run.
//!
//! It is the explicit complementary filter of Mahony, Hamel and Pflimlin (2008) with corrections that arrive now and then:
//! an attitude seen in an image, say, that is right on average, among readings of a gyroscope that drift.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::error::{Error, Result};
use crate::geometry::check_rotation;
use crate::options;

options! {
    /// How quickly the filter follows its reference.
    #[derive(Copy)]
    pub struct ComplementaryOptions {
        /// Time after which a difference from the reference has shrunk to 1/e, seconds. What is quicker is taken from the rates,
        /// what is slower from the reference.
        time_constant_s: f64 = 0.15 => 1e-3..=1e4, "seconds in [1e-3, 1e4]";
        /// Time over which a lasting difference becomes a bias of the rates, seconds.
        bias_time_constant_s: f64 = 4.0 => 1e-3..=1e9, "seconds in [1e-3, 1e9]";
    }
}

/// Everything that a filter knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ComplementaryState {
    /// The attitude as the unit quaternion `[w, x, y, z]` of `reference_from_body`.
    pub attitude: [f64; 4],
    /// The bias of the rates, in the body's axes, rad/s.
    pub bias_rad_s: [f64; 3],
    /// Time since the reference was last seen, seconds.
    pub unseen_s: f64,
}

/// A filter and its state: the attitude of a body, and the bias of the rates that turn it.
///
/// ```
/// use nalgebra::{Matrix3, Vector3};
/// use tiltvp_core::filter::{ComplementaryFilter, ComplementaryOptions};
/// let mut filter = ComplementaryFilter::new(ComplementaryOptions::default(), &Matrix3::identity())?;
/// filter.predict(&Vector3::new(0.1, 0.0, 0.0), 0.005)?;
/// filter.correct(&Matrix3::identity())?;
/// assert!(filter.attitude()[(2, 1)] < 5e-4);
/// # Ok::<(), tiltvp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ComplementaryFilter {
    options: ComplementaryOptions,
    attitude: UnitQuaternion<f64>,
    bias_rad_s: Vector3<f64>,
    /// Time since the reference was last seen, seconds.
    unseen_s: f64,
}

impl ComplementaryFilter {
    /// A filter that starts at an attitude (`reference_from_body`), with no bias.
    ///
    /// # Errors
    /// For options outside their domains and a matrix that is no rotation.
    pub fn new(options: ComplementaryOptions, attitude: &Matrix3<f64>) -> Result<Self> {
        options.validate()?;
        check_rotation("reference_from_body", attitude)?;
        let attitude = quaternion(attitude);
        Ok(Self { options, attitude, bias_rad_s: Vector3::zeros(), unseen_s: 0.0 })
    }

    /// A filter that goes on from what another one knew, to the last bit.
    ///
    /// # Errors
    /// For options outside their domains; [`Error::InvalidArgument`] for a state that no filter can have.
    pub fn with_state(options: ComplementaryOptions, state: &ComplementaryState) -> Result<Self> {
        options.validate()?;
        let [w, x, y, z] = state.attitude;
        let attitude = Quaternion::new(w, x, y, z);
        let finite = state.bias_rad_s.iter().all(|rate| rate.is_finite());
        if !(finite && (attitude.norm() - 1.0).abs() < 1e-9 && (0.0..f64::INFINITY).contains(&state.unseen_s)) {
            return Err(Error::argument("state", format!("{state:?}"), "a unit quaternion, finite rates, a time"));
        }
        let attitude = UnitQuaternion::new_unchecked(attitude);
        Ok(Self { options, attitude, bias_rad_s: state.bias_rad_s.into(), unseen_s: state.unseen_s })
    }

    /// Everything that is known.
    pub fn state(&self) -> ComplementaryState {
        let attitude = [self.attitude.w, self.attitude.i, self.attitude.j, self.attitude.k];
        ComplementaryState { attitude, bias_rad_s: self.bias_rad_s.into(), unseen_s: self.unseen_s }
    }

    /// How quickly it follows.
    pub fn options(&self) -> &ComplementaryOptions {
        &self.options
    }

    /// The attitude: takes vectors of the body to the frame of the reference.
    pub fn attitude(&self) -> Matrix3<f64> {
        self.attitude.to_rotation_matrix().into_inner()
    }

    /// The bias of the rates, in the body's axes, rad/s.
    pub fn bias_rad_s(&self) -> Vector3<f64> {
        self.bias_rad_s
    }

    /// Turns on by a rate, in the body's axes, that holds for some time: `R <- R exp((rate - bias) dt)`.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for a rate, a time or a turn that is not finite, or a negative time.
    pub fn predict(&mut self, rate_rad_s: &Vector3<f64>, duration_s: f64) -> Result<()> {
        if !rate_rad_s.iter().all(|rate| rate.is_finite()) {
            let got = format!("{:?}", rate_rad_s.as_slice());
            return Err(Error::argument("rate_rad_s", got, "three finite rates"));
        }
        if !(duration_s >= 0.0 && duration_s.is_finite()) {
            return Err(Error::argument("duration_s", duration_s, "seconds, finite and not negative"));
        }
        let (turn, unseen_s) = ((rate_rad_s - self.bias_rad_s) * duration_s, self.unseen_s + duration_s);
        if !(turn.norm_squared() + unseen_s).is_finite() {
            let got = format!("{:?} for {duration_s} s", rate_rad_s.as_slice());
            return Err(Error::argument(
                "rate_rad_s, duration_s",
                got,
                "a turn whose square is a float, as the time is",
            ));
        }
        self.attitude *= UnitQuaternion::from_scaled_axis(turn);
        self.attitude.renormalize();
        self.unseen_s = unseen_s;
        Ok(())
    }

    /// Moves towards a reference attitude by the share `1 - exp(-t / time constant)`, where `t` is the time predicted since
    /// the last reference; returns the difference that it found, as a rotation vector in the body's axes, radians.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] for a matrix that is no rotation.
    pub fn correct(&mut self, reference_from_body: &Matrix3<f64>) -> Result<Vector3<f64>> {
        check_rotation("reference_from_body", reference_from_body)?;
        let difference = (self.attitude.inverse() * quaternion(reference_from_body)).scaled_axis();
        let share = -(-self.unseen_s / self.options.time_constant_s).exp_m1();
        self.attitude *= UnitQuaternion::from_scaled_axis(difference * share);
        self.attitude.renormalize();
        if self.unseen_s > 0.0 {
            // What one constant bias since the last reference explains of the difference is no more than all of it.
            let learned = -(-self.unseen_s / self.options.bias_time_constant_s).exp_m1();
            self.bias_rad_s -= difference * (share * learned / self.unseen_s);
        }
        self.unseen_s = 0.0;
        Ok(difference)
    }
}

fn quaternion(rotation: &Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Constant rate, constant bias, references now and then: attitude and bias are found.
    #[test]
    fn finds_attitude_and_bias() {
        let (rate, bias) = (Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.02, 0.01, -0.03));
        let start = Rotation3::new(Vector3::new(0.2, -0.1, 0.1));
        let options = ComplementaryOptions { time_constant_s: 0.5, bias_time_constant_s: 2.0 };
        let mut filter = ComplementaryFilter::new(options, start.matrix()).unwrap();
        let mut truth = Rotation3::identity();
        for k in 1..=12_000 {
            truth *= Rotation3::new(rate * 0.005);
            filter.predict(&(rate + bias), 0.005).unwrap();
            if k % 7 == 0 {
                filter.correct(truth.matrix()).unwrap();
            }
        }
        let off = (truth.inverse() * Rotation3::from_matrix_unchecked(filter.attitude())).angle();
        assert!(off < 1e-3, "{off}");
        assert!((filter.bias_rad_s() - bias).norm() < 1e-4, "{}", filter.bias_rad_s());
    }

    /// Bias and attitude are found whatever the time from one reference to the next, and no single gap spoils the bias.
    #[test]
    fn rare_references_correct_as_well() {
        let (bias, options) = (Vector3::new(0.01, 0.0, 0.0), ComplementaryOptions::default());
        for gap_s in [0.5, 2.0, 5.0, 10.0, 30.0, 100.0] {
            let mut filter = ComplementaryFilter::new(options, &Matrix3::identity()).unwrap();
            for _ in 0..200 {
                filter.predict(&bias, gap_s).unwrap();
                filter.correct(&Matrix3::identity()).unwrap();
                assert!(filter.bias_rad_s().x < 0.02, "{} at {gap_s}", filter.bias_rad_s());
            }
            assert!((filter.bias_rad_s() - bias).norm() < 1e-4, "{} at {gap_s}", filter.bias_rad_s());
            // Twice without time between tells nothing new of the bias.
            filter.correct(&Matrix3::identity()).unwrap();
            assert!((filter.bias_rad_s() - bias).norm() < 1e-4);
        }
    }

    #[test]
    fn refuses_what_is_no_rotation() {
        let options = ComplementaryOptions::default();
        assert!(ComplementaryFilter::new(options, &Matrix3::zeros()).is_err());
        let mut filter = ComplementaryFilter::new(options, &Matrix3::identity()).unwrap();
        assert!(filter.predict(&Vector3::new(f64::NAN, 0.0, 0.0), 0.1).is_err());
        assert!(filter.predict(&Vector3::zeros(), -0.1).is_err());
        assert!(filter.correct(&(Matrix3::identity() * 2.0)).is_err());
        assert!(ComplementaryOptions { time_constant_s: 0.0, ..options }.validate().is_err());
    }
}
