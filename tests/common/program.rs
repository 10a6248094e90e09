//! The program, as its user starts it.
use super::{device_name, folder_of_run};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Its file.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_threadlight");

/// The program in `folder`, with the caches of all tests of a run if there are any, or else of its own: what was made once need not be made again.
pub fn program(folder: impl AsRef<Path>) -> Command {
    let cache = folder_of_run().unwrap_or_else(|| own_cache(&folder));
    program_with_cache(folder, cache)
}

/// The program in `folder`, with its caches in `cache`. Neither these nor what it logs depend on who runs the tests.
pub fn program_with_cache(folder: impl AsRef<Path>, cache: impl AsRef<Path>) -> Command {
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).env("THREADLIGHT_CACHE", cache.as_ref()).env_remove("RUST_LOG");
    command
}

/// Caches that no other test has a part in, for tests of what is made, and when.
pub fn own_cache(folder: impl AsRef<Path>) -> PathBuf {
    folder.as_ref().join("cache")
}

/// The flags by which commands that open a device open that of tests.
pub fn device_flags() -> Vec<String> {
    device_name().map_or_else(Vec::new, |device| vec!["--device".to_owned(), device])
}
