//! The guide and the README name files, functions, constants, models and methods: each of them is there. Needs no device.
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use threadlight::low_level::brdf::{Brdf, Parameter};
use threadlight::low_level::method::Method;

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

/// The number of an equation of ours, as in "(F12)".
fn equation(word: &str) -> Option<usize> {
    word.strip_prefix("(F")?.strip_suffix(')')?.parse().ok()
}

/// The numbers of the equations of the chapter on the method, in its order: each is at the end of a line of a block.
fn equations_of(chapter: &str) -> Vec<usize> {
    let mut in_block = false;
    let mut numbers = Vec::new();
    for line in chapter.lines() {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
        } else if in_block {
            numbers.extend(line.split_whitespace().next_back().and_then(equation));
        }
    }
    numbers
}

/// The numbers of equations that a text cites in brackets.
fn cited_equations(text: &str) -> impl Iterator<Item = usize> {
    text.split(['(', ')']).filter_map(|part| equation(&format!("({part})")))
}

/// The files in `folder` and below whose names end in one of `extensions`.
fn files_below(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let entries =
        fs::read_dir(folder).expect("a readable folder").map(|entry| entry.expect("a readable folder").path());
    let has_one =
        |path: &Path| path.extension().is_some_and(|own| extensions.iter().any(|extension| own == *extension));
    entries
        .flat_map(|path| match path.is_dir() {
            true => files_below(&path, extensions),
            false => Vec::from_iter(has_one(&path).then_some(path)),
        })
        .collect()
}

#[test]
fn files_that_cite_an_equation_are_named_by_the_chapter_that_has_it() {
    let chapter = fs::read_to_string(root().join("src/guide/method.md")).expect("the chapter");
    let in_chapter = equations_of(&chapter);
    let sources =
        ["src", "glsl"].map(|folder| files_below(&root().join(folder), &["rs", "glsl", "comp", "frag", "vert"]));
    let mut citations = 0;
    for path in sources.concat() {
        let text = fs::read_to_string(&path).expect("a readable source");
        let name = path.strip_prefix(root()).expect("it is below").display().to_string();
        for cited in cited_equations(&text) {
            assert!(in_chapter.contains(&cited), "{name} cites (F{cited}), which the chapter does not have");
            assert!(chapter.contains(&name), "{name} cites (F{cited}), but the chapter does not name the file");
            citations += 1;
        }
    }
    assert!(citations > 20, "{citations}");
}

#[test]
fn equations_are_numbered_in_order() {
    let text = fs::read_to_string(root().join("src/guide/method.md")).expect("the chapter");
    let numbers = equations_of(&text);
    assert!(numbers.len() > 20 && numbers.iter().copied().eq(1..=numbers.len()), "{numbers:?}");
    assert!(cited_equations(&text).all(|cited| (1..=numbers.len()).contains(&cited)));
}

#[test]
fn the_readme_is_short() {
    let readme = fs::read_to_string(root().join("README.md")).expect("the README");
    let lines = readme.lines().count();
    assert!(lines <= 150, "{lines} lines");
    let widest = readme.lines().map(|line| line.chars().count()).max().unwrap_or_default();
    assert!(widest <= 160, "{widest} columns");
}

/// The rows of the guide's tables of `chapter` whose first cell names something in backquotes: each name, and the row.
fn named_rows(chapter: &str) -> Vec<(&str, &str)> {
    let rows = chapter.lines().filter_map(|line| Some((line.strip_prefix("| ")?.split_once(" | ")?.0, line)));
    let names = rows.flat_map(|(cell, row)| cell.split(", ").map(move |name| (name, row)));
    names.filter_map(|(name, row)| Some((name.strip_prefix('`')?.strip_suffix('`')?, row))).collect()
}

#[test]
fn the_guide_lists_each_model_with_all_that_it_reads() {
    let usage = fs::read_to_string(root().join("src/guide/usage.md")).expect("the chapter");
    let (_, models) = usage.split_once("| model | parameters |").expect("the table of models");
    let (models, _) = models.split_once("\n## ").expect("the chapter goes on");
    let rows = named_rows(models);
    let names: BTreeSet<_> = rows.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, Brdf::models_with_parameters().into_iter().collect());
    // What several models have, as the forms of roughness and of metals, is told below the table.
    let prose: String = models.lines().filter(|line| !line.starts_with('|')).collect();
    let has = |text: &str, key: &str| {
        let quoted = text.split('`').skip(1).step_by(2);
        let mut words = quoted.flat_map(|code| code.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')));
        words.any(|word| word == key)
    };
    for (model, row) in rows {
        let read = Brdf::possible_parameters(model, &Default::default()).expect("a sound table");
        assert!(!read.is_empty(), "{model}");
        for Parameter { key, .. } in read {
            let key = key.rsplit('.').next().unwrap_or_default();
            assert!(has(row, key) || has(&prose, key), "{model}: the guide does not have `{key}`");
        }
    }
}

#[test]
fn the_guide_lists_each_environment_variable_of_ours() {
    let is_of_name = |c: char| c.is_ascii_uppercase() || c == '_';
    let variables = |text: &str| -> BTreeSet<String> {
        let words = text.split(|c: char| !is_of_name(c));
        let of_ours = words.filter(|word| word.strip_prefix("THREADLIGHT_").is_some_and(|rest| !rest.is_empty()));
        of_ours.map(str::to_owned).collect()
    };
    let sources = ["src", "tests"].map(|folder| files_below(&root().join(folder), &["rs"])).concat();
    let read = sources.iter().flat_map(|path| variables(&fs::read_to_string(path).expect("a readable source")));
    let usage = fs::read_to_string(root().join("src/guide/usage.md")).expect("the chapter");
    assert_eq!(read.collect::<BTreeSet<_>>(), variables(&usage));
}

#[test]
fn the_guide_lists_each_method_with_how_many_threads_it_may_have() {
    let usage = fs::read_to_string(root().join("src/guide/usage.md")).expect("the chapter");
    let (_, methods) = usage.split_once("| method | what it is |").expect("the table of methods");
    let (methods, _) = methods.split_once("\n## ").expect("the chapter goes on");
    let rows = named_rows(methods);
    assert!(rows.iter().map(|(name, _)| *name).eq(Method::ALL.iter().map(|method| method.name())));
    for (name, row) in rows {
        let method = Method::from_name(name).expect("a method");
        if let Some(kind) = method.threads() {
            let counts = format!("1 to {} of them, {} if not said", kind.max_count(), kind.default_count());
            assert!(row.contains(&counts), "{name}: {counts}");
        }
    }
}
