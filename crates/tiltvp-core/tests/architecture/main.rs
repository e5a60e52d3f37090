//! Arrows point down: no module imports from its own floor or from one above, no files import each other in a circle, and the
//! core prints, reads and clocks nothing.

#![allow(clippy::unwrap_used, clippy::panic)]

mod circles;
mod source;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use source::{Token, paths, resolve, sources, tokens};

/// The floors of the house, the ground first. Modules of one floor are sisters, which never import each other; only the
/// ground floor is one.
const FLOORS: [&[&str]; 6] = [
    &["geometry", "error", "interrupt", "options", "parallel", "simd"],
    &["robust", "camera", "image", "filter"],
    &["edges"],
    &["segments"],
    &["tilt", "corner", "lines"],
    &["selfcalib"],
];

/// The crates, the ground first: the kernels are floor 0, below all modules of the core.
const CRATES: [&str; 4] = ["tiltvp_kernels", "tiltvp_core", "tiltvp_synth", "tiltvp_py"];

/// The folders of the crates that may say `unsafe`: the kernels for vectors, the C interface for the pointers of its callers.
const UNSAFE: [&str; 2] = ["tiltvp-capi", "tiltvp-kernels"];

/// The first part of the path of a file of the kernels; the others are files of the core.
const KERNELS: &str = CRATES[0];

/// Modules that may import anything: the public list, and what tests share.
const ABOVE_ALL: [&str; 2] = ["lib", "testing"];

/// What the crate's root has of the ground floor, so that `crate::Error` is not an arrow to the roof: re-exports of `error`, and
/// the macros of `options`, which Rust puts at the root.
const GROUND_NAMES: [&str; 6] = ["Error", "Result", "methods", "option_choice", "option_part", "words"];

/// Parts of the standard library that the core does without.
const FORBIDDEN_STD: [&str; 5] = ["fs", "time", "env", "process", "net"];

/// Macros that print.
const FORBIDDEN_MACROS: [&str; 5] = ["println", "eprintln", "print", "eprint", "dbg"];

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.contains(&module))
}

/// What a source file may not say: (line, complaint).
fn complaints(module: &[&str], source: &str) -> Vec<(usize, String)> {
    let tokens = tokens(source);
    let top = module.first().copied().unwrap_or("lib");
    let mut found = Vec::new();
    // Modules written inline, with the depth of braces outside of each.
    let (mut inline, mut depth): (Vec<(String, usize)>, usize) = (Vec::new(), 0);
    let mut at = 0;
    while at < tokens.len() {
        let Token { text, line } = &tokens[at];
        let after = |n: usize| tokens.get(at + n).map_or("", |t| t.text.as_str());
        let first_of_path = at == 0 || tokens[at - 1].text != "::";
        match text.as_str() {
            "mod" if after(2) == "{" => {
                inline.push((after(1).to_owned(), depth));
                depth += 1;
                at += 3;
                continue;
            }
            "{" => depth += 1,
            "}" => {
                depth = depth.saturating_sub(1);
                if inline.last().is_some_and(|(_, outside)| *outside == depth) {
                    inline.pop();
                }
            }
            word if FORBIDDEN_MACROS.contains(&word) && after(1) == "!" => {
                found.push((*line, format!("{word}! prints")));
            }
            word if first_of_path && after(1) == "::" && CRATES.contains(&word) => {
                let complaint = forbidden_crate(if top == KERNELS { CRATES[0] } else { CRATES[1] }, word);
                found.extend(complaint.map(|complaint| (*line, complaint)));
            }
            "unsafe" if top != KERNELS => found.push((*line, "unsafe is for the kernels".to_owned())),
            "crate" | "super" | "self" | "std" if first_of_path && after(1) == "::" => {
                let mut leaves = Vec::new();
                let end = paths(&tokens, at, &[], &mut leaves);
                let here: Vec<&str> =
                    module.iter().copied().chain(inline.iter().map(|(name, _)| name.as_str())).collect();
                for leaf in leaves {
                    let complaint = if leaf[0] == "std" {
                        forbidden_std(&leaf)
                    } else {
                        forbidden_arrow(top, &resolve(&here, &leaf))
                    };
                    found.extend(complaint.map(|complaint| (*line, format!("{}: {complaint}", leaf.join("::")))));
                }
                at = end;
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    found
}

fn forbidden_std(path: &[String]) -> Option<String> {
    let part = path.get(1)?;
    FORBIDDEN_STD.contains(&part.as_str()).then(|| format!("the core knows no std::{part}"))
}

fn forbidden_crate(from: &str, to: &str) -> Option<String> {
    let place = |name: &str| CRATES.iter().position(|other| *other == name);
    (place(to) > place(from)).then(|| format!("{from} points up to {to}"))
}

fn forbidden_arrow(from: &str, target: &[String]) -> Option<String> {
    // `pub(in crate)` and the like have no target.
    let to = target.first()?.as_str();
    if from == KERNELS || ABOVE_ALL.contains(&from) || to == from || GROUND_NAMES.contains(&to) {
        return None;
    }
    match (floor(from), floor(to)) {
        (None, _) => Some(format!("module {from} has no floor")),
        (_, None) => Some(format!("{to} has no floor")),
        (Some(0), Some(0)) => None,
        (Some(a), Some(b)) if b < a => None,
        (Some(a), Some(b)) if a == b => Some(format!("{from} points sideways to its sister {to}")),
        _ => Some(format!("{from} points up to {to}")),
    }
}

/// What the sources of the kernels say that they may not.
fn complaints_about_kernels() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("tiltvp-kernels/src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    assert!(files.len() > 15, "only {} files of kernels seen", files.len());
    files.sort();
    let about = |file: &PathBuf| {
        let place = file.strip_prefix(root.parent().unwrap().parent().unwrap()).unwrap().display().to_string();
        let found = complaints(&[KERNELS, "any"], &std::fs::read_to_string(file).unwrap());
        found.into_iter().map(move |(line, text)| format!("{place}:{line}: {text}")).collect::<Vec<_>>()
    };
    files.iter().flat_map(about).collect()
}

#[test]
fn imports_point_down_and_the_core_knows_no_outside_world() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    files.sort();
    let mut lines = Vec::new();
    let mut seen = BTreeMap::<String, usize>::new();
    for file in &files {
        let relative = file.strip_prefix(&root).unwrap().with_extension("");
        let mut module: Vec<&str> = relative.iter().map(|part| part.to_str().unwrap()).collect();
        module.retain(|part| *part != "mod");
        *seen.entry(module[0].to_owned()).or_default() += 1;
        let place = file.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap().display().to_string();
        let source = std::fs::read_to_string(file).unwrap();
        lines.extend(complaints(&module, &source).into_iter().map(|(line, text)| format!("{place}:{line}: {text}")));
    }
    lines.extend(complaints_about_kernels());
    assert!(lines.is_empty(), "{}", lines.join("\n"));
    for module in seen.keys() {
        assert!(floor(module).is_some() || ABOVE_ALL.contains(&module.as_str()), "src/{module} has no floor");
    }
    assert!(seen.len() >= 7 && files.len() > 30, "only {} files seen", files.len());
}

#[test]
fn only_the_kernels_and_the_c_interface_say_unsafe() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let says_unsafe = |folder: &Path| {
        let mut files = Vec::new();
        sources(folder, &mut files);
        files.iter().any(|file| tokens(&std::fs::read_to_string(file).unwrap()).iter().any(|t| t.text == "unsafe"))
    };
    let folders = std::fs::read_dir(root).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<String> = folders
        .filter(|folder| says_unsafe(&folder.join("src")))
        .map(|folder| folder.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    found.sort();
    assert_eq!(found, UNSAFE);
}

#[test]
fn the_checker_sees_invented_bad_lines() {
    let bad: [(&[&str], &str, &str); 17] = [
        (&[KERNELS, "rows"], "use tiltvp_core::geometry::Tilt;", "tiltvp_kernels points up to tiltvp_core"),
        (&[KERNELS, "rows"], "use {std::fs::File, std::fmt};", "the core knows no std::fs"),
        (&[KERNELS, "rows"], "fn f() { println!(); }", "println! prints"),
        (&["robust", "rows"], "use tiltvp_synth::Room;", "tiltvp_core points up to tiltvp_synth"),
        (&["robust", "rows"], "fn f() { unsafe { g() } }", "unsafe is for the kernels"),
        (&["camera", "rim"], "use crate::tilt::Method;", "camera points up to tilt"),
        (&["camera", "rim"], "use crate::robust::Rows;", "camera points sideways to its sister robust"),
        (&["robust"], "use super::image::Smoother;", "robust points sideways"),
        (&["robust", "rows"], "use super::super::edges::Region;", "robust points up to edges"),
        (&["robust", "rows"], "mod tests { use super::super::super::tilt::Method; }", "robust points up to tilt"),
        (&["image", "view"], "use crate::{error::Error, edges::{Region, Span}};", "image points up to edges"),
        (&["edges", "lift"], "fn f() -> crate::tilt::Method { todo!() }", "edges points up to tilt"),
        (&["geometry", "tilt"], "let x = $crate::camera::Model::new();", "geometry points up to camera"),
        (&["tilt", "refine"], "use crate::lines::Line;", "tilt points sideways to its sister lines"),
        (&["tilt", "refine"], "use crate::novel::Thing;", "novel has no floor"),
        (&["tilt", "refine"], "fn f() { dbg!(1); }", "dbg! prints"),
        (&["tilt", "refine"], "use std::{fmt, time::Instant};", "the core knows no std::time"),
    ];
    for (module, line, expected) in bad {
        let found = complaints(module, &format!("//! A file.\n\n{line}\n"));
        assert!(!found.is_empty(), "{line}: nothing found");
        for (at, text) in found {
            assert_eq!(at, 3);
            assert!(text.contains(expected), "{line}: {text}");
        }
    }
}

#[test]
fn the_checker_lets_good_lines_pass() {
    let good: [(&[&str], &str); 11] = [
        (&["geometry", "tilt"], "use tiltvp_kernels::rows::Sums;"),
        (&[KERNELS, "rows", "real"], "use super::single; use crate::aligned::Dense; fn f() { unsafe { g() } }"),
        (&["tilt", "refine"], "use crate::{edges::Region, geometry::Tilt as Lean, robust::{Rows, Stop}};"),
        (&["tilt", "refine"], "use super::options::Method; use super::super::camera::Camera;"),
        (&["robust", "rows"], "mod single { use super::*; } mod tests { use super::super::Stop; }"),
        (&["camera"], "use crate::{Error, Result}; pub(crate) fn f() {} pub(super) fn g() {}"),
        (&["camera", "rim"], "/// See [`x`](crate::tilt::Method) and `println!`.\nfn f() {}"),
        (
            &["camera", "rim"],
            "/* crate::tilt:: /* nested */ std::fs */ const A: &str = \"crate::tilt:: \\\" println!\";",
        ),
        (&["camera", "rim"], "const A: &str = r#\"std::fs::read \" \"#; fn f<'a>(x: &'a str) -> char { '\"' }"),
        (&["testing"], "use crate::tilt::Method;"),
        (&["error"], "use std::fmt; use crate::geometry::Tilt;"),
    ];
    for (module, line) in good {
        assert_eq!(complaints(module, line), [], "{line}");
    }
}
