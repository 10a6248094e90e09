//! The guide and the README name files, functions and constants: each of them is there. Needs no device.
use std::fs;
use std::path::{Path, PathBuf};

/// Folders of the project whose files a text may name.
const FOLDERS: &[&str] = &["src/", "glsl/", "tests/", "assets/", "ci/"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The README and every file of the guide, with their text.
fn texts() -> Vec<(PathBuf, String)> {
    let chapters = fs::read_dir(root().join("src/guide")).expect("the guide's folder");
    let mut paths: Vec<PathBuf> = chapters.map(|entry| entry.expect("a readable folder").path()).collect();
    paths.push(root().join("README.md"));
    paths.sort();
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("a readable text");
        (path, text)
    };
    paths.into_iter().map(read).collect()
}

/// A place that a text names: `path` or `path::name`, names of nested items separated by `::`.
fn places(text: &str) -> impl Iterator<Item = &str> {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || "_-./:".contains(c)));
    let words = words.map(|word| word.trim_end_matches(['.', ':', '/']));
    words.filter(|word| FOLDERS.iter().any(|folder| word.starts_with(folder)))
}

/// What is wrong with a place, if anything.
fn problem(place: &str) -> Option<String> {
    let mut parts = place.split("::");
    let path = root().join(parts.next().unwrap_or_default());
    let names: Vec<&str> = parts.collect();
    if !path.exists() {
        return Some("there is no such file".into());
    }
    if names.is_empty() {
        return None;
    }
    let Ok(code) = fs::read_to_string(&path) else { return Some("cannot be read".into()) };
    let is_rust = path.extension().is_some_and(|extension| extension == "rs");
    let absent = names.into_iter().find(|name| !code.lines().any(|line| declares(line, name, is_rust)))?;
    Some(format!("nothing in it is called {absent}"))
}

/// Whether a line of Rust, or of GLSL, declares something of this name.
fn declares(line: &str, name: &str, is_rust: bool) -> bool {
    const KEYWORDS: &[&str] =
        &["fn", "struct", "enum", "trait", "const", "static", "type", "mod", "union", "macro_rules!"];
    let words: Vec<&str> = line.split(|c: char| !(c.is_ascii_alphanumeric() || "_!".contains(c))).collect();
    let is_declared = |pair: &[&str]| match is_rust {
        true => KEYWORDS.contains(&pair[0]) && pair[1] == name,
        // A type or a keyword, then the name; uses stand within functions or comments.
        false => !pair[0].is_empty() && pair[1] == name && !line.starts_with([' ', '\t', '/', '}']),
    };
    words.windows(2).any(is_declared)
}

#[test]
fn every_file_and_name_in_the_guide_exists() {
    let mut wrong = Vec::new();
    for (text_path, text) in texts() {
        for (number, line) in text.lines().enumerate() {
            let found = places(line).filter_map(|place| Some((place, problem(place)?)));
            let text_name = text_path.strip_prefix(root()).unwrap_or(&text_path).display();
            wrong.extend(found.map(|(place, problem)| format!("{text_name}:{}: {place}: {problem}", number + 1)));
        }
    }
    assert!(wrong.is_empty(), "{} of the guide's references are wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn what_does_not_exist_is_found_out() {
    let text =
        "See `src/guide/mod.rs::method`, glsl/shade.comp::surface_at (and src/no.rs, `glsl/shade.comp::nothing`).";
    let found: Vec<_> = places(text).map(|place| (place, problem(place).is_some())).collect();
    let expected = [
        ("src/guide/mod.rs::method", false),
        ("glsl/shade.comp::surface_at", false),
        ("src/no.rs", true),
        ("glsl/shade.comp::nothing", true),
    ];
    assert_eq!(found, expected);
}

#[test]
fn equations_are_numbered_in_order() {
    let text = fs::read_to_string(root().join("src/guide/method.md")).expect("the chapter");
    let number = |word: &str| word.strip_prefix("(F")?.strip_suffix(')')?.parse::<usize>().ok();
    let mut in_block = false;
    let mut numbers = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
        } else if in_block {
            numbers.extend(line.split_whitespace().next_back().and_then(number));
        }
    }
    assert!(numbers.len() > 20 && numbers.iter().copied().eq(1..=numbers.len()), "{numbers:?}");
    let cited = text.split(['(', ')']).filter_map(|part| number(&format!("({part})")));
    assert!(cited.into_iter().all(|cited| (1..=numbers.len()).contains(&cited)));
}

#[test]
fn the_readme_is_short() {
    let readme = fs::read_to_string(root().join("README.md")).expect("the README");
    let lines = readme.lines().count();
    assert!(lines <= 150, "{lines} lines");
    let widest = readme.lines().map(|line| line.chars().count()).max().unwrap_or_default();
    assert!(widest <= 160, "{widest} columns");
}
