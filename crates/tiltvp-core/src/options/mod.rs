//! Options declared once: a struct with doc, default and domain of each field, from which all else is derived.
//!
//! [`options!`](crate::options!) makes a struct of options, [`words!`](crate::words!) a choice among words and
//! [`methods!`](crate::methods!) a choice among methods, each with options of its own. All of them can be asked by name through
//! the trait [`Options`]: which options there are, what they mean, what is in force, and what else is accepted.

mod domain;
mod leaf;
mod macros;
mod near;
mod value;

use std::borrow::Cow;

pub use domain::{Above, Between, Domain, NOT_NEGATIVE, POSITIVE, check};
pub use leaf::{OptionValue, assign, assign_by, value_by};
pub(crate) use near::edit_distance;
pub use near::near;
pub use value::{Kind, Value};

use crate::error::{Error, Result};

/// An option that is in force.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name, as the user writes it.
    pub name: Cow<'static, str>,
    /// What it means, in lines as they are written in the source.
    pub doc: Cow<'static, str>,
    /// What kind of value it has.
    pub kind: Kind,
    /// Its value: the default, if the options are the default ones.
    pub value: Value,
    /// What is accepted, in words.
    pub expected: Cow<'static, str>,
}

/// Options that can be listed, read and set by name.
pub trait Options {
    /// The options in force, in the order of declaration.
    fn fields(&self) -> Vec<Field>;

    /// Sets an option, unless there is none of that name: then the answer is `false`.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a value of the wrong kind. The domain is left to [`Options::validate`].
    fn try_set(&mut self, name: &str, value: &Value) -> Result<bool>;

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the first field outside its domain.
    fn validate(&self) -> Result<()>;

    /// The name of the method that is chosen, if these are options of several.
    fn method(&self) -> Option<&'static str> {
        None
    }

    /// What else has an option of that name, in words for a refusal.
    fn elsewhere(&self, _name: &str) -> Option<String> {
        None
    }

    /// The value of an option, if there is one of that name.
    fn get(&self, name: &str) -> Option<Value> {
        self.fields().into_iter().find(|field| field.name == name).map(|field| field.value)
    }

    /// Sets an option.
    ///
    /// # Errors
    /// [`Error::UnknownOption`] if there is none of that name, else as [`Options::try_set`].
    fn set(&mut self, name: &str, value: &Value) -> Result<()> {
        if self.try_set(name, value)? { Ok(()) } else { Err(unknown(self, name)) }
    }

    /// Sets several options in the order of declaration, so that a choice comes before what depends on it.
    ///
    /// # Errors
    /// As [`Options::set`].
    fn set_all(&mut self, mut given: Vec<(String, Value)>) -> Result<()> {
        while !given.is_empty() {
            let fields = self.fields();
            let next = fields.iter().find_map(|field| given.iter().position(|(name, _)| *name == field.name));
            let (name, value) = given.remove(next.unwrap_or(0));
            self.set(&name, &value)?;
        }
        Ok(())
    }
}

/// The refusal of a name that no option has.
fn unknown(options: &(impl Options + ?Sized), name: &str) -> Error {
    let known: Vec<String> = options.fields().into_iter().map(|field| field.name.into_owned()).collect();
    let near = near(name, known.iter().map(String::as_str));
    let mut why = String::from("unknown");
    if let Some(method) = options.method() {
        why.extend([" to method \"", method, "\""]);
    }
    if let Some(elsewhere) = options.elsewhere(name) {
        why.extend([" (", &elsewhere, ")"]);
    } else if !near.is_empty() {
        why.extend([" (did you mean ", &near.join(" or "), "?)"]);
    }
    Error::UnknownOption { name: name.to_owned(), why, known }
}

/// A field of options that are part of others, under a longer name.
#[doc(hidden)]
pub fn prefixed(prefix: &'static str, field: Field) -> Field {
    Field { name: if prefix.is_empty() { field.name } else { format!("{prefix}{}", field.name).into() }, ..field }
}

/// A field's doc comment without the space that begins each line.
#[doc(hidden)]
pub fn doc(lines: &[&str]) -> Cow<'static, str> {
    lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join("\n").into()
}
