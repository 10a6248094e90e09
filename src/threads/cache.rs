//! Keeps generated threads on disk, so that a material is waited for once.
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{FORMAT_VERSION, Observer, ThreadSettings, Threads, file, generate};
use crate::brdf::Brdf;
use crate::error::Result;

/// Whether the threads came from the cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CacheState {
    /// They were on disk.
    Hit,
    /// They had to be generated.
    Miss,
}

/// The folder for cached threads: the environment variable THREADLIGHT_CACHE, else the user's cache folder; none
/// where the user has no home.
pub fn default_directory() -> Option<PathBuf> {
    match std::env::var_os("THREADLIGHT_CACHE").filter(|folder| !folder.is_empty()) {
        Some(folder) => Some(folder.into()),
        None => directories::ProjectDirs::from("", "", "threadlight").map(|folders| folders.cache_dir().to_path_buf()),
    }
}

/// The threads of `brdf`: from `folder` if they are there, else generated and put there. Also returns how long that took.
///
/// A damaged file is reported and replaced; a folder that cannot be written to is reported and otherwise no matter.
pub fn load_or_generate(
    brdf: &Brdf,
    settings: &ThreadSettings,
    folder: Option<&Path>,
    observer: &dyn Observer,
) -> Result<(Threads, CacheState, Duration)> {
    let start = Instant::now();
    let path = folder.map(|folder| folder.join(format!("{}.threads", key(brdf, settings))));
    if let Some(path) = path.as_deref().filter(|path| path.exists()) {
        match file::read(path) {
            Ok(threads) if (threads.kind(), threads.size()) == (settings.kind, [settings.rows, settings.count]) => {
                return Ok((threads, CacheState::Hit, start.elapsed()));
            }
            Ok(_) => tracing::warn!("{}: cached threads are of another kind; generating them again", path.display()),
            Err(error) => tracing::warn!("cached threads are useless: {error}"),
        }
    }
    let table = generate(brdf, settings, observer)?;
    let duration = start.elapsed();
    if let Some(path) = path {
        let folder = path.parent().unwrap_or(Path::new("."));
        let written = std::fs::create_dir_all(folder).map_err(|cause| crate::Error::unwritable(folder, cause));
        if let Err(error) = written.and_then(|()| file::write(&table, &path)) {
            tracing::warn!("threads are not cached: {error}");
        }
    }
    Ok((table, CacheState::Miss, duration))
}

/// Names everything that the threads depend on.
fn key(brdf: &Brdf, settings: &ThreadSettings) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(brdf.fingerprint().as_bytes());
    hasher.update(settings.kind.name().as_bytes());
    for number in [settings.count as u64, settings.rows as u64, settings.seed, u64::from(FORMAT_VERSION)] {
        hasher.update(&number.to_le_bytes());
    }
    hasher.finalize()
}

#[cfg(test)]
mod tests {
    use super::super::ThreadKind;
    use super::*;

    const SETTINGS: ThreadSettings = ThreadSettings { kind: ThreadKind::Paper, count: 4, rows: 3, seed: 1 };

    fn clay() -> Brdf {
        Brdf::builtin("clay").unwrap()
    }

    fn fetch(brdf: &Brdf, settings: &ThreadSettings, folder: &Path) -> (Threads, CacheState) {
        let (table, state, _) = load_or_generate(brdf, settings, Some(folder), &()).unwrap();
        (table, state)
    }

    #[test]
    fn the_second_time_is_a_hit_and_any_other_question_a_miss() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("made/on/demand");
        let (table, state) = fetch(&clay(), &SETTINGS, &folder);
        assert_eq!(state, CacheState::Miss);
        assert_eq!(fetch(&clay(), &SETTINGS, &folder), (table, CacheState::Hit));
        for settings in [
            ThreadSettings { kind: ThreadKind::Fitted, ..SETTINGS },
            ThreadSettings { count: 5, ..SETTINGS },
            ThreadSettings { rows: 4, ..SETTINGS },
            ThreadSettings { seed: 2, ..SETTINGS },
        ] {
            assert_eq!(fetch(&clay(), &settings, &folder).1, CacheState::Miss);
        }
        assert_eq!(fetch(&Brdf::builtin("gold").unwrap(), &SETTINGS, &folder).1, CacheState::Miss);
    }

    #[test]
    fn a_damaged_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (table, _) = fetch(&clay(), &SETTINGS, folder.path());
        let path = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
        std::fs::write(&path, &std::fs::read(&path).unwrap()[..100]).unwrap();
        assert_eq!(fetch(&clay(), &SETTINGS, folder.path()), (table.clone(), CacheState::Miss));
        assert_eq!(fetch(&clay(), &SETTINGS, folder.path()), (table, CacheState::Hit));
    }

    #[test]
    fn no_cache_and_an_unwritable_one_still_give_threads() {
        let folder = tempfile::tempdir().unwrap();
        let occupied = folder.path().join("file");
        std::fs::write(&occupied, "").unwrap();
        assert_eq!(fetch(&clay(), &SETTINGS, &occupied).1, CacheState::Miss);
        assert_eq!(load_or_generate(&clay(), &SETTINGS, None, &()).unwrap().1, CacheState::Miss);
    }
}
