//! Pyramids of vMF kernels as files.
//!
//! | bytes | content, little-endian |
//! |---|---|
//! | 8 | magic `VMFMAPS\0` |
//! | 4 | u32 format version |
//! | 4 | u32 texels along the edge of a face of level 0 |
//! | ... | levels from fine to coarse: RGB, f32 |
//! | 32 | BLAKE3 digest of everything before |
use std::path::Path;

use super::pyramid::MAX_FACE_SIZE;
use super::{BlurKernel, Pyramid, VmfPyramid};
use crate::error::{Error, Result};
use crate::files::{self, sealed, unsealed, write_whole};

/// Version of the file format and of the maps in it: to be raised when the same environment gets others.
pub const FORMAT_VERSION: u32 = 5;

const MAGIC: &[u8; 8] = b"VMFMAPS\0";

fn encode(pyramid: &VmfPyramid) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(FORMAT_VERSION.to_le_bytes());
    bytes.extend((pyramid.levels.face_size as u32).to_le_bytes());
    for map in &pyramid.levels.levels {
        bytes.extend(map.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    }
    sealed(bytes)
}

/// Writes `pyramid` to the file at `path`, whole or not at all.
///
/// # Errors
/// A place that cannot be written to.
pub fn write(path: &Path, pyramid: &VmfPyramid) -> Result<()> {
    write_whole(path, &encode(pyramid))
}

/// Reads the file at `path`.
///
/// # Errors
/// A file that cannot be read, or is not whole.
pub fn read(path: &Path) -> Result<VmfPyramid> {
    parse(path, &files::read(path)?)
}

/// The pyramid in the bytes of the file at `path`.
///
/// # Errors
/// They are not a whole file of this version.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<VmfPyramid> {
    decode(bytes).ok_or_else(|| Error::in_file(path, "is damaged", "it is made again"))
}

fn decode(bytes: &[u8]) -> Option<VmfPyramid> {
    let rest = unsealed(bytes)?.strip_prefix(MAGIC)?.strip_prefix(&FORMAT_VERSION.to_le_bytes())?;
    let (&face_size, mut rest) = rest.split_first_chunk()?;
    let face_size = u32::from_le_bytes(face_size) as usize;
    if !face_size.is_power_of_two() || face_size > MAX_FACE_SIZE {
        return None;
    }
    let mut maps = Vec::new();
    let steps = VmfPyramid::steps(face_size).into_iter().filter(|step| step.kernel != BlurKernel::Mean);
    for size in steps.map(|step| step.size) {
        let (map, after) = rest.split_at_checked(6 * size * size * size_of::<[f32; 3]>())?;
        let values = map.as_chunks().0.iter().map(|&value| f32::from_le_bytes(value));
        maps.push(values.collect::<Vec<_>>().as_chunks().0.to_vec());
        rest = after;
    }
    rest.is_empty().then_some(VmfPyramid { levels: Pyramid { face_size, levels: maps } })
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;

    fn pyramid() -> VmfPyramid {
        VmfPyramid::new(&Pyramid::box_filtered(&environment(16, 8, |x, y| [x as f32, y as f32 / 3.0, 1.0])), &())
            .unwrap()
    }

    #[test]
    fn what_is_written_is_read_to_the_bit_and_a_damaged_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.pyramid");
        write(&path, &pyramid()).unwrap();
        assert_eq!(read(&path).unwrap(), pyramid());
        let whole = std::fs::read(&path).unwrap();
        let mut flipped = whole.clone();
        flipped[1000] ^= 1;
        for damaged in [&whole[..100], &whole[..10], &flipped, b""] {
            std::fs::write(&path, damaged).unwrap();
            assert!(read(&path).unwrap_err().to_string().contains("x.pyramid"));
        }
    }

    #[test]
    fn sizes_that_do_not_fit_the_content_are_refused() {
        let whole = encode(&pyramid());
        let content = unsealed(&whole).unwrap();
        let is_read = |content: Vec<u8>| decode(&sealed(content)).is_some();
        assert!(is_read(content.to_vec()));
        assert!(!is_read(content[..content.len() - 4].to_vec()));
        assert!(!is_read([content, &[0; 4]].concat()));
        for face_size in [0, 3, 1, 2 * MAX_FACE_SIZE as u32, u32::MAX] {
            let mut other = content.to_vec();
            other[12..16].copy_from_slice(&face_size.to_le_bytes());
            assert!(!is_read(other), "{face_size}");
        }
    }
}
