//! What a lens declares of itself: its name, its parameters in order, and what becomes of them when the image is resized.

use crate::error::{Error, Result};

/// The most numbers in a list of a lens. Calibrations have up to 20; the rim of a polynomial is found by the roots of all its
/// derivatives, in time cubic and memory quadratic in their number: 200 take 10 ms and 300 kB.
pub const MOST_COEFFICIENTS: usize = 200;

/// The value of a named parameter of a camera model.
#[derive(Debug, Clone, PartialEq)]
pub enum Parameter {
    /// One number.
    Scalar(f64),
    /// Numbers in order, of a length that the model does not fix.
    List(Vec<f64>),
}

/// A lens as users write it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensSchema {
    /// The name of the model.
    pub name: &'static str,
    /// One or two sentences: the formula, and what other programs call the lens.
    pub doc: &'static str,
    /// The parameters in order.
    pub parameters: &'static [ParameterSchema],
}

/// One parameter of a lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSchema {
    /// The name.
    pub name: &'static str,
    /// Whether it is a number or a list, and its default.
    pub kind: Kind,
    /// What becomes of it when the image is resized.
    pub resize: Resize,
    /// What it means, with its unit.
    pub doc: &'static str,
}

/// Whether a parameter is a number or a list, and what it is where it is not given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A number that has to be given.
    Required,
    /// A number with a default.
    Optional(f64),
    /// A list of numbers that has to be given.
    RequiredList,
    /// A list of numbers that is empty where it is not given.
    OptionalList,
}

impl Kind {
    /// Whether the parameter has to be given.
    pub fn is_required(self) -> bool {
        matches!(self, Self::Required | Self::RequiredList)
    }

    /// Whether the parameter is a list of numbers.
    pub fn is_list(self) -> bool {
        matches!(self, Self::RequiredList | Self::OptionalList)
    }
}

/// What becomes of a parameter when the image is resized by a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resize {
    /// It stays: a ratio, or a coefficient without a unit.
    Fixed,
    /// A length in pixels, or a list of them: times the factor.
    Length,
    /// A coordinate of a pixel: `x` becomes `factor (x + 1/2) - 1/2`.
    Coordinate,
    /// Coefficients `a_i` of a length in pixels in powers of a length in pixels: `a_i factor^(1 - i)`.
    Polynomial,
}

impl Resize {
    /// The value for the image resized by a factor.
    pub(super) fn apply(self, value: Parameter, factor: f64) -> Parameter {
        let resized = |(i, x): (usize, f64)| match self {
            Self::Fixed => x,
            Self::Length => x * factor,
            Self::Coordinate => (x + 0.5) * factor - 0.5,
            Self::Polynomial => x * factor.powi(1 - i as i32),
        };
        match value {
            Parameter::Scalar(x) => Parameter::Scalar(resized((0, x))),
            Parameter::List(values) => Parameter::List(values.into_iter().enumerate().map(resized).collect()),
        }
    }
}

impl ParameterSchema {
    /// A number that has to be given.
    pub(super) const fn required(name: &'static str, resize: Resize, doc: &'static str) -> Self {
        Self { name, kind: Kind::Required, resize, doc }
    }

    /// A number with a default.
    pub(super) const fn optional(name: &'static str, default: f64, resize: Resize, doc: &'static str) -> Self {
        Self { name, kind: Kind::Optional(default), resize, doc }
    }

    /// A coefficient without a unit, 0 where it is not given.
    pub(super) const fn coefficient(name: &'static str, doc: &'static str) -> Self {
        Self::optional(name, 0.0, Resize::Fixed, doc)
    }
}

pub(super) const FX: ParameterSchema = ParameterSchema::required("fx", Resize::Length, "focal length in u, pixels");
pub(super) const FY: ParameterSchema = ParameterSchema::required("fy", Resize::Length, "focal length in v, pixels");
pub(super) const CX: ParameterSchema =
    ParameterSchema::required("cx", Resize::Coordinate, "column of the centre, pixels");
pub(super) const CY: ParameterSchema = ParameterSchema::required("cy", Resize::Coordinate, "row of the centre, pixels");

/// Refuses a list of more than [`MOST_COEFFICIENTS`] numbers.
pub(super) fn too_many(model: &'static str, parameter: &'static str, numbers: &[f64]) -> Result<()> {
    if numbers.len() <= MOST_COEFFICIENTS {
        return Ok(());
    }
    let expected = format!("at most {MOST_COEFFICIENTS} numbers");
    Err(Error::camera(model, parameter, format!("a list of {}", numbers.len()), expected))
}

/// Numbers as values of parameters.
pub(super) fn scalars(groups: &[&[f64]]) -> Vec<Parameter> {
    groups.iter().copied().flatten().copied().map(Parameter::Scalar).collect()
}
