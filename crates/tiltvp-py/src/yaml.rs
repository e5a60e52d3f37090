//! YAML text as dicts, lists and strings: the events are those of the crate `saphyr-parser`, the limits are the caller's.

use std::collections::HashMap;
use std::iter::Peekable;
use std::vec::IntoIter;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use saphyr_parser::{Event, Marker, Parser};

use crate::call::call;

/// The tree of a YAML text; every scalar is its text, tags are ignored, an alias is the object that it names.
///
/// Raises `ValueError` for what is no YAML of one document, for more than `most_values` keys and values, where what an alias
/// stands for counts every time, for more than `deepest` levels, and for a key with two values that differ.
#[pyfunction]
#[pyo3(signature = (text, *, most_values, deepest))]
pub(crate) fn yaml_tree<'py>(
    py: Python<'py>,
    text: &str,
    most_values: usize,
    deepest: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let events = call(py, || Ok(events(text, most_values)))?.map_err(PyValueError::new_err)?;
    if events.is_empty() {
        return Ok(py.None().into_bound(py));
    }
    let events = events.into_iter().peekable();
    Composer { py, events, anchors: HashMap::new(), values: 0, most_values, deepest }.node(1)
}

/// What is in the one document of a text, each with its place.
fn events(text: &str, most_values: usize) -> Result<Vec<(Event<'_>, Marker)>, String> {
    let mut parser = Parser::new_from_str(text);
    let (mut kept, mut documents, mut values) = (Vec::new(), 0, 0);
    while let Some(next) = parser.next_event() {
        let (event, span) = next.map_err(|error| at(error.info(), *error.marker()))?;
        match event {
            Event::Nothing | Event::StreamStart | Event::StreamEnd | Event::DocumentEnd => continue,
            Event::DocumentStart(_) => {
                documents += 1;
                if documents > 1 {
                    return Err(at("found a second document", span.start));
                }
                continue;
            }
            Event::SequenceEnd | Event::MappingEnd => {}
            Event::Alias(_) | Event::Scalar(..) | Event::SequenceStart(..) | Event::MappingStart(..) => values += 1,
        }
        if values > most_values {
            return Err(at(&too_many(most_values), span.start));
        }
        kept.push((event, span.start));
    }
    Ok(kept)
}

fn too_many(most_values: usize) -> String {
    format!("more than {most_values} keys and values")
}

fn at(problem: &str, mark: Marker) -> String {
    format!("{problem}, line {}, column {}", mark.line(), mark.col() + 1)
}

/// Makes objects of events, in their order.
struct Composer<'py, 't> {
    py: Python<'py>,
    events: Peekable<IntoIter<(Event<'t>, Marker)>>,
    /// Each complete node with an anchor, and the values that it stands for, itself included.
    anchors: HashMap<usize, (Bound<'py, PyAny>, usize)>,
    values: usize,
    most_values: usize,
    deepest: usize,
}

impl<'py> Composer<'py, '_> {
    /// The next node, at that level.
    fn node(&mut self, level: usize) -> PyResult<Bound<'py, PyAny>> {
        let Some((event, mark)) = self.events.next() else {
            return Err(PyValueError::new_err("ended within a list or mapping"));
        };
        let refused = |problem: &str| PyValueError::new_err(at(problem, mark));
        if level > self.deepest {
            return Err(refused(&format!("nested deeper than {} levels", self.deepest)));
        }
        let before = self.values;
        let (alias, size) = match &event {
            Event::Alias(anchor) => match self.anchors.get(anchor) {
                Some((node, size)) => (Some(node.clone()), *size),
                None => return Err(refused("found an alias in what it stands for")),
            },
            _ => (None, 1),
        };
        self.values += size;
        if self.values > self.most_values {
            return Err(refused(&too_many(self.most_values)));
        }
        if let Some(node) = alias {
            return Ok(node);
        }
        let (anchor, node) = match event {
            Event::Scalar(text, _, anchor, _) => (anchor, PyString::new(self.py, &text).into_any()),
            Event::SequenceStart(anchor, _) => {
                let list = PyList::empty(self.py);
                while !self.ends() {
                    list.append(self.node(level + 1)?)?;
                }
                (anchor, list.into_any())
            }
            Event::MappingStart(anchor, _) => (anchor, self.mapping(level + 1)?.into_any()),
            _ => return Err(refused("found no value")),
        };
        if anchor != 0 {
            self.anchors.insert(anchor, (node.clone(), self.values - before));
        }
        Ok(node)
    }

    /// The pairs of a mapping, to its end.
    fn mapping(&mut self, level: usize) -> PyResult<Bound<'py, PyDict>> {
        let pairs = PyDict::new(self.py);
        while !self.ends() {
            let mark = self.events.peek().map_or_else(Marker::default, |(_, mark)| *mark);
            let refused = |problem: &str| PyValueError::new_err(at(problem, mark));
            let key = self.node(level)?;
            if !key.is_instance_of::<PyString>() {
                return Err(refused("found a key that is no word"));
            }
            let value = self.node(level)?;
            if let Some(earlier) = pairs.get_item(&key)?
                && !earlier.eq(&value)?
            {
                return Err(refused(&format!("found the key {} twice with different values", key.repr()?)));
            }
            pairs.set_item(key, value)?;
        }
        Ok(pairs)
    }

    /// Whether a list or mapping ends here; its end is then taken.
    fn ends(&mut self) -> bool {
        self.events.next_if(|(event, _)| matches!(event, Event::SequenceEnd | Event::MappingEnd)).is_some()
    }
}
