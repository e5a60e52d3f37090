//! Arrows point down: no module imports from its own floor or from one above, and the core prints, reads and clocks nothing.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The floors of the house, the ground first. Modules of one floor are sisters, which never import each other; only the
/// ground floor is one.
const FLOORS: [&[&str]; 6] = [
    &["geometry", "error", "interrupt", "options", "simd"],
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

/// A word or mark of a source, and its line.
#[derive(Debug, Clone, PartialEq)]
struct Token {
    text: String,
    line: usize,
}

/// Words, `::` and single marks, without comments and the insides of strings and characters.
fn tokens(source: &str) -> Vec<Token> {
    let chars: Vec<char> = source.chars().collect();
    let (mut i, mut line, mut out) = (0, 1, Vec::new());
    while i < chars.len() {
        let next = chars.get(i + 1).copied().unwrap_or(' ');
        let start = i;
        match chars[i] {
            '/' if next == '/' => i += chars[i..].iter().take_while(|c| **c != '\n').count(),
            '/' if next == '*' => {
                let mut depth = 0;
                while i < chars.len() {
                    match (chars[i], chars.get(i + 1)) {
                        ('/', Some('*')) => (depth, i) = (depth + 1, i + 2),
                        ('*', Some('/')) => (depth, i) = (depth - 1, i + 2),
                        _ => i += 1,
                    }
                    if depth == 0 {
                        break;
                    }
                }
            }
            '"' => {
                i += 1;
                while i < chars.len() && chars[i] != '"' {
                    i += if chars[i] == '\\' { 2 } else { 1 };
                }
                i += 1;
            }
            'r' if next == '"' || (next == '#' && raw_string(&chars[i + 1..]).is_some()) => {
                i += 1 + raw_string(&chars[i + 1..]).unwrap();
            }
            // A character; a lifetime has no closing mark.
            '\'' if next == '\\' => i += 3 + chars[i + 3..].iter().take_while(|c| **c != '\'').count(),
            '\'' if chars.get(i + 2) == Some(&'\'') => i += 3,
            c if c.is_alphanumeric() || c == '_' => {
                let word: String = chars[i..].iter().take_while(|c| c.is_alphanumeric() || **c == '_').collect();
                i += word.chars().count();
                out.push(Token { text: word, line });
            }
            ':' if next == ':' => {
                out.push(Token { text: "::".to_owned(), line });
                i += 2;
            }
            c => {
                if !c.is_whitespace() {
                    out.push(Token { text: c.to_string(), line });
                }
                i += 1;
            }
        }
        line += chars[start..i.min(chars.len())].iter().filter(|c| **c == '\n').count();
    }
    out
}

/// The length of `#"..."#` with any number of hashes, none included.
fn raw_string(after_r: &[char]) -> Option<usize> {
    let hashes = after_r.iter().take_while(|c| **c == '#').count();
    let end: Vec<char> = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
    let body = after_r.get(hashes..).filter(|rest| rest.first() == Some(&'"'))?;
    let close = body[1..].windows(end.len()).position(|window| window == end)?;
    Some(hashes + 1 + close + end.len())
}

/// Every path that the tree of segments at `at` spells, `a::{b, c::d}` being two, and the place after it.
fn paths(tokens: &[Token], mut at: usize, prefix: &[String], out: &mut Vec<Vec<String>>) -> usize {
    let mut path = prefix.to_vec();
    loop {
        match tokens.get(at).map(|t| t.text.as_str()) {
            Some("{") => {
                at += 1;
                while at < tokens.len() && tokens[at].text != "}" {
                    at = paths(tokens, at, &path, out);
                    // Over `as name` and the comma.
                    while at < tokens.len() && tokens[at].text != "," && tokens[at].text != "}" {
                        at += 1;
                    }
                    at += usize::from(at < tokens.len() && tokens[at].text == ",");
                }
                return at + 1;
            }
            Some(word) => path.push(word.to_owned()),
            None => break,
        }
        if tokens.get(at + 1).is_none_or(|t| t.text != "::") {
            break;
        }
        at += 2;
    }
    out.push(path);
    at + 1
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

/// The path from the crate's root.
fn resolve(here: &[&str], path: &[String]) -> Vec<String> {
    let mut absolute: Vec<String> = here.iter().map(|&s| s.to_owned()).collect();
    for segment in path {
        match segment.as_str() {
            "crate" => absolute.clear(),
            "super" => drop(absolute.pop()),
            "self" => {}
            name => absolute.push(name.to_owned()),
        }
    }
    absolute
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

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
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
