//! The library's one error type: what went wrong, in which file or object, and what to do about it.
use std::path::Path;

/// Result of everything in the library that can fail.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error of a layer above this file, which knows none of them.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// Why the library could not do as asked.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file or a value given by the user cannot be used.
    #[error("{subject}: {problem}; {remedy}")]
    Input {
        /// File name, flag or key that the problem is in.
        subject: String,
        /// What is wrong, in half a sentence.
        problem: String,
        /// What the user can do about it, in half a sentence.
        remedy: String,
    },
    /// A file cannot be written though its place is one for files: the disk is full, or fails.
    #[error("{file}: cannot be written ({cause}); make room, or write to another disk")]
    Disk {
        /// Its name.
        file: String,
        /// What the system said.
        cause: std::io::Error,
    },
    /// The frame that was declared contradicts itself: a `GraphError`.
    #[error("frame graph: {0}")]
    Graph(#[source] Cause),
    /// Vulkan refused something: a `VulkanError`.
    #[error(transparent)]
    Vulkan(Cause),
    /// The window system refused something, or there is none.
    #[error("no window: {cause}; `threadlight render` needs none")]
    Window {
        /// What it said.
        cause: String,
    },
    /// The user, or the program on the user's behalf, stopped a long computation.
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    /// An [`Error::Input`] about the file at `path`.
    pub fn in_file(path: &Path, problem: impl ToString, remedy: impl ToString) -> Self {
        Self::input(path.display(), problem, remedy)
    }

    /// An [`Error::Input`] about `subject`: a flag, a key, a name.
    pub fn input(subject: impl ToString, problem: impl ToString, remedy: impl ToString) -> Self {
        let [subject, problem, remedy] = [subject.to_string(), problem.to_string(), remedy.to_string()].map(one_line);
        Self::Input { subject, problem, remedy }
    }

    /// An [`Error::Input`] for a file that cannot be opened or read.
    pub fn unreadable(path: &Path, cause: std::io::Error) -> Self {
        Self::in_file(path, format!("cannot be read ({cause})"), "check the name and its permissions")
    }

    /// A file that cannot be written: an [`Error::Input`] where another name would do, else an [`Error::Disk`].
    pub fn unwritable(path: impl AsRef<Path>, cause: impl Into<Cause>) -> Self {
        let path = path.as_ref();
        let cause: Cause = match cause.into().downcast::<std::io::Error>() {
            Ok(cause) if !is_of_name(&cause) => {
                return Self::Disk { file: one_line(path.display().to_string()), cause: *cause };
            }
            Ok(cause) => cause,
            Err(other) => other,
        };
        let remedy = "choose a folder that exists and may be written to";
        Self::in_file(path, format!("cannot be written ({cause})"), remedy)
    }

    /// The same error with `context` (a file, a section of it) in front of its subject.
    pub fn within(self, context: impl std::fmt::Display) -> Self {
        match self {
            Self::Input { subject, problem, remedy } => {
                Self::Input { subject: one_line(format!("{context}: {subject}")), problem, remedy }
            }
            other => other,
        }
    }
}

/// Whether a file could be written by another name.
fn is_of_name(cause: &std::io::Error) -> bool {
    use std::io::ErrorKind::*;
    let is_missing = matches!(cause.kind(), NotFound | NotADirectory);
    let is_taken = matches!(cause.kind(), AlreadyExists | IsADirectory | DirectoryNotEmpty);
    is_missing
        || is_taken
        || matches!(cause.kind(), PermissionDenied | ReadOnlyFilesystem | InvalidFilename | InvalidInput)
}

/// Longest part of an error, in characters.
const MAX_LETTERS: usize = 2000;

/// What is said quotes files, in which anything can stand: breaks of lines and other control characters are escaped, and what is very long
/// is cut.
fn one_line(text: String) -> String {
    if text.len() <= MAX_LETTERS && !text.contains(char::is_control) {
        return text;
    }
    let mut line = String::new();
    for letter in text.chars().take(MAX_LETTERS) {
        if letter.is_control() {
            line.extend(letter.escape_default());
        } else {
            line.push(letter);
        }
    }
    if text.chars().nth(MAX_LETTERS).is_some() {
        line += "...";
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_quoted_from_a_file_stays_on_one_line() {
        let error = Error::in_file(Path::new("a\nb.toml"), "has no `x\r\n\u{85}\u{1b}[2J`", "remove\nit");
        let said = error.within("c\n").to_string();
        assert_eq!(said, "c\\n: a\\nb.toml: has no `x\\r\\n\\u{85}\\u{1b}[2J`; remove\\nit");
        let long = Error::input("x", "y".repeat(1 << 20), "z").to_string();
        assert!(long.len() < 3000 && long.ends_with("y...; z"), "{}", long.len());
    }
}
