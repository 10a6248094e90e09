//! Bad input: a reason on one line that names what is at fault, exit code 2, no panic and nothing written.
mod command_line;
#[path = "../common/mod.rs"]
mod common;
mod environments;
mod materials;
mod measurements;
mod meshes;
mod outputs;
mod scene_files;

use common::{own_cache, program_with_cache};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A folder of hostile files, with an empty folder `out` in it for what must not be written.
fn workplace() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("out")).unwrap();
    folder
}

/// Runs threadlight with `arguments` (separated by spaces) in `folder` and checks how it refuses: `names` are in the reason.
fn refuses(folder: &TempDir, arguments: &str, names: &[&str]) {
    let before = listing(folder.path());
    let output = program_with_cache(folder, own_cache(folder)).args(arguments.split(' ')).output().unwrap();
    let said = format!("threadlight {arguments}\n{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(output.stdout.is_empty(), "{said}");
    let reason = String::from_utf8(output.stderr).unwrap();
    assert!(reason.starts_with("threadlight: ") && reason.ends_with('\n'), "{said}");
    assert_eq!(reason.lines().count(), 1, "{said}");
    assert!(!reason.contains("panicked"), "{said}");
    for name in names {
        assert!(reason.contains(name), "{said}does not name {name}");
    }
    assert_eq!(listing(folder.path()), before, "{said}");
}

/// Every file in `folder` and below, but for the cache, with its size.
fn listing(folder: &Path) -> Vec<(String, u64)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap).filter(|entry| entry.file_name() != "cache") {
        files.push((entry.path().display().to_string(), entry.metadata().unwrap().len()));
        if entry.path().is_dir() {
            files.extend(listing(&entry.path()));
        }
    }
    files.sort();
    files
}

/// `render` with `flags` and a picture to write.
fn render(flags: &str) -> String {
    format!("render --size 8x6 --threads 2 -o out/image.png {flags}")
}

/// Bytes without meaning, always the same.
fn noise(count: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let mut next = || {
        // Knuth's MMIX generator; its high bits are the good ones.
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 56) as u8
    };
    (0..count).map(|_| next()).collect()
}
