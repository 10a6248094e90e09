//! Pyramids of vMF kernels as files: of the form in src/files/values.rs, whose number is the texels along the edge of a face of level 0, and
//! whose values are red, green and blue of each texel, levels from fine to coarse.
use std::path::Path;

use super::pyramid::MAX_FACE_SIZE;
use super::{BlurKernel, Pyramid, VmfPyramid};
use crate::error::Result;
use crate::files::{self, ValuesFormat, write_whole};

/// Version of the file format and of the maps in it: to be raised when the same environment gets others.
pub const FORMAT_VERSION: u32 = 5;

const FORMAT: ValuesFormat = ValuesFormat { magic: b"VMFMAPS\0", version: FORMAT_VERSION };

fn encode(pyramid: &VmfPyramid) -> Vec<u8> {
    let Pyramid { face_size, levels } = &pyramid.levels;
    FORMAT.encode(*face_size as u32, levels.iter().flat_map(|level| level.as_flattened()).copied())
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
    FORMAT.parse(path, bytes, decode)
}

fn decode(face_size: u32, values: &[[u8; 4]]) -> Option<VmfPyramid> {
    let (mut texels, []) = values.as_chunks() else { return None };
    let face_size = face_size as usize;
    if !face_size.is_power_of_two() || face_size > MAX_FACE_SIZE {
        return None;
    }
    let mut levels = Vec::new();
    let steps = VmfPyramid::steps(face_size).into_iter().filter(|step| step.kernel != BlurKernel::Mean);
    for size in steps.map(|step| step.size) {
        let (level, after) = texels.split_at_checked(6 * size * size)?;
        levels.push(level.iter().map(|texel: &[_; 3]| texel.map(f32::from_le_bytes)).collect());
        texels = after;
    }
    texels.is_empty().then_some(VmfPyramid { levels: Pyramid { face_size, levels } })
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
        let pyramid = pyramid();
        let values = || pyramid.levels.levels.iter().flatten().flatten().copied();
        let is_read = |size, values: Vec<f32>| parse(Path::new("x"), &FORMAT.encode(size, values)).is_ok();
        let size = pyramid.levels.face_size as u32;
        assert!(is_read(size, values().collect()));
        assert!(!is_read(size, values().skip(1).collect()));
        assert!(!is_read(size, values().chain([0.0]).collect()));
        for size in [0, 3, 1, 2 * MAX_FACE_SIZE as u32, u32::MAX] {
            assert!(!is_read(size, values().collect()), "{size}");
        }
    }
}
