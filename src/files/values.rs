//! A number and many values in a file: the form of what is kept on disk of an environment.
//!
//! | bytes | content, little-endian |
//! |---|---|
//! | 8 | magic |
//! | 4 | u32 format version |
//! | 4 | u32 number: what the count of values follows from |
//! | ... | values, f32 |
//! | 32 | BLAKE3 digest of everything before |
use std::path::Path;

use super::{sealed, unsealed};
use crate::error::{Error, Result};

/// What tells such files from others.
pub(crate) struct ValuesFormat {
    /// What they begin with.
    pub magic: &'static [u8; 8],
    /// To be raised when the same things get other values.
    pub version: u32,
}

impl ValuesFormat {
    /// The bytes of a file.
    pub fn encode(&self, number: u32, values: impl IntoIterator<Item = f32>) -> Vec<u8> {
        let mut bytes = self.magic.to_vec();
        bytes.extend(self.version.to_le_bytes());
        bytes.extend(number.to_le_bytes());
        let values: Vec<_> = values.into_iter().map(f32::to_le_bytes).collect();
        bytes.extend_from_slice(values.as_flattened());
        sealed(bytes)
    }

    /// What `output` makes of the number and the values in the bytes of the file at `path`.
    ///
    /// # Errors
    /// They are not a whole file of this version, or there is no output of them.
    pub fn parse<T>(&self, path: &Path, bytes: &[u8], output: impl Fn(u32, &[[u8; 4]]) -> Option<T>) -> Result<T> {
        let decode = || {
            let rest = unsealed(bytes)?.strip_prefix(self.magic)?.strip_prefix(&self.version.to_le_bytes())?;
            let (number, values) = rest.split_first_chunk()?;
            let (values, []) = values.as_chunks() else { return None };
            output(u32::from_le_bytes(*number), values)
        };
        decode().ok_or_else(|| Error::in_file(path, "is damaged", "it is made again"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORMAT: ValuesFormat = ValuesFormat { magic: b"NUMBERS\0", version: 3 };

    fn parse(format: &ValuesFormat, bytes: &[u8]) -> Result<(u32, Vec<f32>)> {
        let values = |values: &[[u8; 4]]| values.iter().map(|&value| f32::from_le_bytes(value)).collect();
        format.parse(Path::new("x.numbers"), bytes, |number, bytes| (number < 9).then(|| (number, values(bytes))))
    }

    #[test]
    fn what_is_written_is_read_to_the_bit() {
        for values in [vec![], vec![0.1, -0.0, f32::MAX]] {
            assert_eq!(parse(&FORMAT, &FORMAT.encode(7, values.iter().copied())).unwrap(), (7, values));
        }
    }

    #[test]
    fn what_is_damaged_or_of_another_kind_or_version_is_refused_by_name() {
        let whole = FORMAT.encode(7, [1.0, 2.0]);
        let others = [ValuesFormat { magic: b"NUMBER2\0", ..FORMAT }, ValuesFormat { version: 4, ..FORMAT }];
        let refused =
            |format, bytes: &[u8]| parse(format, bytes).is_err_and(|error| error.to_string().contains("x.numbers"));
        assert!(others.iter().all(|other| refused(other, &whole)));
        assert!((0..whole.len()).all(|length| refused(&FORMAT, &whole[..length])));
        let half_a_value = &unsealed(&whole).unwrap()[..18];
        assert!(refused(&FORMAT, &sealed(half_a_value.to_vec())));
        assert!(refused(&FORMAT, &FORMAT.encode(9, [])), "a number that nothing is made of");
        for at in 0..whole.len() {
            let mut flipped = whole.clone();
            flipped[at] ^= 1;
            assert!(refused(&FORMAT, &flipped), "{at}");
        }
    }
}
