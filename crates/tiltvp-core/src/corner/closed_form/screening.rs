//! Which features no corner can look like (section II-A3), and by how much they miss.

use std::f64::consts::FRAC_PI_2;

use super::attitude::{IncludedAngle, roots};
use super::standard_model::{Projected, StandardType};
use crate::corner::feature::CornerFeature;
use crate::error::Result;

/// Why a feature is, or is not, the image of a vertical and two horizontal edges that include a given angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Screening {
    /// There is an attitude.
    Passes,
    /// The projected angle of the horizontal edges is not above their included angle (property 1).
    HorizontalAngle {
        /// The projected angle of the standard type, radians.
        projected_rad: f64,
        /// The included angle of the standard type, which it should exceed, radians.
        least_rad: f64,
    },
    /// A horizontal edge makes an acute projected angle with the vertical one, which takes an included angle above 90
    /// degrees (properties 2 and 3).
    VerticalAngle {
        /// The projected angle of the standard type, radians.
        projected_rad: f64,
        /// The least that it may be, radians.
        least_rad: f64,
    },
    /// A horizontal edge makes an acute projected angle with the vertical one, smaller than the included angle admits
    /// together with the other projected angles: the square root of eq. 46 is not real.
    NoRoot {
        /// The smaller of the projected angles with the vertical edge, radians.
        projected_rad: f64,
    },
}

impl Screening {
    /// Whether there is an attitude.
    pub fn passes(&self) -> bool {
        matches!(self, Self::Passes)
    }

    /// Screens a feature: passes exactly where [`corner_attitudes`](crate::corner::corner_attitudes) finds some.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument) for an included angle that is none.
    pub fn of(feature: &CornerFeature, angle: &IncludedAngle) -> Result<Self> {
        angle.validate()?;
        let projected = Projected::of(&feature.pencil);
        if roots(&projected, angle.cosine()).iter().flatten().next().is_some() {
            return Ok(Self::Passes);
        }
        let standard = StandardType::of(feature, angle.gamma_rad);
        let smallest = standard.vertical_rad[0].min(standard.vertical_rad[1]);
        Ok(if smallest >= FRAC_PI_2 {
            Self::HorizontalAngle { projected_rad: standard.horizontal_rad, least_rad: standard.gamma_rad }
        } else if standard.gamma_rad <= FRAC_PI_2 {
            Self::VerticalAngle { projected_rad: smallest, least_rad: FRAC_PI_2 }
        } else {
            Self::NoRoot { projected_rad: smallest }
        })
    }
}
