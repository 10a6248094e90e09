//! Files that are kept to save time: that one cannot be written is no failure.
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::whole_file::make_way;
use crate::error::{Error, Result};

/// Folders of which a warning was given.
static USELESS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Has `write` write the file at `path`, in a folder that is made where there is none. A folder that cannot be written to costs time
/// later, nothing else, so it is only warned of, and once: what else goes there has the same reason, mostly.
pub(crate) fn keep_file(path: &Path, write: impl FnOnce() -> Result<()>) {
    let folder = path.parent().unwrap_or(path);
    let made = std::fs::create_dir_all(folder).map_err(|cause| Error::unwritable(folder, cause));
    if let Err(error) = made.and_then(|()| make_way(path)).and_then(|()| write())
        && USELESS.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_owned())
    {
        tracing::warn!("what takes time to make is not kept on disk: {error} (THREADLIGHT_CACHE may name another)");
    }
}
