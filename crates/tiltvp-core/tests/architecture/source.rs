//! Sources as words and marks, and the paths that they spell.

use std::path::{Path, PathBuf};

/// A word or mark of a source, and its line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Token {
    pub(crate) text: String,
    pub(crate) line: usize,
}

/// Words, `::` and single marks, without comments and the insides of strings and characters.
pub(crate) fn tokens(source: &str) -> Vec<Token> {
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
pub(crate) fn paths(tokens: &[Token], mut at: usize, prefix: &[String], out: &mut Vec<Vec<String>>) -> usize {
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

/// The path from the crate's root.
pub(crate) fn resolve(here: &[&str], path: &[String]) -> Vec<String> {
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

/// Every source below a folder.
pub(crate) fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}
