//! Moments of light as files: of the form in src/files/values.rs, whose number is how many powers of the cosine there are, and whose values
//! are, for each normal, red, green, blue and constant light times these.
use std::path::Path;

use super::LightMoments;
use crate::error::Result;
use crate::files::{self, ValuesFormat, write_whole};

/// Version of the file format and of the moments in it: to be raised when the same environment gets others.
pub const FORMAT_VERSION: u32 = 2;

const FORMAT: ValuesFormat = ValuesFormat { magic: b"MOMENTS\0", version: FORMAT_VERSION };

/// Writes `moments` to the file at `path`, whole or not at all.
///
/// # Errors
/// A place that cannot be written to.
pub fn write(path: &Path, moments: &LightMoments) -> Result<()> {
    write_whole(path, &FORMAT.encode(moments.terms() as u32, moments.values()))
}

/// Reads the file at `path`.
///
/// # Errors
/// A file that cannot be read, or is not whole.
pub fn read(path: &Path) -> Result<LightMoments> {
    parse(path, &files::read(path)?)
}

/// The moments in the bytes of the file at `path`.
///
/// # Errors
/// They are not a whole file of this version.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<LightMoments> {
    FORMAT.parse(path, bytes, |terms, values| {
        LightMoments::of_values(terms as usize, values.iter().map(|&value| f32::from_le_bytes(value)))
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;
    use crate::brdf::BaseProfile;

    fn moments(terms: usize) -> LightMoments {
        LightMoments::of(&environment(16, 8, |x, y| [x as f32, y as f32 / 3.0, 1.0]), terms, &()).unwrap()
    }

    #[test]
    fn what_is_written_is_read_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        for terms in [1, BaseProfile::TERMS] {
            let path = folder.path().join(format!("{terms}.moments"));
            write(&path, &moments(terms)).unwrap();
            assert_eq!(read(&path).unwrap(), moments(terms));
        }
    }

    #[test]
    fn terms_that_do_not_fit_the_content_are_refused() {
        let moments = moments(1);
        let is_read = |terms, values: Vec<f32>| parse(Path::new("x"), &FORMAT.encode(terms, values)).is_ok();
        assert!(is_read(1, moments.values().collect()));
        assert!(!is_read(1, moments.values().skip(1).collect()));
        assert!(!is_read(1, moments.values().chain([0.0]).collect()));
        for terms in [0, 2, BaseProfile::TERMS as u32, u32::MAX] {
            assert!(!is_read(terms, moments.values().collect()), "{terms}");
        }
    }
}
