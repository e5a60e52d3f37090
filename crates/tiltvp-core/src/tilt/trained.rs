//! Corrections of the angle that are trained on images of known tilt: a factor, a line, or a posterior (Fleer 2017, section 5.1).

use std::sync::Arc;

use super::corrected::Corrected;
use super::posterior::PosteriorCorrection;
use super::training_set::check_training;
use crate::error::{Error, Result};
use crate::options::{Kind, OptionValue, Value};

/// From what a method measures, a shift in pixels or a raw angle in radians, to the lean.
#[derive(Debug, Clone, PartialEq)]
pub enum TrainedCorrection {
    /// `alpha = l / a`, eqs. 30 and 45; `a` is in pixels per radian, or without unit for a raw angle.
    Factor(f64),
    /// `alpha = l / a + b`, but not below zero.
    Affine(AffineCorrection),
    /// The mean of `P(alpha | l)`.
    Posterior(PosteriorCorrection),
}

/// `alpha = max(0, l / a + b)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AffineCorrection {
    /// `a`: pixels per radian, or without unit for a raw angle.
    pub factor: f64,
    /// `b` in radians.
    pub offset_rad: f64,
}

impl AffineCorrection {
    /// Checks both numbers.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] unless the factor is positive and both are finite.
    pub fn validate(&self) -> Result<()> {
        positive_factor(self.factor)?;
        if self.offset_rad.is_finite() {
            return Ok(());
        }
        Err(Error::option("offset_rad", self.offset_rad, "a finite angle"))
    }
}

fn positive_factor(factor: f64) -> Result<()> {
    if factor > 0.0 && factor.is_finite() {
        return Ok(());
    }
    Err(Error::option("correction", factor, "a positive factor"))
}

impl TrainedCorrection {
    /// The angle as it is measured.
    pub(super) const IDENTITY: Self = Self::Factor(1.0);

    /// Whether it knows how far its angles scatter.
    pub(super) fn tells_its_error(&self) -> bool {
        matches!(self, Self::Posterior(_))
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a factor that is not positive or a number that is not finite.
    pub fn validate(&self) -> Result<()> {
        match self {
            Self::Factor(factor) => positive_factor(*factor),
            Self::Affine(affine) => affine.validate(),
            Self::Posterior(_) => Ok(()),
        }
    }

    /// The lean in radians of a shift of zero or more; NaN for NaN.
    pub fn apply(&self, shift: f64) -> f64 {
        self.at(shift).alpha_rad
    }

    pub(super) fn at(&self, shift: f64) -> Corrected {
        match self {
            Self::Factor(factor) => Corrected { shift, alpha_rad: shift / factor, slope: 1.0 / factor, std_rad: 0.0 },
            Self::Affine(AffineCorrection { factor, offset_rad }) => {
                let line = shift / factor + offset_rad;
                Corrected { shift, alpha_rad: line.clamp(0.0, f64::INFINITY), slope: 1.0 / factor, std_rad: 0.0 }
            }
            Self::Posterior(posterior) => posterior.at(shift),
        }
    }

    /// How many units of the shift a radian is, by and large.
    pub(super) fn factor(&self) -> f64 {
        match self {
            Self::Factor(factor) | Self::Affine(AffineCorrection { factor, .. }) => *factor,
            Self::Posterior(posterior) => posterior.model().factor,
        }
    }

    /// The shift that a lean makes, more than zero.
    pub(super) fn shift_of(&self, alpha_rad: f64) -> f64 {
        match self {
            Self::Affine(AffineCorrection { factor, offset_rad }) => {
                // A lean below the offset still has a shift.
                let shift = (alpha_rad - offset_rad) * factor;
                if shift > 0.0 { shift } else { alpha_rad * factor }
            }
            Self::Factor(_) | Self::Posterior(_) => alpha_rad * self.factor(),
        }
    }
}

/// A factor is a number, the others are objects that hold a [`TrainedCorrection`]; no value is the factor 1.
impl OptionValue for TrainedCorrection {
    const KIND: Kind = Kind::Object("None, a number (a factor), an AffineCorrection or a PosteriorCorrection");

    fn to_value(&self) -> Value {
        match self {
            Self::Factor(factor) => Value::Float(*factor),
            Self::Affine(_) | Self::Posterior(_) => Value::Object(Arc::new(self.clone())),
        }
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::None => Some(Self::IDENTITY),
            Value::Object(object) => object.downcast_ref::<Self>().cloned(),
            _ => f64::from_value(value).map(Self::Factor),
        }
    }
}

/// The factor `a` of eq. 31: the mean of `l / alpha` over images of known leans above zero.
///
/// # Errors
/// [`Error::InvalidArgument`] for no images, numbers that are not finite, leans of zero, or shifts that are all zero.
pub fn train_factor(shift: &[f64], alpha_rad: &[f64]) -> Result<f64> {
    check_training(shift, alpha_rad, 1)?;
    if let Some(i) = alpha_rad.iter().position(|alpha| *alpha == 0.0) {
        return Err(Error::argument(
            "alpha_rad",
            format!("0 in place {i}"),
            "leans above zero: eq. 31 divides by them",
        ));
    }
    let mean = shift.iter().zip(alpha_rad).map(|(l, alpha)| l / alpha).sum::<f64>() / shift.len() as f64;
    if mean > 0.0 && mean.is_finite() {
        return Ok(mean);
    }
    Err(Error::argument("shift", format!("a mean ratio of {mean}"), "shifts that are not all zero"))
}

/// The line `alpha = l / a + b` through images of known leans, by least squares of `l` on `alpha`.
///
/// The truth is known well and the shift is what errs, which is what least squares of `l` suppose; and the line then
/// depends on how shifts answer to leans and not on how many images there are of each lean: at every lean the mean
/// corrected angle is the true one (as far as it is a line at all). Regressing `alpha` on `l` instead would draw all
/// answers towards the training set's mean lean; [`train_posterior`](super::train_posterior) makes use of how leans are
/// distributed.
///
/// # Errors
/// [`Error::InvalidArgument`] for fewer than two different leans, numbers that are not finite, or shifts that do not grow
/// with the lean.
pub fn train_affine(shift: &[f64], alpha_rad: &[f64]) -> Result<AffineCorrection> {
    check_training(shift, alpha_rad, 2)?;
    let n = shift.len() as f64;
    let (l_mean, alpha_mean) = (shift.iter().sum::<f64>() / n, alpha_rad.iter().sum::<f64>() / n);
    let spread: f64 = alpha_rad.iter().map(|alpha| (alpha - alpha_mean).powi(2)).sum();
    let common: f64 = shift.iter().zip(alpha_rad).map(|(l, alpha)| (l - l_mean) * (alpha - alpha_mean)).sum();
    if spread <= 1e-18 * n {
        return Err(Error::argument("alpha_rad", format!("{alpha_mean} throughout"), "leans that differ"));
    }
    let factor = common / spread;
    if !(factor > 0.0 && factor.is_finite()) {
        return Err(Error::argument("shift", format!("a slope of {factor}"), "shifts that grow with the lean"));
    }
    Ok(AffineCorrection { factor, offset_rad: alpha_mean - l_mean / factor })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifts_are_those_of_leans() {
        let affine = |offset_rad: f64| TrainedCorrection::Affine(AffineCorrection { factor: 210.0, offset_rad });
        for trained in [TrainedCorrection::Factor(230.0), affine(0.02), affine(-0.01)] {
            for alpha_rad in [0.03, 0.1, 0.4] {
                assert!((trained.apply(trained.shift_of(alpha_rad)) - alpha_rad).abs() < 1e-12, "{trained:?}");
            }
        }
        // No shift makes a lean below the offset; it still has one.
        assert!(affine(0.02).shift_of(0.01) > 0.0);
    }

    #[test]
    fn factors_are_positive_numbers() {
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let affine = AffineCorrection { factor, offset_rad: 0.0 };
            for wrong in [TrainedCorrection::Factor(factor), TrainedCorrection::Affine(affine)] {
                assert!(wrong.validate().is_err(), "{wrong:?}");
            }
        }
    }
}
