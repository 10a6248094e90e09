//! Files that steps read: known by their contents, not by their names.
use super::Key;
use crate::error::{Error, Result};
use crate::files::read;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The keys of files' contents, as they were when they were looked at. Contents that were read for their key are kept until someone takes
/// them or [`Self::release`].
#[derive(Default)]
pub(super) struct Files(Mutex<Known>);

type Known = HashMap<PathBuf, (Key, Option<Vec<u8>>)>;

impl Files {
    /// The key of the contents of the file at `path`; it is read unless that is known.
    pub fn key(&self, path: &Path) -> Result<Key> {
        if let Some((key, _)) = self.lock().get(path) {
            return Ok(*key);
        }
        let bytes = read(path)?;
        let key = Key::of_bytes(&bytes);
        // Another thread may have read it meanwhile: whoever was first says what it is until it is forgotten.
        let mut known = self.lock();
        let (key, _) = known.entry(path.to_owned()).or_insert((key, Some(bytes)));
        Ok(*key)
    }

    /// The contents that [`Self::key`] names.
    pub fn bytes(&self, path: &Path) -> Result<Vec<u8>> {
        let known = self.key(path)?;
        if let Some(bytes) = self.lock().get_mut(path).and_then(|(_, bytes)| bytes.take()) {
            return Ok(bytes);
        }
        let bytes = read(path)?;
        if Key::of_bytes(&bytes) == known {
            return Ok(bytes);
        }
        Err(Error::in_file(path, "was changed since it was opened", "open it again"))
    }

    /// What `find` makes of the contents that [`Self::key`] names, which stay as they are kept.
    pub fn look<T>(&self, path: &Path, find: impl FnOnce(&[u8]) -> T) -> Result<T> {
        let bytes = self.bytes(path)?;
        let found = find(&bytes);
        if let Some((_, kept)) = self.lock().get_mut(path) {
            kept.get_or_insert(bytes);
        }
        Ok(found)
    }

    /// Lets go of contents that nobody took.
    pub fn release(&self) {
        self.lock().values_mut().for_each(|(_, bytes)| *bytes = None);
    }

    /// The file at `path` counts as one of the contents that `key` is of, whatever it has by now.
    pub fn set_key(&self, path: &Path, key: Key) {
        self.lock().insert(path.to_owned(), (key, None));
    }

    /// Nothing is known of the file at `path` any more.
    pub fn forget(&self, path: &Path) {
        self.lock().remove(path);
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_its_contents_and_is_looked_at_again_only_when_asked_to() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let files = Files::default();
        std::fs::write(&a, "one").unwrap();
        std::fs::write(&b, "one").unwrap();
        let one = files.key(&a).unwrap();
        assert_eq!(files.key(&b).unwrap(), one);
        std::fs::write(&a, "two").unwrap();
        assert_eq!(files.key(&a).unwrap(), one);
        assert_eq!(files.bytes(&a).unwrap(), b"one");
        assert!(files.bytes(&a).unwrap_err().to_string().contains("changed"));
        files.forget(&a);
        assert_ne!(files.key(&a).unwrap(), one);
        assert_eq!(files.bytes(&a).unwrap(), b"two");
        files.forget(&a);
        std::fs::remove_file(&a).unwrap();
        assert!(files.key(&a).is_err());
        files.set_key(&a, one);
        assert!(files.key(&a).unwrap() == one && files.bytes(&a).is_err());
    }
}
