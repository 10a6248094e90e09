//! Outputs on disk: a file each, named by its key.
use super::Key;
use crate::error::{Error, Result};
use crate::files::keep_file;
use std::path::{Path, PathBuf};

/// Reads an output from the file at a path.
pub type Read<'s, T> = dyn Fn(&Path) -> Result<T> + 's;
/// Writes an output to the file at a path.
pub type Write<'s, T> = dyn Fn(&Path, &T) -> Result<()> + 's;

/// How an output is kept on disk.
pub struct Stored<'s, T> {
    /// Extension of its file.
    pub extension: &'static str,
    /// Reads it; a damaged file is an error, and the output is made again.
    pub read: Box<Read<'s, T>>,
    /// Writes it, whole or not at all.
    pub write: Box<Write<'s, T>>,
}

/// The folder for what takes long to make: the environment variable THREADLIGHT_CACHE, else the user's cache folder; none where the user
/// has no home.
pub fn default_folder() -> Option<PathBuf> {
    match std::env::var_os("THREADLIGHT_CACHE").filter(|folder| !folder.is_empty()) {
        Some(folder) => Some(folder.into()),
        None => directories::ProjectDirs::from("", "", "threadlight").map(|folders| folders.cache_dir().to_path_buf()),
    }
}

impl<T> Stored<'_, T> {
    fn path(&self, folder: &Path, key: Key) -> PathBuf {
        folder.join(format!("{key}.{}", self.extension))
    }

    /// The output of `key`, if it is there; what is damaged is reported.
    pub(super) fn read(&self, folder: &Path, key: Key) -> Option<T> {
        let path = self.path(folder, key);
        // Only of a file: reading a pipe would wait for someone to write.
        let kind = std::fs::metadata(&path).ok()?.file_type();
        let output = if kind.is_file() {
            (self.read)(&path)
        } else {
            Err(Error::in_file(&path, "is not a file", "it is replaced"))
        };
        output.inspect_err(|error| tracing::warn!("what was kept on disk is useless: {error}")).ok()
    }

    /// Keeps `output` under `key`, if that can be.
    pub(super) fn write(&self, folder: &Path, key: Key, output: &T) {
        let path = self.path(folder, key);
        keep_file(&path, || (self.write)(&path, output));
    }
}
