//! Camera models by name, with named parameters: what is given is matched against what the lens declares.

use super::schema::{Kind, LensSchema, Parameter, Parametric, Resize, too_many};
use super::{Entry, LENSES, Model, with_model};
use crate::error::{Error, Result};
use crate::options::edit_distance;

impl Model {
    /// The names of all models.
    pub fn names() -> impl Iterator<Item = &'static str> + Clone {
        LENSES.iter().map(|entry| entry.schema.name)
    }

    /// What the model of a name declares: its parameters in order, with defaults and meanings.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if no model has this name; the near ones and all are named.
    pub fn schema_of(name: &str) -> Result<&'static LensSchema> {
        entry(name).map(|entry| entry.schema)
    }

    /// The model of a name with named parameters, for images of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if the model or a parameter has no such name (the near ones and all are named), a
    /// parameter is missing, given twice, a list where a number belongs, or a number that no such lens has.
    pub fn from_parameters(name: &str, width: u32, height: u32, parameters: &[(String, Parameter)]) -> Result<Self> {
        let entry = entry(name)?;
        (entry.build)(&Values::read(entry.schema, parameters, [width, height])?)
    }

    /// What the model declares of itself.
    pub fn schema(&self) -> &'static LensSchema {
        fn of<L: Parametric>(_: &L) -> &'static LensSchema {
            &L::SCHEMA
        }
        with_model!(self, lens => of(lens))
    }

    /// The name of the model, as [`from_parameters`](Self::from_parameters) takes it.
    pub fn name(&self) -> &'static str {
        self.schema().name
    }

    /// All parameters by name, defaults included: what [`from_parameters`](Self::from_parameters) makes the model from.
    pub fn parameters(&self) -> Vec<(&'static str, Parameter)> {
        let values = with_model!(self, lens => lens.values());
        self.schema().parameters.iter().map(|parameter| parameter.name).zip(values).collect()
    }
}

fn entry(name: &str) -> Result<&'static Entry> {
    LENSES
        .iter()
        .find(|entry| entry.schema.name == name)
        .ok_or_else(|| unknown("camera", "model", name, Model::names()))
}

/// Parameters that fit the schema of a lens: a value for each, defaults included.
pub(super) struct Values<'a> {
    numbers: Vec<f64>,
    lists: Vec<&'a [f64]>,
    size: [u32; 2],
}

/// No lens has a parameter beyond this: a number as large is a slip, and its powers would overflow
/// (`no_parameters_panic` of the conformance tests draws such numbers).
const LARGEST: f64 = 1e15;

impl<'a> Values<'a> {
    fn read(schema: &LensSchema, given: &'a [(String, Parameter)], size: [u32; 2]) -> Result<Self> {
        let names = schema.parameters.iter().map(|parameter| parameter.name);
        for (i, (name, _)) in given.iter().enumerate() {
            if !names.clone().any(|known| known == name) {
                return Err(unknown(schema.name, "parameter", name, names));
            }
            if given[..i].iter().any(|earlier| earlier.0 == *name) {
                return Err(Error::camera(schema.name, name.clone(), "given twice", "each parameter once"));
            }
        }
        let mut values = Self { numbers: Vec::new(), lists: Vec::new(), size };
        for parameter in schema.parameters {
            let wrong = |value: String, expected: String| Error::camera(schema.name, parameter.name, value, expected);
            let value = given.iter().find(|(name, _)| name == parameter.name).map(|(_, value)| value);
            match (value, parameter.kind) {
                (Some(Parameter::Scalar(x)), Kind::Required | Kind::Optional(_)) => values.numbers.push(*x),
                (Some(Parameter::List(x)), Kind::RequiredList | Kind::OptionalList) => {
                    too_many(schema.name, parameter.name, x)?;
                    values.lists.push(x);
                }
                (Some(Parameter::Scalar(x)), _) => return Err(wrong(x.to_string(), "a list of numbers".into())),
                (Some(Parameter::List(x)), _) => {
                    return Err(wrong(format!("a list of {}", x.len()), "one number, not a list".into()));
                }
                (None, Kind::Optional(default)) => values.numbers.push(default),
                (None, Kind::OptionalList) => values.lists.push(&[]),
                (None, Kind::Required | Kind::RequiredList) => {
                    let needed = schema.parameters.iter().filter(|one| one.kind.is_required()).map(|one| one.name);
                    return Err(wrong("missing".into(), format!("a value; {} needs {}", schema.name, list(needed))));
                }
            }
            let numbers = match value {
                Some(Parameter::Scalar(x)) => std::slice::from_ref(x),
                Some(Parameter::List(x)) => x,
                None => &[],
            };
            if let Some(x) = numbers.iter().find(|x| x.is_nan() || x.abs() > LARGEST) {
                return Err(wrong(x.to_string(), "a finite number of ordinary size".into()));
            }
        }
        Ok(values)
    }

    /// The numbers, in the order of the schema.
    pub(super) fn numbers<const N: usize>(&self) -> [f64; N] {
        std::array::from_fn(|i| self.numbers.get(i).copied().unwrap_or(f64::NAN))
    }

    /// The lists, in the order of the schema.
    pub(super) fn lists<const N: usize>(&self) -> [&'a [f64]; N] {
        std::array::from_fn(|i| self.lists.get(i).copied().unwrap_or(&[]))
    }

    /// Columns and rows of the image.
    pub(super) fn size(&self) -> [u32; 2] {
        self.size
    }
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

fn list(names: impl Iterator<Item = &'static str>) -> String {
    let names: Vec<_> = names.collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
/// The error for a name that does not exist: the near ones, then all.
fn unknown(model: &'static str, what: &str, name: &str, known: impl Iterator<Item = &'static str> + Clone) -> Error {
    let plain = |s: &str| s.to_lowercase().replace(['-', ' ', '.'], "_");
    let near: Vec<_> = known
        .clone()
        .filter(|k| {
            let distance = edit_distance(&plain(name), k);
            distance <= 2 && distance < k.chars().count()
        })
        .collect();
    let hint = if near.is_empty() { String::new() } else { format!(" (did you mean {}?)", near.join(" or ")) };
    Error::camera(model, what.to_owned(), format!("\"{name}\"{hint}"), format!("one of: {}", list(known)))
}
