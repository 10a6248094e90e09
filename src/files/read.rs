//! Reads whole files, but nothing that might have no end.
use std::path::Path;

use crate::error::{Error, Result};

/// Largest file that is read: more than any picture of as many pixels as are read takes, uncompressed.
const MAX_BYTES: u64 = 1 << 33;

/// The bytes of the file at `path`.
///
/// # Errors
/// No file, or one that cannot be read: a folder, a pipe or a device, which might have no end, and a file of more than 8 GiB.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let unreadable = |cause| Error::unreadable(path, cause);
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        let what = if metadata.is_dir() { "is a folder" } else { "is a pipe or a device, not a file" };
        return Err(Error::in_file(path, what, "name a file"));
    }
    if metadata.len() > MAX_BYTES {
        return Err(Error::in_file(
            path,
            format!("has {} bytes, more than 8 GiB", metadata.len()),
            "give a smaller file",
        ));
    }
    std::fs::read(path).map_err(unreadable)
}

/// `bytes`, of the file at `path`, as text.
///
/// # Errors
/// They are not UTF-8.
pub fn text<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a str> {
    std::str::from_utf8(bytes)
        .map_err(|cause| Error::in_file(path, format!("is not text in UTF-8 ({cause})"), "save it as UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_regular_file_is_an_error_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("folder")).unwrap();
        std::fs::File::create(path("huge")).unwrap().set_len(1 << 40).unwrap();
        let mut hostile = vec![("folder", "is a folder"), ("huge", "8 GiB"), ("absent", "cannot be read")];
        if cfg!(unix) {
            // Opening a pipe that nobody writes to would wait for ever.
            assert!(std::process::Command::new("mkfifo").arg(path("pipe")).status().unwrap().success());
            hostile.push(("pipe", "is a pipe"));
        }
        for (name, problem) in hostile {
            let error = read(&path(name)).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(problem) && !error.contains('\n'), "{error}");
        }
        if cfg!(unix) {
            assert!(read(Path::new("/dev/zero")).unwrap_err().to_string().contains("a device"));
        }
    }
}
