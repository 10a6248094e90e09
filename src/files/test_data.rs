//! Measured data beside the project, for tests: where it is is said here alone.
use std::path::PathBuf;

/// What is at `name` in the folder that THREADLIGHT_DATA names; none where there is nothing. Tests that need it are then left out, and say so.
pub(crate) fn measured(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("THREADLIGHT_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let path = folder.join(name);
    if !path.exists() {
        println!("skipped: {} is not here", path.display());
        return None;
    }
    Some(path)
}
