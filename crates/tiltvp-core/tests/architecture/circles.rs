//! No files of the core import each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::source::{paths, resolve, sources, tokens};

/// What a file names of others, as paths from the crate's root; modules written inline, such as its tests, are not looked at.
fn names_of_others(module: &[&str], source: &str) -> Vec<Vec<String>> {
    let tokens = tokens(source);
    let word = |at: usize| tokens.get(at).map_or("", |t| t.text.as_str());
    let end = (0..tokens.len()).find(|at| word(*at) == "mod" && word(at + 2) == "{").unwrap_or(tokens.len());
    let is_path = |at: &usize| ["crate", "super", "self"].contains(&word(*at)) && word(at + 1) == "::";
    let mut leaves = Vec::new();
    for at in (0..end).filter(is_path) {
        paths(&tokens, at, &[], &mut leaves);
    }
    leaves.iter().map(|leaf| resolve(module, leaf)).collect()
}

/// The files that are left once each that imports none of the others is taken away, and each that none of the others imports.
fn circles(mut arrows: BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> Vec<Vec<String>> {
    loop {
        let before = arrows.len();
        let files: BTreeSet<_> = arrows.keys().cloned().collect();
        let imported: BTreeSet<_> = arrows.values().flatten().cloned().collect();
        arrows.retain(|file, to| imported.contains(file) && !to.is_disjoint(&files));
        if arrows.len() == before {
            return files.into_iter().collect();
        }
    }
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    // The faces of folders hand on the names of what stands in them.
    files.retain(|file| !file.ends_with("mod.rs") && !file.ends_with("lib.rs"));
    let module = |file: &PathBuf| -> Vec<String> {
        file.strip_prefix(&root)
            .unwrap()
            .with_extension("")
            .iter()
            .map(|part| part.to_str().unwrap().to_owned())
            .collect()
    };
    let known: BTreeSet<Vec<String>> = files.iter().map(module).collect();
    let arrows = files.iter().map(|file| {
        let own = module(file);
        let here: Vec<&str> = own.iter().map(String::as_str).collect();
        let named = names_of_others(&here, &std::fs::read_to_string(file).unwrap());
        let file_of =
            |path: Vec<String>| (1..=path.len()).map(|n| path[..n].to_vec()).find(|part| known.contains(part));
        let to: BTreeSet<_> = named.into_iter().filter_map(file_of).filter(|to| *to != own).collect();
        (own, to)
    });
    let arrows: BTreeMap<_, _> = arrows.collect();
    assert!(arrows.values().map(BTreeSet::len).sum::<usize>() > 300, "few imports seen");
    assert_eq!(circles(arrows), Vec::<Vec<String>>::new());
}

#[test]
fn circles_are_seen() {
    let named = |text: &str| text.split("::").map(str::to_owned).collect::<Vec<_>>();
    let of = |arrows: &[(&str, &[&str])]| {
        circles(arrows.iter().map(|(from, to)| (named(from), to.iter().map(|to| named(to)).collect())).collect())
    };
    assert!(of(&[("a", &["b", "c::d"]), ("b", &["c::d"]), ("c::d", &[])]).is_empty());
    assert_eq!(of(&[("a", &["b"]), ("b", &["c::d"]), ("c::d", &["b"]), ("e", &[])]), [named("b"), named("c::d")]);
    let source =
        "use super::scratch::{Work, Scratch}; fn f(x: crate::tilt::fit::Fit) {} mod tests { use super::up::Up; }";
    let seen = [["tilt", "scratch", "Work"], ["tilt", "scratch", "Scratch"], ["tilt", "fit", "Fit"]];
    assert_eq!(names_of_others(&["tilt", "trust"], source), seen);
}
