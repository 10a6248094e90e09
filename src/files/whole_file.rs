//! Files that are written whole or not at all, and what is swept up after writers that were killed.
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// How names of temporary files begin; letters and digits follow.
const PREFIX: &str = ".threadlight-";
/// How many of them.
const LETTERS: usize = 6;
/// A writer that lives has written to its temporary file within this time: the bytes are all there when it begins.
const MOST_AGE: Duration = Duration::from_secs(60);

/// Says at once whether a file could be written to `path`, so that a long rendering does not end in an error.
pub fn check_writable(path: &Path) -> Result<()> {
    match target(path) {
        _ if path.is_dir() || names_a_folder(path) => Err(Error::unwritable(path, "it is a folder")),
        // A pipe may have no reader yet.
        Target::Stream => Ok(()),
        Target::File(file) => temporary_beside(path, &file).map(drop),
    }
}

/// The same of several files of one command, which are not to overwrite each other.
pub fn check_all_writable<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
    let mut files = Vec::new();
    for path in paths {
        check_writable(path)?;
        if let Target::File(file) = target(path) {
            if files.contains(&file) {
                return Err(Error::in_file(path, "is to be written twice", "give each file a name of its own"));
            }
            files.push(file);
        }
    }
    Ok(())
}

/// Says at once if a file is to be `written` that was `read`: it would be lost.
pub fn check_not_read<'a>(
    written: impl IntoIterator<Item = &'a (impl AsRef<Path> + ?Sized + 'a)>,
    read: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<()> {
    let file = |path: &Path| match target(path) {
        Target::File(file) => Some(file),
        Target::Stream => None,
    };
    let read: Vec<_> = read.into_iter().filter_map(|path| file(path)).collect();
    match written.into_iter().map(AsRef::as_ref).find(|path| file(path).is_some_and(|file| read.contains(&file))) {
        Some(path) => Err(Error::in_file(path, "is also read, and would be lost", "give what is written another name")),
        None => Ok(()),
    }
}

/// Whether the name ends in a separator, which no file's does.
fn names_a_folder(path: &Path) -> bool {
    path.to_string_lossy().ends_with(std::path::is_separator)
}

/// The file of this name and extension in `folder`. Names of materials may hold what names of files may not, on any system: that becomes `_`.
pub fn file_in(folder: &Path, name: &str, extension: &str) -> PathBuf {
    folder.join(format!("{}.{extension}", file_name(name)))
}

/// `name` as a part of a file's.
pub fn file_name(name: &str) -> String {
    name.replace(|character: char| "/\\:*?\"<>|".contains(character) || character.is_control(), "_")
}

/// Writes `bytes` to `path`: into a temporary file in the same folder first, then renamed, so that whoever looks sees
/// the old file or the whole new one, and a failure leaves nothing behind. Devices and pipes are written to as they are, and so is what the
/// program was given open, such as /dev/stdout, and a file that is mounted by itself.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let failed = |cause: io::Error| Error::unwritable(path, cause);
    match target(path) {
        Target::Stream => write_to_stream(path, bytes),
        Target::File(file) => {
            let mut temporary = temporary_beside(path, &file)?;
            // Errors of the file itself do not repeat the temporary file's name.
            let written =
                keep_permissions(temporary.as_file(), &file).and_then(|()| temporary.as_file_mut().write_all(bytes));
            written.and_then(|()| match temporary.persist(&file) {
                // What is mounted by itself, as containers do with single files, cannot be replaced.
                Err(failed) if failed.error.kind() == io::ErrorKind::ResourceBusy => std::fs::write(&file, bytes),
                persisted => persisted.map(drop).map_err(|failed| failed.error),
            })
        }
    }
    .map_err(failed)
}

/// Writes behind what is there: a file that standard output was sent to may hold more.
fn write_to_stream(path: &Path, bytes: &[u8]) -> io::Result<()> {
    match descriptor(path) {
        // What is printed later follows.
        Some(1) => io::stdout().write_all(bytes).and_then(|()| io::stdout().flush()),
        _ => OpenOptions::new().append(true).open(path).and_then(|mut stream| stream.write_all(bytes)),
    }
}

/// Gives the `new` file the permissions of the `old` one, whose place it takes, if there is one.
fn keep_permissions(new: &File, old: &Path) -> io::Result<()> {
    match old.metadata().map(|old| old.permissions()) {
        Ok(permissions) if permissions != new.metadata()?.permissions() => new.set_permissions(permissions),
        _ => Ok(()),
    }
}

/// Removes what is no file from where a file of a cache is to be: an empty folder, a pipe, a link.
pub(crate) fn make_way(path: &Path) -> Result<()> {
    let removed = match path.symlink_metadata() {
        Ok(metadata) if metadata.is_dir() => std::fs::remove_dir(path),
        Ok(metadata) if !metadata.is_file() => std::fs::remove_file(path),
        _ => Ok(()),
    };
    removed.map_err(|cause| Error::unwritable(path, cause))
}

/// What a path leads to.
enum Target {
    /// A file, or nothing yet; links are followed, so that they stay.
    File(PathBuf),
    /// A device, a pipe, or what the program was given open, such as /dev/stdout: nothing that a file may be put in the place of.
    Stream,
}

/// The number of what the program was given open, if `path` leads to that, as /dev/stdout does.
fn descriptor(path: &Path) -> Option<u32> {
    let within_descriptors = |path: &PathBuf| {
        let folder = folder_of(path).canonicalize().ok()?;
        let is_of_system = folder.starts_with("/proc") || folder.starts_with("/dev");
        let number = path.file_name()?.to_str()?.parse().ok()?;
        (is_of_system && folder.ends_with("fd")).then_some(number)
    };
    links(path).find_map(|path| within_descriptors(&path))
}

fn target(path: &Path) -> Target {
    match path.metadata() {
        _ if descriptor(path).is_some() => Target::Stream,
        Ok(metadata) if !metadata.is_file() && !metadata.is_dir() => Target::Stream,
        Ok(_) => Target::File(path.canonicalize().unwrap_or_else(|_| path.to_owned())),
        Err(_) => {
            let path = linked(path);
            // Two names of one file that is not there yet differ in their folders.
            let folder = folder_of(&path).canonicalize().ok();
            let file = folder.zip(path.file_name()).map(|(folder, name)| folder.join(name));
            Target::File(file.unwrap_or(path))
        }
    }
}

/// Where `path` points to if it is a link to a file that is not there yet; else itself.
fn linked(path: &Path) -> PathBuf {
    links(path).last().unwrap_or_default()
}

/// `path`, and where it leads, link by link: over as many as Linux follows.
fn links(path: &Path) -> impl Iterator<Item = PathBuf> {
    let next = |path: &PathBuf| path.read_link().ok().map(|link| folder_of(path).join(link));
    std::iter::successors(Some(path.to_owned()), next).take(40)
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// An empty file in the folder of `file`, deleted when dropped. Errors name `path`.
fn temporary_beside(path: &Path, file: &Path) -> Result<NamedTempFile> {
    let folder = folder_of(file);
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).rand_bytes(LETTERS);
    // A temporary file is private (0600) unless told otherwise; the picture is to be as readable as any other file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let temporary = builder.tempfile_in(folder).map_err(|cause| {
        // The temporary file's name, with which the cause ends, is of no use to the user.
        let text = cause.to_string();
        let reason = text.split(" at path ").next().unwrap_or_default();
        Error::unwritable(path, io::Error::new(cause.kind(), reason))
    })?;
    sweep(folder, &temporary);
    Ok(temporary)
}

/// Removes the temporary files of writers that were killed. The new one tells the time: a folder may be on another machine, with a clock
/// of its own. What cannot be removed is left.
fn sweep(folder: &Path, new: &NamedTempFile) {
    let Some(now) = new.as_file().metadata().ok().and_then(|metadata| metadata.modified().ok()) else { return };
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_temporary = |name: &str| name.strip_prefix(PREFIX).is_some_and(|rest| rest.len() == LETTERS);
        if !entry.file_name().to_str().is_some_and(is_temporary) {
            continue;
        }
        let Ok(metadata) = entry.metadata() else { continue };
        let age = metadata.modified().ok().and_then(|modified| now.duration_since(modified).ok());
        if metadata.is_file() && age.is_some_and(|age| age > MOST_AGE) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn what_a_killed_writer_left_is_swept_up_by_a_later_one() {
        let folder = tempfile::tempdir().unwrap();
        let old = [".threadlight-abc123", ".threadlight-x", "threadlight-abc123", ".threadlight-abc124"];
        for name in old {
            let file = File::create(folder.path().join(name)).unwrap();
            // The last one may be a living writer's.
            if name != old[3] {
                file.set_modified(std::time::SystemTime::now() - 2 * MOST_AGE).unwrap();
            }
        }
        write_whole(&folder.path().join("new"), b"new").unwrap();
        assert_eq!(names(folder.path()), [".threadlight-abc124", ".threadlight-x", "new", "threadlight-abc123"]);
    }

    #[test]
    fn one_file_is_not_written_twice_by_whatever_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("below")).unwrap();
        check_all_writable(&[path("a"), path("b"), path("below/a")]).unwrap();
        for name in ["a", "below/../a", "./a"] {
            let error = check_all_writable(&[path("a"), path("b"), path(name)]).unwrap_err().to_string();
            assert!(error.contains("is to be written twice"), "{error}");
        }
        check_all_writable(&["/dev/null", "/dev/null"].map(PathBuf::from)).unwrap();
        assert!(check_writable(&path("c.png/")).unwrap_err().to_string().contains("it is a folder"));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_what_it_points_to_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let (link, file) = (folder.path().join("link"), folder.path().join("below/file"));
        std::fs::create_dir(folder.path().join("below")).unwrap();
        std::fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink("below/file", &link).unwrap();
        write_whole(&link, b"new").unwrap();
        assert!(link.is_symlink() && std::fs::read(&file).unwrap() == b"new");
        assert_eq!(names(&folder.path().join("below")), ["file"]);
        // Also where nothing is there yet, over several links.
        std::os::unix::fs::symlink("below/file", folder.path().join("second")).unwrap();
        std::fs::remove_file(&file).unwrap();
        std::fs::remove_file(&link).unwrap();
        std::os::unix::fs::symlink("second", &link).unwrap();
        write_whole(&link, b"newer").unwrap();
        assert!(link.is_symlink() && std::fs::read(&file).unwrap() == b"newer");
        assert!(check_all_writable(&[link, file]).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_overwritten_keeps_its_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        for mode in [0o600, 0o664, 0o444] {
            std::fs::write(&path, "old").unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            write_whole(&path, b"new").unwrap();
            assert_eq!(path.metadata().unwrap().permissions().mode() & 0o777, mode);
            std::fs::remove_file(&path).unwrap();
        }
    }

    #[test]
    fn what_cannot_be_written_is_told_in_the_words_of_the_system() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent/file");
        let system = File::create(&path).unwrap_err();
        let error = write_whole(&path, b"new").unwrap_err();
        assert!(matches!(error, Error::Input { .. }) && error.to_string().contains(&format!("({system})")), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_the_program_was_given_open_is_written_behind_what_is_there() {
        use std::os::fd::AsRawFd;
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("lines"), "old\n").unwrap();
        let open = OpenOptions::new().append(true).open(path("lines")).unwrap();
        let name = PathBuf::from(format!("/dev/fd/{}", open.as_raw_fd()));
        std::os::unix::fs::symlink(&name, path("link")).unwrap();
        for (place, line) in [(&name, "first\n"), (&path("link"), "second\n")] {
            check_writable(place).unwrap();
            write_whole(place, line.as_bytes()).unwrap();
        }
        assert_eq!(std::fs::read_to_string(path("lines")).unwrap(), "old\nfirst\nsecond\n");
        assert!(path("link").is_symlink());
        // A file without a name is written to, too, and gets none.
        std::fs::remove_file(path("lines")).unwrap();
        write_whole(&name, b"third\n").unwrap();
        assert_eq!(names(folder.path()), ["link"]);
        assert_eq!(open.metadata().unwrap().len(), 23);
        let numbers =
            ["/dev/stdout", "/dev/stderr", "/proc/self/fd/7", "/dev/null", "fd/1"].map(Path::new).map(descriptor);
        assert_eq!(numbers, [Some(1), Some(2), Some(7), None, None]);
    }

    #[test]
    fn a_file_that_is_named_after_anything_is_in_its_folder() {
        let folder = Path::new("pictures");
        for (name, file) in [
            ("gold", "gold.png"),
            ("/merl/a b.binary", "_merl_a b.binary.png"),
            ("..", "...png"),
            ("v1.2\n", "v1.2_.png"),
        ] {
            assert_eq!(file_in(folder, name, "png"), folder.join(file));
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_stays_a_device_and_says_that_it_is_full() {
        for path in ["/dev/null", "/dev/full"].map(Path::new) {
            check_writable(path).unwrap();
            let written = write_whole(path, b"new");
            assert!(!path.is_file());
            match path.ends_with("null") {
                true => written.unwrap(),
                false => {
                    let error = written.unwrap_err();
                    let text = error.to_string();
                    assert!(text.contains("/dev/full") && text.contains("No space left"), "{text}");
                    assert!(matches!(error, Error::Disk { .. }) && text.contains("make room"), "{text}");
                }
            }
        }
    }
}
