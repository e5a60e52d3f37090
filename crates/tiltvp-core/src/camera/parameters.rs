//! Camera models by name, with named parameters: the one place where their names and defaults are written.

use super::any::Model;
use super::double_sphere::DoubleSphere;
use super::equidistant::Equidistant;
use super::equirectangular::Equirectangular;
use super::extended_unified::ExtendedUnified;
use super::kannala_brandt::KannalaBrandt;
use super::lens::Lens;
use super::ocam::Ocam;
use super::pinhole::Pinhole;
use super::radial_polynomial::RadialPolynomial;
use super::unified::Unified;
use crate::error::{Error, Result};

/// The value of a named parameter of a camera model.
#[derive(Debug, Clone, PartialEq)]
pub enum Parameter {
    /// One number.
    Scalar(f64),
    /// Numbers in order, of a length that the model does not fix.
    List(Vec<f64>),
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Required,
    Optional(f64),
    RequiredList,
    OptionalList,
}
use Kind::{Optional, OptionalList, Required, RequiredList};

struct Spec {
    name: &'static str,
    keys: &'static [(&'static str, Kind)],
    build: fn(&Values, u32, u32) -> Result<Model>,
}

const FX: (&str, Kind) = ("fx", Required);
const FY: (&str, Kind) = ("fy", Required);
const CX: (&str, Kind) = ("cx", Required);
const CY: (&str, Kind) = ("cy", Required);

const SPECS: [Spec; 9] = [
    Spec {
        name: "pinhole",
        keys: &[
            FX,
            FY,
            CX,
            CY,
            ("k1", Optional(0.0)),
            ("k2", Optional(0.0)),
            ("p1", Optional(0.0)),
            ("p2", Optional(0.0)),
            ("k3", Optional(0.0)),
            ("k4", Optional(0.0)),
            ("k5", Optional(0.0)),
            ("k6", Optional(0.0)),
        ],
        build: |v, _, _| {
            let distortion = v.scalars(["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]);
            Pinhole::new(v.focal(), v.centre(), &distortion).map(Model::Pinhole)
        },
    },
    Spec {
        name: "kannala_brandt",
        keys: &[
            FX,
            FY,
            CX,
            CY,
            ("k1", Optional(0.0)),
            ("k2", Optional(0.0)),
            ("k3", Optional(0.0)),
            ("k4", Optional(0.0)),
        ],
        build: |v, _, _| {
            let k = v.scalars(["k1", "k2", "k3", "k4"]);
            KannalaBrandt::new(v.focal(), v.centre(), k).map(Model::KannalaBrandt)
        },
    },
    Spec {
        name: "ocam",
        keys: &[
            ("polynomial", RequiredList),
            CX,
            CY,
            ("c", Optional(1.0)),
            ("d", Optional(0.0)),
            ("e", Optional(0.0)),
            ("inverse_polynomial", OptionalList),
        ],
        build: |v, _, _| {
            let affine = v.scalars(["c", "d", "e"]);
            Ocam::new(v.list("polynomial"), affine, v.centre(), v.list("inverse_polynomial")).map(Model::Ocam)
        },
    },
    Spec {
        name: "unified",
        keys: &[
            ("xi", Required),
            FX,
            FY,
            CX,
            CY,
            ("k1", Optional(0.0)),
            ("k2", Optional(0.0)),
            ("p1", Optional(0.0)),
            ("p2", Optional(0.0)),
            ("k3", Optional(0.0)),
            ("skew", Optional(0.0)),
        ],
        build: |v, _, _| {
            let distortion = v.scalars(["k1", "k2", "p1", "p2", "k3"]);
            Unified::new(v.scalar("xi"), v.focal(), v.centre(), distortion, v.scalar("skew")).map(Model::Unified)
        },
    },
    Spec {
        name: "extended_unified",
        keys: &[("alpha", Required), ("beta", Required), FX, FY, CX, CY],
        build: |v, _, _| {
            ExtendedUnified::new(v.scalar("alpha"), v.scalar("beta"), v.focal(), v.centre()).map(Model::ExtendedUnified)
        },
    },
    Spec {
        name: "double_sphere",
        keys: &[("xi", Required), ("alpha", Required), FX, FY, CX, CY],
        build: |v, _, _| {
            DoubleSphere::new(v.scalar("xi"), v.scalar("alpha"), v.focal(), v.centre()).map(Model::DoubleSphere)
        },
    },
    Spec {
        name: "equidistant",
        keys: &[("focal_px", Required), CX, CY],
        build: |v, _, _| Equidistant::new(v.scalar("focal_px"), v.scalar("cx"), v.scalar("cy")).map(Model::Equidistant),
    },
    Spec {
        name: "equirectangular",
        keys: &[],
        build: |_, width, height| Equirectangular::new(width, height).map(Model::Equirectangular),
    },
    Spec {
        name: "radial_polynomial",
        keys: &[
            ("k1", Required),
            ("k2", Optional(0.0)),
            ("k3", Optional(0.0)),
            ("k4", Optional(0.0)),
            CX,
            CY,
            ("aspect_ratio", Optional(1.0)),
        ],
        build: |v, _, _| {
            let k = v.scalars(["k1", "k2", "k3", "k4"]);
            RadialPolynomial::new(k, v.centre(), v.scalar("aspect_ratio")).map(Model::RadialPolynomial)
        },
    },
];

impl Model {
    /// The names of all models.
    pub fn names() -> impl Iterator<Item = &'static str> + Clone {
        SPECS.iter().map(|spec| spec.name)
    }

    /// The model of a name with named parameters, for images of `width` x `height` pixels.
    ///
    /// Distortion coefficients, `skew` and `d`, `e` are 0 where not given, `c` and `aspect_ratio` 1.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if the model or a parameter has no such name (the near ones and all are named), a
    /// parameter is missing, given twice, a list where a number belongs, or a number that no such lens has.
    pub fn from_parameters(name: &str, width: u32, height: u32, parameters: &[(String, Parameter)]) -> Result<Self> {
        let spec = SPECS
            .iter()
            .find(|spec| spec.name == name)
            .ok_or_else(|| unknown("camera", "model", name, Self::names()))?;
        (spec.build)(&Values::read(spec, parameters)?, width, height)
    }

    /// The name of the model, as [`from_parameters`](Self::from_parameters) takes it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Pinhole(_) => "pinhole",
            Self::KannalaBrandt(_) => "kannala_brandt",
            Self::Ocam(_) => "ocam",
            Self::Unified(_) => "unified",
            Self::ExtendedUnified(_) => "extended_unified",
            Self::DoubleSphere(_) => "double_sphere",
            Self::Equidistant(_) => "equidistant",
            Self::Equirectangular(_) => "equirectangular",
            Self::RadialPolynomial(_) => "radial_polynomial",
        }
    }

    /// All parameters by name, defaults included: what [`from_parameters`](Self::from_parameters) makes the model from.
    pub fn parameters(&self) -> Vec<(&'static str, Parameter)> {
        match self {
            Self::Pinhole(m) => {
                let [k1, k2, p1, p2, k3, k4, k5, k6] = m.distortion();
                let k =
                    [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2), ("k3", k3), ("k4", k4), ("k5", k5), ("k6", k6)];
                scalars(&[&focal(m), &centre(m), &k])
            }
            Self::KannalaBrandt(m) => {
                let [k1, k2, k3, k4] = m.coefficients();
                scalars(&[&focal(m), &centre(m), &[("k1", k1), ("k2", k2), ("k3", k3), ("k4", k4)]])
            }
            Self::Ocam(m) => {
                let [c, d, e] = m.affine();
                let mut out = vec![("polynomial", Parameter::List(m.polynomial()))];
                out.extend(scalars(&[&centre(m), &[("c", c), ("d", d), ("e", e)]]));
                out.push(("inverse_polynomial", Parameter::List(m.inverse_polynomial().to_vec())));
                out
            }
            Self::Unified(m) => {
                let [k1, k2, p1, p2, k3] = m.distortion();
                let k = [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2), ("k3", k3), ("skew", m.grid().matrix().m12)];
                scalars(&[&[("xi", m.xi())], &focal(m), &centre(m), &k])
            }
            Self::ExtendedUnified(m) => scalars(&[&[("alpha", m.alpha()), ("beta", m.beta())], &focal(m), &centre(m)]),
            Self::DoubleSphere(m) => scalars(&[&[("xi", m.xi()), ("alpha", m.alpha())], &focal(m), &centre(m)]),
            Self::Equidistant(m) => scalars(&[&[("focal_px", m.focal_px), ("cx", m.cx), ("cy", m.cy)]]),
            Self::Equirectangular(_) => Vec::new(),
            Self::RadialPolynomial(m) => {
                let [k1, k2, k3, k4] = m.coefficients();
                let k = [("k1", k1), ("k2", k2), ("k3", k3), ("k4", k4)];
                scalars(&[&k, &centre(m), &[("aspect_ratio", m.grid().matrix().m22)]])
            }
        }
    }
}

fn focal(lens: &impl Lens) -> [(&'static str, f64); 2] {
    let matrix = lens.grid().matrix();
    [("fx", matrix.m11), ("fy", matrix.m22)]
}

fn centre(lens: &impl Lens) -> [(&'static str, f64); 2] {
    let centre = lens.grid().centre();
    [("cx", centre.x), ("cy", centre.y)]
}

fn scalars(groups: &[&[(&'static str, f64)]]) -> Vec<(&'static str, Parameter)> {
    groups.iter().copied().flatten().map(|&(name, value)| (name, Parameter::Scalar(value))).collect()
}

/// Parameters that have been matched against the keys of a model: every lookup of a key of the model has an answer.
struct Values<'a> {
    entries: Vec<(&'static str, Entry<'a>)>,
}

/// No lens has a parameter beyond this: a number as large is a slip, and would overflow.
const LARGEST: f64 = 1e15;

enum Entry<'a> {
    Scalar(f64),
    List(&'a [f64]),
}

impl<'a> Values<'a> {
    fn read(spec: &Spec, given: &'a [(String, Parameter)]) -> Result<Self> {
        let model = spec.name;
        let keys = || spec.keys.iter().map(|key| key.0);
        for (i, (name, _)) in given.iter().enumerate() {
            if !keys().any(|key| key == name) {
                return Err(unknown(model, "parameter", name, keys()));
            }
            if given[..i].iter().any(|earlier| earlier.0 == *name) {
                return Err(Error::camera(model, name.clone(), "given twice", "each parameter once"));
            }
        }
        let mut entries = Vec::with_capacity(spec.keys.len());
        for &(name, kind) in spec.keys {
            let value = given.iter().find(|(key, _)| key == name).map(|(_, value)| value);
            let is_list = matches!(kind, RequiredList | OptionalList);
            let entry = match (value, kind) {
                (Some(Parameter::Scalar(x)), _) if !is_list => Entry::Scalar(*x),
                (Some(Parameter::List(x)), _) if is_list => Entry::List(x),
                (Some(Parameter::Scalar(x)), _) => return Err(Error::camera(model, name, x, "a list of numbers")),
                (Some(Parameter::List(x)), _) => {
                    return Err(Error::camera(model, name, format!("{x:?}"), "one number, not a list"));
                }
                (None, Optional(default)) => Entry::Scalar(default),
                (None, OptionalList) => Entry::List(&[]),
                (None, Required | RequiredList) => {
                    let needed =
                        spec.keys.iter().filter(|key| matches!(key.1, Required | RequiredList)).map(|key| key.0);
                    let expected = format!("a value; {model} needs {}", list(needed));
                    return Err(Error::camera(model, name, "missing", expected));
                }
            };
            let numbers = match &entry {
                Entry::Scalar(x) => std::slice::from_ref(x),
                Entry::List(x) => x,
            };
            if let Some(wrong) = numbers.iter().find(|x| x.is_nan() || x.abs() > LARGEST) {
                return Err(Error::camera(model, name, wrong, "a finite number of ordinary size"));
            }
            entries.push((name, entry));
        }
        Ok(Self { entries })
    }

    fn scalar(&self, name: &str) -> f64 {
        match self.entries.iter().find(|entry| entry.0 == name) {
            Some((_, Entry::Scalar(value))) => *value,
            _ => f64::NAN,
        }
    }

    fn scalars<const N: usize>(&self, names: [&str; N]) -> [f64; N] {
        names.map(|name| self.scalar(name))
    }

    fn list(&self, name: &str) -> &'a [f64] {
        match self.entries.iter().find(|entry| entry.0 == name) {
            Some((_, Entry::List(values))) => values,
            _ => &[],
        }
    }

    fn focal(&self) -> [f64; 2] {
        self.scalars(["fx", "fy"])
    }

    fn centre(&self) -> [f64; 2] {
        self.scalars(["cx", "cy"])
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

/// Levenshtein's number of insertions, deletions and replacements of a character.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(parameters: &[(&str, f64)]) -> Vec<(String, Parameter)> {
        parameters.iter().map(|&(name, value)| (name.to_owned(), Parameter::Scalar(value))).collect()
    }

    fn message(model: &str, parameters: &[(&str, f64)]) -> String {
        Model::from_parameters(model, 640, 480, &named(parameters)).map_or_else(|e| e.to_string(), |_| String::new())
    }

    #[test]
    fn unknown_names_are_answered_with_near_ones() {
        let text = message("kanala-brandt", &[]);
        assert!(text.contains("did you mean kannala_brandt?") && text.contains("equirectangular"), "{text}");
        let text = message("pinhole", &[("fx", 1.0), ("fy", 1.0), ("cx", 1.0), ("cy", 1.0), ("kk1", 0.1)]);
        assert!(text.contains("did you mean k1?") && text.contains("fx, fy, cx, cy"), "{text}");
    }

    #[test]
    fn missing_double_and_foolish_values_are_named() {
        assert!(message("pinhole", &[("fx", 1.0), ("cx", 1.0), ("cy", 1.0)]).contains("fy = missing"));
        assert!(message("equidistant", &[("cx", 1.0), ("cx", 1.0)]).contains("cx = given twice"));
        let text = message("pinhole", &[("fx", -1.0), ("fy", 1.0), ("cx", 1.0), ("cy", 1.0)]);
        assert!(text.contains("fx = -1, expected a positive finite number"), "{text}");
        let text = message("ocam", &[("polynomial", -1.0), ("cx", 1.0), ("cy", 1.0)]);
        assert!(text.contains("a list of numbers"), "{text}");
    }

    #[test]
    fn edit_distances() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
    }
}
