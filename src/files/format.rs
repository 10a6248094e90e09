//! File formats: by which extension a file is known, what it is called, how its bytes are parsed.
//!
//! A format is one file with a constant `FORMAT`, and an entry in the `file_formats!` of what it holds. Loading, errors, help
//! texts and what can be dropped on the viewer follow.
use std::path::Path;

use super::read;
use crate::error::{Error, Result};
use crate::progress::Observer;

/// A format of files that hold a `T`.
pub struct FileFormat<T: 'static> {
    /// Extension of their names: lower case, no dot.
    pub extension: &'static str,
    /// What such a file is called, with its article: `a Radiance .hdr`.
    pub name: &'static str,
    /// Tells bytes of this format from those of other kinds of file with the same extension.
    pub is_of_format: fn(&[u8]) -> bool,
    /// Reads the bytes of the file at `path`, which is only named in errors. What takes long may be cancelled.
    pub parse: fn(path: &Path, bytes: &[u8], observer: &dyn Observer) -> Result<T>,
}

/// Declares the modules of formats, and `FORMATS`, the list of them: an entry each.
macro_rules! file_formats {
    ($visibility:vis $T:ty: $($module:ident),+ $(,)?) => {
        $(mod $module;)+
        $visibility const FORMATS: &[crate::files::FileFormat<$T>] = &[$($module::FORMAT),+];
    };
}
pub(crate) use file_formats;

/// All formats of what holds a `T`.
pub struct FileKind<T: 'static> {
    /// What such files are: `environment`.
    pub what: &'static str,
    /// At least one.
    pub formats: &'static [FileFormat<T>],
    /// What can be named instead of a file.
    pub builtin_names: fn() -> Vec<&'static str>,
}

impl<T> FileKind<T> {
    /// Reads and parses the file at `path`.
    ///
    /// # Errors
    /// See [`Self::read`] and the format's own.
    pub fn load(&self, path: &Path) -> Result<T> {
        self.parse(path, &self.read(path)?)
    }

    /// The bytes of the file at `path`.
    ///
    /// # Errors
    /// An extension of no format; what [`read`] says.
    pub fn read(&self, path: &Path) -> Result<Vec<u8>> {
        self.format_of(path)?;
        read(path)
    }

    /// Parses the bytes of the file at `path`, whose extension says how.
    ///
    /// # Errors
    /// An extension of no format, and the format's own.
    pub fn parse(&self, path: &Path, bytes: &[u8]) -> Result<T> {
        self.parse_watched(path, bytes, &())
    }

    /// The same, which `observer` may end.
    ///
    /// # Errors
    /// As for [`Self::parse`]; cancelled.
    pub fn parse_watched(&self, path: &Path, bytes: &[u8], observer: &dyn Observer) -> Result<T> {
        (self.format_of(path)?.parse)(path, bytes, observer)
    }

    /// The format of the file at `path`, by its extension.
    ///
    /// # Errors
    /// No format has it.
    pub fn format_of(&self, path: &Path) -> Result<&FileFormat<T>> {
        let extension = path.extension().unwrap_or_default();
        self.formats.iter().find(|format| extension.eq_ignore_ascii_case(format.extension)).ok_or_else(|| {
            let problem = format!("is no known kind of {}", self.what);
            Error::in_file(path, problem, self.remedy_for(&path.to_string_lossy()))
        })
    }

    /// Whether the file at `path` is of one of the formats, by its extension and its bytes.
    ///
    /// # Errors
    /// What [`read`] says.
    pub fn knows(&self, path: &Path) -> Result<bool> {
        self.format_of(path).map_or(Ok(false), |format| Ok((format.is_of_format)(&read(path)?)))
    }

    /// `a Radiance .hdr or an OpenEXR .exr`.
    pub fn names(&self) -> String {
        alternatives(self.formats.iter().map(|format| format.name.to_owned()))
    }

    /// `.hdr or .exr`.
    pub fn extensions(&self) -> String {
        alternatives(self.formats.iter().map(|format| format!(".{}", format.extension)))
    }

    /// What to give in the place of `name`, which is none of the formats and not built in.
    pub fn remedy_for(&self, name: &str) -> String {
        let builtin = (self.builtin_names)();
        let files = format!("give {}", self.names());
        // Where one of these may stand by its name alone it is no file's.
        if let Some(builtin) = builtin.iter().find(|builtin| Path::new(name).ends_with(builtin)) {
            return format!("{files}, or in a scene builtin = \"{builtin}\" in its place");
        }
        // The nearest: names may differ in a letter.
        let near = builtin.iter().filter(|builtin| is_misspelt(name, builtin));
        match near.min_by_key(|builtin| misspellings(name, builtin)) {
            Some(near) => format!("write {near}, or {files}"),
            None if builtin.is_empty() => files,
            None => format!("{files}, or a built-in: {}", builtin.join(", ")),
        }
    }
}

/// Whether `given` is `word` in other letter cases, or but for a letter in four: others, of which one may begin as another, are farther from
/// each other.
pub(crate) fn is_misspelt(given: &str, word: &str) -> bool {
    let is_in_other_cases = given.eq_ignore_ascii_case(word) && given != word;
    is_in_other_cases || (misspellings(given, word) * 4 <= word.len() && !given.starts_with(word))
}

/// How many letters of `given` are not as in `word`, whatever their cases.
fn misspellings(given: &str, word: &str) -> usize {
    strsim::damerau_levenshtein(&given.to_ascii_lowercase(), &word.to_ascii_lowercase())
}

/// `a, b or c`.
fn alternatives(words: impl Iterator<Item = String>) -> String {
    let mut words: Vec<_> = words.collect();
    let last = words.pop().unwrap_or_default();
    if words.is_empty() { last } else { format!("{} or {last}", words.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Brdf;
    use crate::environment::Environment;
    use crate::scene::{Mesh, Scene};

    #[test]
    fn an_extension_of_no_format_is_refused_with_those_that_are() {
        let refused = |error: Error, words: &[&str]| {
            let error = error.to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{error}");
        };
        let path = Path::new("x.jpg");
        refused(Brdf::load(path).unwrap_err(), &["x.jpg", ".binary", ".toml", "gold"]);
        refused(Environment::load(path).unwrap_err(), &["x.jpg", ".hdr", ".exr", "studio"]);
        refused(Mesh::load(path).unwrap_err(), &["x.jpg", ".obj", "sphere"]);
        refused(Scene::FILES.load(path).map(drop).unwrap_err(), &["x.jpg", ".toml"]);
    }

    #[test]
    fn a_name_in_other_letter_cases_is_told_as_it_is_written() {
        for given in ["Gold", "GOLD", "GLOD"] {
            assert!(Brdf::FILES.remedy_for(given).starts_with("write gold, or "), "{given}");
        }
        for given in ["Sky", "SKY"] {
            assert!(Environment::FILES.remedy_for(given).starts_with("write sky, or "), "{given}");
        }
        assert!(Mesh::FILES.remedy_for("meshes/sphere").ends_with("in a scene builtin = \"sphere\" in its place"));
        assert!(Mesh::FILES.remedy_for("SPHERE").starts_with("write sphere, or "));
        // What a file is called that has the name of a built-in, and what is far from any.
        for given in ["gold", "goldfish", "bronze-age"] {
            assert!(!Brdf::FILES.remedy_for(given).starts_with("write "), "{given}");
        }
    }
}
