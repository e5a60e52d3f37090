//! Camera models by name, with named parameters: what is given is matched against what the lens declares.

use super::schema::{LensSchema, Parameter};
use super::values::{Parametric, Values, unknown};
use super::{Entry, LENSES, Model, with_model};
use crate::error::Result;

impl Model {
    /// The names of all models.
    pub fn names() -> impl Iterator<Item = &'static str> + Clone {
        LENSES.iter().map(|entry| entry.schema.name)
    }

    /// What the model of a name declares: its parameters in order, with defaults and meanings.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`](crate::Error::InvalidCamera) if no model has this name; the near ones and all are named.
    pub fn schema_of(name: &str) -> Result<&'static LensSchema> {
        entry(name).map(|entry| entry.schema)
    }

    /// The model of a name with named parameters, for images of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`](crate::Error::InvalidCamera) if the model or a parameter has no such name (the near
    /// ones and all are named), a parameter is missing, given twice, a list where a number belongs, or a number that no such lens has.
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
