//! The values of a lens' parameters: read by its schema, told by the lens.

use super::schema::{Kind, LensSchema, Parameter, too_many};
use crate::error::{Error, Result};
use crate::options::edit_distance;

/// A lens that can be made of named parameters, and tells them.
///
/// The order of the parameters is that of the schema, in `build` and in `values` too.
pub(super) trait Parametric: Sized {
    /// The one declaration of the name and of the parameters.
    const SCHEMA: LensSchema;

    /// The lens of parameters that fit the schema.
    fn build(given: &Values<'_>) -> Result<Self>;

    /// The values of all parameters, in order.
    fn values(&self) -> Vec<Parameter>;
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
    pub(super) fn read(schema: &LensSchema, given: &'a [(String, Parameter)], size: [u32; 2]) -> Result<Self> {
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

fn list(names: impl Iterator<Item = &'static str>) -> String {
    let names: Vec<_> = names.collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// The error for a name that does not exist: the near ones, then all.
pub(super) fn unknown(
    model: &'static str,
    what: &str,
    name: &str,
    known: impl Iterator<Item = &'static str> + Clone,
) -> Error {
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
